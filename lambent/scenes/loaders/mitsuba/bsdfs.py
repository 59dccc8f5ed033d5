"""Mitsuba's BSDFs as surfaces of lobes. Ours are thin and two-sided: what that loses is said.

A dielectric coat over a diffuse base (`plastic`, `roughplastic`) becomes a lobe and a coupled diffuse term with the
albedo that Mitsuba's has at normal incidence: T(1) T rho / (eta^2 (1 - rho' R)), T(1) and T what the coat lets through
from above and of diffuse light, R what it reflects of diffuse light inside, rho' = rho where `nonlinear`, else 1.

Fresnel's terms become the nearest of Schlick's form. A facet of slope s turns what passes a face of a solid by about
(eta - 1) s, where our sheets turn it by 2 s: their roughness is that of the solid times (eta - 1)/2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lambent.core.directions import Floats
from lambent.core.errors import did_you_mean
from lambent.scenes.loaders.mitsuba.interfaces import (
    COS,
    fresnel,
    mean_reflectance,
    mean_transmittance,
    nearest_fresnel,
    nearest_passage,
    transmittance,
)
from lambent.scenes.loaders.mitsuba.metals import IOR, METALS
from lambent.scenes.loaders.mitsuba.principled import principled, principled_thin
from lambent.scenes.loaders.mitsuba.textures import colour, number, opacity, raw_picture
from lambent.scenes.loaders.mitsuba.values import Plugin
from lambent.scenes.loaders.surface import (
    BLACK,
    ROUGHNESS_MIN,
    Distribution,
    Gloss,
    Surface,
    blended,
    coated,
    seen_through,
)
from lambent.scenes.loaders.varying import Varying, absolute, combined, constant, scaled

GREY = 0.5
GLOSSES_MAX = 16
OREN_NAYAR_MEAN = 0.21396  # mean over both hemispheres of max(0, cos phi) sin alpha tan beta
WHITE = np.ones(3)
# What tests/scenes/test_scene_mitsuba_bsdfs.py measured: the largest error of the albedo, and the L1 of f cos as a
# share of it, both seen from 0 to 75 degrees.
PLASTIC = "albedo within .03 of Mitsuba's (at 75 degrees .05), 4 to 13 % of its light elsewhere"
PRINCIPLED = (
    "albedo within .02 of Mitsuba's (at 75 degrees .05), 1 to 9 % of its light elsewhere; no sheen, no flatness"
)
MEASURED = {
    "plastic": "albedo within .01 of Mitsuba's",
    "roughplastic": PLASTIC,
    "pplastic": PLASTIC,
    "roughconductor": "albedo within .07 of Mitsuba's (at 75 degrees .1), 1 to 25 % of its light elsewhere",
    "thindielectric": "passes light within .04 of Mitsuba's, reflects .11 too little at 75 degrees",
    "roughdielectric": "spreads light as a solid's face does head-on, a third less at 40 degrees",
    "principled": PRINCIPLED,
    "principledthin": PRINCIPLED,
    "phong": "light within 2 % head-on; at 60 degrees 34 % elsewhere, as half vectors make highlights longer",
    "ward": "light within 3 %",
}  # fmt: skip
NOTHING = ("null",)  # surfaces that are not there


def surface_of(plugin: Plugin) -> Surface:
    """The surface a BSDF describes; one of an unknown kind is grey, or what is nested in it."""
    known = plugin.reading.surfaces
    key = id(plugin.element)
    if key not in known:
        surface = KINDS.get(plugin.type, _unknown)(plugin)
        if len(surface.glosses) > GLOSSES_MAX:
            raise plugin.element.error("too many lobes", got=len(surface.glosses), expected=f"at most {GLOSSES_MAX}")
        plugin.say_unread()
        if plugin.type in MEASURED:
            plugin.reading.say(f"{plugin.type}: {MEASURED[plugin.type]}")
        known[key] = surface
    return known[key]


def _unknown(plugin: Plugin) -> Surface:
    inner = plugin.objects("bsdf")
    if plugin.type == "measured":
        plugin.say("measured files in it are not read, it is grey: fit it and assign the fit")
    else:
        plugin.say(f"unknown, {'what is nested in it stands' if inner else 'it is grey'}")
    return surface_of(inner[0]) if inner else grey()


def grey() -> Surface:
    return Surface(kd=constant(np.full(3, GREY)))


def is_nothing(plugin: Plugin) -> bool:
    """Whether a surface of this BSDF is not there at all."""
    return plugin.type in NOTHING


def _diffuse(plugin: Plugin) -> Surface:
    name = (
        "reflectance" if plugin.has("reflectance") or not plugin.has("diffuse_reflectance") else "diffuse_reflectance"
    )
    return Surface(kd=colour(plugin, name, GREY))


def _rough_diffuse(plugin: Plugin) -> Surface:
    """Lambertian with the mean albedo of Oren and Nayar's (1994, eq. 30, without interreflections)."""
    variance = max(plugin.number("alpha", 0.2), 0.0) ** 2 / 2  # of the facets' angles
    if variance > 0:
        plugin.say("is Lambertian here, of the mean albedo of Oren and Nayar's roughness")
    plugin.ignore("use_fast_approx")
    share = 1 - 0.5 * variance / (variance + 0.33) + 0.45 * variance / (variance + 0.09) * OREN_NAYAR_MEAN
    return Surface(kd=scaled(_diffuse(plugin).kd, share))


def _diffuse_transmitter(plugin: Plugin) -> Surface:
    return Surface(kt_d=colour(plugin, "transmittance", GREY))


def _plastic(plugin: Plugin, rough: bool = True) -> Surface:
    eta = _eta(plugin, "polypropylene")
    distribution, m, aspect = _facets(plugin, rough)
    slope = float(np.clip(m.mean[0], 1e-3, 1)) if rough else 0.0
    inside = mean_reflectance(1 / eta, slope, distribution)
    through = mean_transmittance(eta, slope, distribution) / eta**2
    through *= float(transmittance(np.ones(1), eta, slope, distribution)[0])
    nonlinear = plugin.flag("nonlinear", False)

    def below(rho: Floats) -> Floats:
        rho = np.clip(rho, 0, 1)
        albedo: Floats = through * rho / (1 - (rho if nonlinear else 1.0) * inside)
        return albedo

    kd = combined(below, colour(plugin, "diffuse_reflectance", GREY), said=[])
    r0, rise = nearest_fresnel(fresnel(COS, eta))
    k = scaled(colour(plugin, "specular_reflectance", 1.0), rise)
    return Surface(kd=kd, coupled=True, glosses=(Gloss(m, k, np.full(3, r0), aspect, distribution=distribution),))


def _smooth_plastic(plugin: Plugin) -> Surface:
    return _plastic(plugin, rough=False)


def _conductor(plugin: Plugin, rough: bool = False) -> Surface:
    distribution, m, aspect = _facets(plugin, rough)
    r0, rise = _metal(plugin)
    k = scaled(colour(plugin, "specular_reflectance", 1.0), rise)
    return Surface(glosses=(Gloss(m, k, r0, aspect, distribution=distribution),))


def _rough_conductor(plugin: Plugin) -> Surface:
    return _conductor(plugin, rough=True)


def _dielectric(plugin: Plugin, rough: bool = False) -> Surface:
    eta = _eta(plugin, "bk7")
    if rough:
        plugin.say("is a thin sheet here: light is spread, not bent")
    else:
        plugin.say("is a thin sheet here: light is not bent")
    return _sheet(plugin, fresnel(COS, eta), (eta - 1) / 2, rough)


def _rough_dielectric(plugin: Plugin) -> Surface:
    return _dielectric(plugin, rough=True)


def _thin_dielectric(plugin: Plugin) -> Surface:
    once = fresnel(COS, _eta(plugin, "bk7"))
    return _sheet(plugin, 2 * once / (1 + once), 1.0, rough=False)  # light that goes to and fro inside counts


def _sheet(plugin: Plugin, reflected: Floats, bend: float, rough: bool) -> Surface:
    """A sheet of a reflectance (at `COS`); what passes is spread by `bend` times the facets' slopes."""
    distribution, m, aspect = _facets(plugin, rough)
    r0, rise = nearest_fresnel(reflected)
    drawn = rise * (r0 + (1 - r0) * (1 - COS) ** 5)
    share, falloff = nearest_passage(1 - np.maximum(reflected, drawn))  # both together never return more than arrives
    k = scaled(colour(plugin, "specular_reflectance", 1.0), rise)
    back = Gloss(m, k, np.full(3, r0), aspect, distribution=distribution)
    k = scaled(colour(plugin, "specular_transmittance", 1.0), share)
    spread = scaled(m, bend) if rough else m
    through = replace(back, m=spread, k=k, r0=BLACK, side="transmission", falloff=falloff)
    return Surface(glosses=(back, through))


def _phong(plugin: Plugin) -> Surface:
    """(n + 2)/(2 pi) cos^n about the mirror direction: as wide as Beckmann's of m^2 = 1/(2n), and as high."""
    exponent = number(plugin, "exponent", 30.0)
    m = combined(lambda n: np.sqrt(0.5 / np.maximum(n, 0.5)), exponent, said=[])
    kd, ks = colour(plugin, "diffuse_reflectance", GREY), colour(plugin, "specular_reflectance", 0.2)
    return Surface(kd=kd, glosses=(Gloss(m, ks, WHITE, distribution="beckmann", masked=False, falloff=1.0),))


def _ward(plugin: Plugin) -> Surface:
    """Ward's own form darkens as the cosine at grazing incidence, Duer's and the balanced one do not."""
    variant = plugin.text("variant", "balanced").lower()
    kd, ks = colour(plugin, "diffuse_reflectance", GREY), colour(plugin, "specular_reflectance", 0.2)
    _, m, aspect = _roughness(plugin)
    falloff = 1.0 if variant == "ward" else 0.0
    gloss = Gloss(m, ks, WHITE, aspect, distribution="beckmann", masked=False, falloff=falloff)
    return Surface(kd=kd, glosses=(gloss,))


def _nested(plugin: Plugin) -> Surface:
    inner = plugin.objects("bsdf")
    if len(inner) > 1:
        plugin.say("only the first of its sides is read")
    if not inner:
        plugin.say("holds no BSDF, it is grey")
        return grey()
    return surface_of(inner[0])


def _coating(plugin: Plugin) -> Surface:
    """A clear coat; what it absorbs is not read."""
    below = _nested(plugin)
    eta = _eta(plugin, "bk7")
    r0, rise = nearest_fresnel(fresnel(COS, eta))
    rough = plugin.type == "roughcoating"
    distribution, m, aspect = _facets(plugin, rough)
    k = scaled(colour(plugin, "specular_reflectance", 1.0), rise)
    return coated(below, Gloss(m, k, np.full(3, r0), aspect, distribution=distribution))


def _mask(plugin: Plugin) -> Surface:
    surface = _nested(plugin)
    held = opacity(plugin, "opacity")
    if held.is_picture:
        return replace(surface, opacity=absolute(held))
    share = float(np.clip(held.mean[0], 0, 1))
    if share < 1:
        plugin.say("what shines through it loses .13 of itself at 75 degrees")
    return surface if share == 1 else seen_through(surface, np.full(3, share))


def _normal_map(plugin: Plugin) -> Surface:
    surface = _nested(plugin)
    texture = plugin.texture("normalmap") or next(iter(plugin.objects("texture")), None)
    read = raw_picture(texture) if texture is not None else None
    if read is None:
        plugin.say("its normal map cannot be read")
        return surface
    normals = Varying(read.values * 2 - 1, read.uv_transform)
    # Mitsuba's v points down the picture; normal maps are drawn for a v that points up, in both.
    return replace(surface, normal=absolute(normals))


def _bump_map(plugin: Plugin) -> Surface:
    plugin.say("its bump map is not read")
    plugin.ignore("scale", "")
    plugin.objects("texture")
    return _nested(plugin)


def _blend(plugin: Plugin) -> Surface:
    inner = plugin.objects("bsdf")
    if len(inner) < 2:
        plugin.say("holds fewer than two BSDFs")
        return _nested(plugin)
    weight = number(plugin, "weight", 0.5)
    if weight.is_picture:
        plugin.say("its weight is averaged over its picture")
    share = float(np.clip(weight.mean[0], 0, 1))
    said: list[str] = []
    surface = blended([(surface_of(inner[0]), 1 - share), (surface_of(inner[1]), share)], said)
    for text in dict.fromkeys(said):
        plugin.say(text)
    return surface


def _mixture(plugin: Plugin) -> Surface:
    inner = plugin.objects("bsdf")
    weights = [float(w) for w in plugin.text("weights").replace(",", " ").split() if _is_share(w)]
    if not inner or len(weights) != len(inner):
        raise plugin.element.error("weights do not fit its BSDFs", got=len(weights), expected=len(inner))
    said: list[str] = []
    surface = blended([(surface_of(p), w) for p, w in zip(inner, weights, strict=True)], said)
    for text in dict.fromkeys(said):
        plugin.say(text)
    return surface


def _is_share(word: str) -> bool:
    try:
        return 0 <= float(word) <= 1
    except ValueError:
        return False


def _nothing(plugin: Plugin) -> Surface:
    return seen_through(Surface(), BLACK)


KINDS: dict[str, Callable[[Plugin], Surface]] = {
    "diffuse": _diffuse, "roughdiffuse": _rough_diffuse, "difftrans": _diffuse_transmitter,
    "plastic": _smooth_plastic, "roughplastic": _plastic, "pplastic": _plastic, "conductor": _conductor,
    "roughconductor": _rough_conductor, "dielectric": _dielectric, "thindielectric": _thin_dielectric,
    "roughdielectric": _rough_dielectric, "phong": _phong, "ward": _ward, "principled": principled,
    "principledthin": principled_thin, "twosided": _nested, "coating": _coating, "roughcoating": _coating,
    "mask": _mask, "normalmap": _normal_map, "bumpmap": _bump_map, "blendbsdf": _blend, "mixturebsdf": _mixture,
    "null": _nothing,
}  # fmt: skip


def _smooth(plugin: Plugin) -> Varying:
    plugin.reading.say(f"mirrors and clear glass have the roughness {ROUGHNESS_MIN}, the smallest there is")
    return constant(ROUGHNESS_MIN)


def _facets(plugin: Plugin, rough: bool) -> tuple[Distribution, Varying, float]:
    return _roughness(plugin) if rough else ("ggx", _smooth(plugin), 1.0)


def _roughness(plugin: Plugin) -> tuple[Distribution, Varying, float]:
    """Distribution, roughness along t, and roughness across by that along."""
    distribution = plugin.text("distribution", "beckmann").lower()
    if distribution not in ("beckmann", "ggx", "phong", "as"):
        plugin.say(f"unknown distribution {distribution}: beckmann")
    if distribution in ("phong", "as"):
        plugin.say(f"distribution {distribution} is Beckmann's here, of the same slopes")
    m = number(plugin, "alpha_u" if plugin.has("alpha_u") else "alpha", 0.1)
    aspect = 1.0
    if plugin.has("alpha_v"):
        across = number(plugin, "alpha_v", 0.1)
        aspect = float(across.mean[0] / max(m.mean[0], 1e-6))
    return ("ggx" if distribution == "ggx" else "beckmann"), m, aspect


def _eta(plugin: Plugin, inside: str) -> float:
    """Relative index of refraction; of one below 1, its inverse: sheets have no inside."""
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
        fits = [nearest_fresnel(fresnel(COS, complex(n, -x))) for n, x in zip(eta, k, strict=True)]
        r0, rise = np.array(fits).T
        return r0, rise
    name = plugin.text("material", "Cu")
    if name.lower() == "none":
        return WHITE, WHITE
    known = {**METALS, **{f"{n}_palik": metal for n, metal in METALS.items()}}
    if name not in known:
        plugin.say(f"unknown metal {name}, it is aluminium{_guess(name)}")
        name = "Al"
    straight, grazing = (np.array(v) for v in known[name])
    return straight / grazing, grazing


def _guess(name: str) -> str:
    hint = did_you_mean(name, METALS)
    return f" ({hint})" if hint else ""
