"""Mitsuba's BSDFs as surfaces of lobes. Lambent's are thin and two-sided; every loss is noted.

A dielectric coat over a diffuse base (`plastic`, `roughplastic`) becomes a lobe and a coupled diffuse term with
Mitsuba's albedo at normal incidence, T(1) T rho / (eta^2 (1 - rho' R)): T(1) and T are the coat's transmittance of
light from above and of diffuse light, R its reflectance of diffuse light inside, rho' = rho if `nonlinear`, else 1.

Fresnel reflectances become the nearest of Schlick's form. A facet of slope s deflects light that enters a solid by
about (eta - 1) s, and light that passes a sheet by 2 s: a sheet gets the solid's roughness times (eta - 1)/2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from lambent.core.ceilings import LOBES
from lambent.core.errors import did_you_mean
from lambent.core.geometry.directions import Floats
from lambent.core.plain import is_number
from lambent.materials.fresnel import conductor
from lambent.scenes.loaders.mitsuba import fresnel
from lambent.scenes.loaders.mitsuba.fresnel import COS, IOR, METALS, nearest_fresnel, nearest_passage
from lambent.scenes.loaders.mitsuba.principled import principled
from lambent.scenes.loaders.mitsuba.values import Plugin, colour, number, opacity, raw_values
from lambent.scenes.loaders.surfaces.surface import BLACK, GREY, ROUGHNESS_MIN, SpecularLobe, Surface, blended
from lambent.scenes.loaders.surfaces.textured import Textured, absolute, combined, constant, scaled

OREN_NAYAR_MEAN = 0.21396  # mean over both hemispheres of max(0, cos phi) sin alpha tan beta
WHITE = np.ones(3)
# Measured by tests/scenes/test_scene_mitsuba_bsdfs.py, from 0 to 75 degrees: the largest error of the albedo, and the
# L1 norm of the error of f cos as a share of the albedo.
PLASTIC = "albedo within .03 of Mitsuba's (at 75 degrees .05), 4 to 13 % of its light elsewhere"
PRINCIPLED = (
    "albedo within .02 of Mitsuba's (at 75 degrees .05), 1 to 9 % of its light elsewhere; no sheen, no flatness"
)
MEASURED = {
    "plastic": "albedo within .01 of Mitsuba's",
    "roughplastic": PLASTIC,
    "pplastic": PLASTIC,
    "roughconductor": "albedo within .07 of Mitsuba's (at 75 degrees .1), 1 to 25 % of its light in other directions",
    "thindielectric": "passes light within .04 of Mitsuba's, reflects .11 too little at 75 degrees",
    "roughdielectric": "spreads light as a solid's face does at normal incidence, a third less at 40 degrees",
    "principled": PRINCIPLED,
    "principledthin": PRINCIPLED,
    "phong": "light within 2 % head-on; at 60 degrees 34 % elsewhere, as half vectors make highlights longer",
    "ward": "light within 3 %",
}  # fmt: skip


def surface_of(plugin: Plugin) -> Surface:
    """The surface that a BSDF describes; for an unknown kind, grey or the BSDF nested in it."""
    known = plugin.reading.surfaces
    key = id(plugin.element)
    if key not in known:
        surface = KINDS.get(plugin.type, _unknown)(plugin)
        LOBES.check(len(surface.lobes), file=plugin.element.file, field=plugin.element.place)
        plugin.note_unread()
        if plugin.type in MEASURED:
            plugin.reading.note(f"{plugin.type}: {MEASURED[plugin.type]}")
        known[key] = surface
    return known[key]


def _unknown(plugin: Plugin) -> Surface:
    inner = plugin.objects("bsdf")
    if plugin.type == "measured":
        plugin.note("its measured file is ignored, it becomes grey: fit the file and assign the fit")
    else:
        plugin.note(f"unknown, {'its nested BSDF is used' if inner else 'it becomes grey'}")
    return surface_of(inner[0]) if inner else Surface.grey()


def _diffuse(plugin: Plugin) -> Surface:
    old = plugin.has("diffuse_reflectance") and not plugin.has("reflectance")
    return Surface(kd=colour(plugin, "diffuse_reflectance" if old else "reflectance", GREY))


def _rough_diffuse(plugin: Plugin) -> Surface:
    """Lambertian with the mean albedo of Oren and Nayar 1994 (eq. 30, without interreflections)."""
    variance = max(plugin.number("alpha", 0.2), 0.0) ** 2 / 2  # of the facets' angles
    if variance > 0:
        plugin.note("becomes Lambertian with the mean albedo of its Oren-Nayar roughness")
    plugin.ignore("use_fast_approx")
    share = 1 - 0.5 * variance / (variance + 0.33) + 0.45 * variance / (variance + 0.09) * OREN_NAYAR_MEAN
    return Surface(kd=scaled(_diffuse(plugin).kd, share))


def _diffuse_transmitter(plugin: Plugin) -> Surface:
    return Surface(kt_d=colour(plugin, "transmittance", GREY))


def _plastic(plugin: Plugin, rough: bool = True) -> Surface:
    eta = _eta(plugin, "polypropylene")
    facets = _facets(plugin, rough)
    slope = float(np.clip(facets.m.mean[0], 1e-3, 1)) if rough else 0.0
    inside = fresnel.mean_reflectance(1 / eta, slope, facets.distribution)
    through = fresnel.mean_transmittance(eta, slope, facets.distribution) / eta**2
    through *= float(fresnel.transmittance(np.ones(1), eta, slope, facets.distribution)[0])
    nonlinear = plugin.flag("nonlinear", False)

    def below(rho: Floats) -> Floats:
        rho = np.clip(rho, 0, 1)
        return np.asarray(through * rho / (1 - (rho if nonlinear else 1.0) * inside))

    kd = combined(below, colour(plugin, "diffuse_reflectance", GREY), notes=[])
    return Surface(kd=kd, coupled=True, lobes=(_specular(plugin, facets, eta),))


def _conductor(plugin: Plugin, rough: bool = False) -> Surface:
    facets = _facets(plugin, rough)
    r0, rise = _metal(plugin)
    return Surface(lobes=(replace(facets, k=scaled(colour(plugin, "specular_reflectance", 1.0), rise), r0=r0),))


def _dielectric(plugin: Plugin, rough: bool = False) -> Surface:
    eta = _eta(plugin, "bk7")
    plugin.note(f"becomes a thin sheet: light is {'spread, ' if rough else ''}not refracted")
    return _sheet(plugin, fresnel.reflectance(COS, eta), (eta - 1) / 2, rough)


def _thin_dielectric(plugin: Plugin) -> Surface:
    once = fresnel.reflectance(COS, _eta(plugin, "bk7"))
    return _sheet(plugin, 2 * once / (1 + once), 1.0, rough=False)  # includes light reflected to and fro inside


def _sheet(plugin: Plugin, reflected: Floats, bend: float, rough: bool) -> Surface:
    """A sheet of a reflectance (at `COS`); transmitted light is spread by `bend` times the facets' slopes."""
    facets = _facets(plugin, rough)
    r0, rise = nearest_fresnel(reflected)
    drawn = rise * (r0 + (1 - r0) * (1 - COS) ** 5)
    share, falloff = nearest_passage(1 - np.maximum(reflected, drawn))  # together they never return more than arrives
    back = replace(facets, k=scaled(colour(plugin, "specular_reflectance", 1.0), rise), r0=np.full(3, r0))
    k = scaled(colour(plugin, "specular_transmittance", 1.0), share)
    spread = scaled(facets.m, bend) if rough else facets.m
    through = replace(facets, m=spread, k=k, r0=BLACK, side="transmission", falloff=falloff)
    return Surface(lobes=(back, through))


def _phong(plugin: Plugin) -> Surface:
    """(n + 2)/(2 pi) cos^n about the mirror direction: as wide and as high as Beckmann's lobe of m^2 = 1/(2n)."""
    exponent = number(plugin, "exponent", 30.0)
    m = combined(lambda n: np.sqrt(0.5 / np.maximum(n, 0.5)), exponent, notes=[])
    kd, ks = colour(plugin, "diffuse_reflectance", GREY), colour(plugin, "specular_reflectance", 0.2)
    return Surface(kd=kd, lobes=(SpecularLobe(m, ks, WHITE, distribution="beckmann", masked=False, falloff=1.0),))


def _ward(plugin: Plugin) -> Surface:
    """Ward's form falls off with the cosine at grazing incidence; Duer's and the balanced one do not."""
    variant = plugin.text("variant", "balanced").lower()
    kd, ks = colour(plugin, "diffuse_reflectance", GREY), colour(plugin, "specular_reflectance", 0.2)
    falloff = 1.0 if variant == "ward" else 0.0
    lobe = replace(_facets(plugin, True), k=ks, distribution="beckmann", masked=False, falloff=falloff)
    return Surface(kd=kd, lobes=(lobe,))


def _nested(plugin: Plugin) -> Surface:
    inner = plugin.objects("bsdf")
    if len(inner) > 1:
        plugin.note("only its first side is used")
    if not inner:
        plugin.note("has no BSDF, it becomes grey")
        return Surface.grey()
    return surface_of(inner[0])


def _coating(plugin: Plugin) -> Surface:
    """A clear coat; its absorption is not read."""
    below = _nested(plugin)
    eta = _eta(plugin, "bk7")
    return below.coated(_specular(plugin, _facets(plugin, plugin.type == "roughcoating"), eta))


def _mask(plugin: Plugin) -> Surface:
    surface = _nested(plugin)
    held = opacity(plugin, "opacity")
    if held.is_texture:
        return replace(surface, opacity=absolute(held))
    share = float(np.clip(held.mean[0], 0, 1))
    if share < 1:
        plugin.note("transmission is .13 too low at 75 degrees")
    return surface if share == 1 else surface.with_opacity(np.full(3, share))


def _normal_map(plugin: Plugin) -> Surface:
    surface = _nested(plugin)
    texture = plugin.texture("normalmap") or next(iter(plugin.objects("texture")), None)
    read = raw_values(texture) if texture is not None else None
    if read is None:
        plugin.note("its normal map cannot be read")
        return surface
    normals = Textured(read.values * 2 - 1, read.uv_transform)
    # Mitsuba's v points down the picture; normal maps in both are made for a v that points up.
    return replace(surface, normal=absolute(normals))


def _bump_map(plugin: Plugin) -> Surface:
    plugin.note("its bump map is ignored")
    plugin.ignore("scale", "")
    plugin.objects("texture")
    return _nested(plugin)


def _blend(plugin: Plugin) -> Surface:
    inner = plugin.objects("bsdf")
    if len(inner) < 2:
        plugin.note("has fewer than two BSDFs")
        return _nested(plugin)
    weight = number(plugin, "weight", 0.5)
    if weight.is_texture:
        plugin.note("its weight is averaged over its texture")
    share = float(np.clip(weight.mean[0], 0, 1))
    return _blended(plugin, [(surface_of(inner[0]), 1 - share), (surface_of(inner[1]), share)])


def _mixture(plugin: Plugin) -> Surface:
    inner = plugin.objects("bsdf")
    words = plugin.text("weights").replace(",", " ").split()
    weights = [float(word) for word in words if is_number(word) and 0 <= float(word) <= 1]
    if not inner or len(weights) != len(inner):
        raise plugin.element.error(
            "number of weights differs from number of BSDFs", got=len(weights), expected=len(inner)
        )
    return _blended(plugin, [(surface_of(p), w) for p, w in zip(inner, weights, strict=True)])


def _blended(plugin: Plugin, shares: list[tuple[Surface, float]]) -> Surface:
    notes: list[str] = []
    surface = blended(shares, notes)
    for text in notes:
        plugin.note(text)
    return surface


def _nothing(plugin: Plugin) -> Surface:
    return Surface().with_opacity(BLACK)


KINDS: dict[str, Callable[[Plugin], Surface]] = {
    "diffuse": _diffuse, "roughdiffuse": _rough_diffuse, "difftrans": _diffuse_transmitter,
    "plastic": partial(_plastic, rough=False), "roughplastic": _plastic, "pplastic": _plastic, "conductor": _conductor,
    "roughconductor": partial(_conductor, rough=True), "dielectric": _dielectric, "thindielectric": _thin_dielectric,
    "roughdielectric": partial(_dielectric, rough=True), "phong": _phong, "ward": _ward, "principled": principled,
    "principledthin": partial(principled, thin=True), "twosided": _nested, "coating": _coating,
    "roughcoating": _coating, "mask": _mask, "normalmap": _normal_map, "bumpmap": _bump_map, "blendbsdf": _blend,
    "mixturebsdf": _mixture, "null": _nothing,
}  # fmt: skip


def _specular(plugin: Plugin, facets: SpecularLobe, eta: float) -> SpecularLobe:
    """The reflection of a dielectric's facets."""
    r0, rise = nearest_fresnel(fresnel.reflectance(COS, eta))
    return replace(facets, k=scaled(colour(plugin, "specular_reflectance", 1.0), rise), r0=np.full(3, r0))


def _facets(plugin: Plugin, rough: bool) -> SpecularLobe:
    """A lobe of the plugin's distribution and roughness that reflects everything."""
    white = constant(WHITE)
    if not rough:
        plugin.reading.note(f"mirrors and clear glass get the least roughness, {ROUGHNESS_MIN}")
        return SpecularLobe(constant(ROUGHNESS_MIN), white, WHITE)
    distribution = plugin.text("distribution", "beckmann").lower()
    if distribution not in ("beckmann", "ggx", "phong", "as"):
        plugin.note(f"unknown distribution {distribution}: Beckmann is used")
    if distribution in ("phong", "as"):
        plugin.note(f"distribution {distribution} becomes Beckmann with the same slopes")
    m = number(plugin, "alpha_u" if plugin.has("alpha_u") else "alpha", 0.1)
    aspect = 1.0
    if plugin.has("alpha_v"):
        across = number(plugin, "alpha_v", 0.1)
        aspect = float(across.mean[0] / max(m.mean[0], 1e-6))
    return SpecularLobe(m, white, WHITE, aspect, distribution="ggx" if distribution == "ggx" else "beckmann")


def _eta(plugin: Plugin, inside: str) -> float:
    """Relative index of refraction, inverted if below 1, because sheets have no inside."""
    eta = _index(plugin, "int_ior", inside) / _index(plugin, "ext_ior", "air")
    eta = max(eta, 1e-3)
    return eta if eta >= 1 else 1 / eta


def _index(plugin: Plugin, name: str, default: str) -> float:
    element = plugin.transform_element(name)
    if element is None or element.tag == "string":
        word = plugin.text(name, default).lower()
        if word not in IOR:
            raise plugin.element.error("unknown index of refraction", got=word, hint=did_you_mean(word, IOR))
        return IOR[word]
    value = plugin.number(name, 1.0)
    if value <= 0:
        raise plugin.element.error("index of refraction is not positive", got=value)
    return value


def _metal(plugin: Plugin) -> tuple[Floats, Floats]:
    """r0 and k, (3,) each, of a conductor."""
    outside = plugin.transform_element("ext_eta")
    around = 1.0
    if outside is not None:
        around = _index(plugin, "ext_eta", "air") if outside.tag in ("string", "float") else 1.0
        plugin.ignore("ext_eta")
    if plugin.has("eta", "k"):
        plugin.ignore("material")
        eta, k = colour(plugin, "eta", 0.0).mean / around, colour(plugin, "k", 1.0).mean / around
        fits = [nearest_fresnel(conductor(COS, n, x)) for n, x in zip(eta, k, strict=True)]
        r0, rise = np.array(fits).T
        return r0, rise
    name = plugin.text("material", "Cu")
    if name.lower() == "none":
        return WHITE, WHITE
    known = {**METALS, **{f"{n}_palik": metal for n, metal in METALS.items()}}
    if name not in known:
        hint = did_you_mean(name, METALS)
        plugin.note(f"unknown metal {name}: aluminium is used{f' ({hint})' if hint else ''}")
        name = "Al"
    straight, grazing = (np.array(v) for v in known[name])
    return straight / grazing, grazing
