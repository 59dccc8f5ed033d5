"""Mitsuba's BSDFs as surfaces of lobes. Ours are thin and two-sided: what that loses is said.

A dielectric coat over a diffuse base (`plastic`, `roughplastic`) becomes a lobe and a coupled diffuse term with the
albedo that Mitsuba's has at normal incidence: T(1) T rho / (eta^2 (1 - rho' R)), T(1) and T what the coat lets through
from above and of diffuse light, R what it reflects of diffuse light inside, rho' = rho where `nonlinear`, else 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lambent.core.errors import did_you_mean
from lambent.core.frames import Floats
from lambent.scenes.loaders.metallic import metallic_roughness
from lambent.scenes.loaders.mitsuba.interfaces import mean_reflectance, reflectance
from lambent.scenes.loaders.mitsuba.metals import IOR, R0
from lambent.scenes.loaders.mitsuba.textures import colour, number, opacity, raw_picture
from lambent.scenes.loaders.mitsuba.values import Plugin
from lambent.scenes.loaders.surface import BLACK, ROUGHNESS_MIN, Gloss, Surface, blended, seen_through
from lambent.scenes.loaders.varying import Varying, absolute, combined, constant

GREY = 0.5
GLOSSES_MAX = 16
WHITE = np.ones(3)
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
        known[key] = surface
    return known[key]


def _unknown(plugin: Plugin) -> Surface:
    inner = plugin.objects("bsdf")
    if plugin.type == "measured":
        plugin.say("measured files in it are not read, it is grey: fit it and assign the fit")
    else:
        plugin.say(f"unknown, {'what is nested in it stands' if inner else 'it is grey'}")
    return surface_of(inner[0]) if inner else grey()


def normal_reflectance(eta: float) -> float:
    """Reflectance of a dielectric at normal incidence."""
    return ((eta - 1) / (eta + 1)) ** 2


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
    if plugin.number("alpha", 0.2) > 0:
        plugin.say("is Lambertian here, without Oren and Nayar's roughness")
    plugin.ignore("use_fast_approx")
    return _diffuse(plugin)


def _diffuse_transmitter(plugin: Plugin) -> Surface:
    return Surface(kt_d=colour(plugin, "transmittance", GREY))


def _plastic(plugin: Plugin, rough: bool = True) -> Surface:
    eta = _eta(plugin, "polypropylene")
    distribution, m, aspect = _roughness(plugin) if rough else ("ggx", _smooth(plugin), 1.0)
    slope = float(np.clip(m.mean[0], 1e-3, 1)) if rough else 0.0
    inside = mean_reflectance(1 / eta, slope, distribution)
    through = (1 - mean_reflectance(eta, slope, distribution)) / eta**2
    through *= 1 - float(reflectance(np.ones(1), eta, slope, distribution)[0])
    nonlinear = plugin.flag("nonlinear", False)

    def below(rho: Floats) -> Floats:
        rho = np.clip(rho, 0, 1)
        albedo: Floats = through * rho / (1 - (rho if nonlinear else 1.0) * inside)
        return albedo

    kd = combined(below, colour(plugin, "diffuse_reflectance", GREY), said=[])
    r0 = np.full(3, normal_reflectance(eta))
    gloss = Gloss(m, colour(plugin, "specular_reflectance", 1.0), r0, aspect, distribution=distribution)
    return Surface(kd=kd, coupled=True, glosses=(gloss,))


def _smooth_plastic(plugin: Plugin) -> Surface:
    return _plastic(plugin, rough=False)


def _conductor(plugin: Plugin, rough: bool = False) -> Surface:
    distribution, m, aspect = _roughness(plugin) if rough else ("ggx", _smooth(plugin), 1.0)
    k = colour(plugin, "specular_reflectance", 1.0)
    return Surface(glosses=(Gloss(m, k, _metal(plugin), aspect, distribution=distribution),))


def _rough_conductor(plugin: Plugin) -> Surface:
    return _conductor(plugin, rough=True)


def _dielectric(plugin: Plugin, rough: bool = False) -> Surface:
    plugin.say("is a thin sheet here: light is not bent")
    return _sheet(plugin, normal_reflectance(_eta(plugin, "bk7")), rough)


def _rough_dielectric(plugin: Plugin) -> Surface:
    return _dielectric(plugin, rough=True)


def _thin_dielectric(plugin: Plugin) -> Surface:
    r0 = normal_reflectance(_eta(plugin, "bk7"))
    return _sheet(plugin, 2 * r0 / (1 + r0), rough=False)  # light that goes to and fro inside counts


def _sheet(plugin: Plugin, r0: float, rough: bool) -> Surface:
    distribution, m, aspect = _roughness(plugin) if rough else ("ggx", _smooth(plugin), 1.0)
    back = Gloss(m, colour(plugin, "specular_reflectance", 1.0), np.full(3, r0), aspect, distribution=distribution)
    through = replace(back, k=colour(plugin, "specular_transmittance", 1.0), side="transmission")
    return Surface(glosses=(back, through))


def _phong(plugin: Plugin) -> Surface:
    exponent = number(plugin, "exponent", 30.0)
    m = combined(lambda n: np.sqrt(2 / (np.maximum(n, 0) + 2)), exponent, said=[])
    kd, ks = colour(plugin, "diffuse_reflectance", GREY), colour(plugin, "specular_reflectance", 0.2)
    return Surface(kd=kd, glosses=(Gloss(m, ks, WHITE, distribution="beckmann"),))


def _ward(plugin: Plugin) -> Surface:
    plugin.ignore("variant")
    kd, ks = colour(plugin, "diffuse_reflectance", GREY), colour(plugin, "specular_reflectance", 0.2)
    _, m, aspect = _roughness(plugin)
    return Surface(kd=kd, glosses=(Gloss(m, ks, WHITE, aspect, distribution="beckmann"),))


def _principled(plugin: Plugin, thin: bool = False) -> Surface:
    said: list[str] = []
    base = colour(plugin, "base_color", GREY)
    metallic = number(plugin, "metallic", 0.0)
    roughness = number(plugin, "roughness", 0.5)
    anisotropic = min(max(float(number(plugin, "anisotropic", 0.0).mean[0]), 0.0), 1.0)
    aspect = math.sqrt(1 - 0.9 * anisotropic)
    m = combined(lambda r: np.clip(r, 0, 1) ** 2 / aspect, roughness, said=said)
    eta = plugin.number("eta", 0.0)
    specular = plugin.number("specular", 0.5)
    r0 = normal_reflectance(eta) if eta > 0 else 0.08 * min(max(specular, 0.0), 1.0)
    through = min(max(float(number(plugin, "spec_trans", 0.0).mean[0]), 0.0), 1.0)
    surface = metallic_roughness(base, metallic, m, np.full(3, r0), said, aspect=aspect**2, through=through)
    if through and not thin:
        plugin.say("is a thin sheet here: light is not bent")
    if thin:
        passed = min(max(float(number(plugin, "diff_trans", 0.0).mean[0]), 0.0), 2.0) / 2
        kd, kt_d = (Varying(surface.kd.values * share, surface.kd.uv_transform) for share in (1 - passed, passed))
        surface = replace(surface, kd=kd, kt_d=kt_d)
    coat = plugin.number("clearcoat", 0.0)
    if coat > 0:
        gloss = min(max(plugin.number("clearcoat_gloss", 0.0), 0.0), 1.0)
        lobe = Gloss(constant(0.1 + (0.001 - 0.1) * gloss), constant(np.full(3, 0.25 * coat)), np.full(3, 0.04))
        surface = replace(surface, glosses=(*surface.glosses, lobe))
    for text in dict.fromkeys(said):
        plugin.say(text)
    return surface


def _principled_thin(plugin: Plugin) -> Surface:
    return _principled(plugin, thin=True)


def _nested(plugin: Plugin) -> Surface:
    inner = plugin.objects("bsdf")
    if len(inner) > 1:
        plugin.say("only the first of its sides is read")
    if not inner:
        plugin.say("holds no BSDF, it is grey")
        return grey()
    return surface_of(inner[0])


def _coating(plugin: Plugin) -> Surface:
    """A clear coat: what is below loses what the coat reflects, once on the way in and once on the way out."""
    below = _nested(plugin)
    r0 = normal_reflectance(_eta(plugin, "bk7"))
    rough = plugin.type == "roughcoating"
    distribution, m, aspect = _roughness(plugin) if rough else ("ggx", _smooth(plugin), 1.0)
    under = blended([(below, (1 - r0) ** 2)], [])
    k = colour(plugin, "specular_reflectance", 1.0)
    gloss = Gloss(m, k, np.full(3, r0), aspect, distribution=distribution)
    return replace(under, coupled=True, glosses=(*under.glosses, gloss))


def _mask(plugin: Plugin) -> Surface:
    surface = _nested(plugin)
    held = opacity(plugin, "opacity")
    if held.is_picture:
        return replace(surface, opacity=absolute(held))
    share = float(np.clip(held.mean[0], 0, 1))
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
    "plastic": _smooth_plastic, "roughplastic": _plastic, "conductor": _conductor,
    "roughconductor": _rough_conductor, "dielectric": _dielectric, "thindielectric": _thin_dielectric,
    "roughdielectric": _rough_dielectric, "phong": _phong, "ward": _ward, "principled": _principled,
    "principledthin": _principled_thin, "twosided": _nested, "coating": _coating, "roughcoating": _coating,
    "mask": _mask, "normalmap": _normal_map, "bumpmap": _bump_map, "blendbsdf": _blend, "mixturebsdf": _mixture,
    "null": _nothing,
}  # fmt: skip


def _smooth(plugin: Plugin) -> Varying:
    plugin.reading.say(f"mirrors and clear glass have the roughness {ROUGHNESS_MIN}, the smallest there is")
    return constant(ROUGHNESS_MIN)


def _roughness(plugin: Plugin) -> tuple[str, Varying, float]:  # type: ignore[no-untyped-def]
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


def _metal(plugin: Plugin) -> Floats:
    """Reflectance (3,) at normal incidence of a conductor."""
    outside = plugin.transform_element("ext_eta")
    around = 1.0
    if outside is not None:
        around = _index(plugin, "ext_eta", "air") if outside.tag in ("string", "float") else 1.0
        plugin.ignore("ext_eta")
    if plugin.has("eta", "k"):
        plugin.ignore("material")
        eta, k = colour(plugin, "eta", 0.0).mean / around, colour(plugin, "k", 1.0).mean / around
        r0: Floats = ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)
        return r0
    name = plugin.text("material", "Cu")
    if name.lower() == "none":
        return WHITE
    known = {**R0, **{f"{n}_palik": r for n, r in R0.items()}}
    if name not in known:
        plugin.say(f"unknown metal {name}, it is aluminium{_guess(name)}")
        name = "Al"
    return np.array(known[name])


def _guess(name: str) -> str:
    hint = did_you_mean(name, R0)
    return f" ({hint})" if hint else ""
