"""Mitsuba's `principled` and `principledthin` (Burley 2012, 2015) as lobes.

The diffuse term is uncoupled. Mitsuba's nearly is: it loses a fifth at 75 degrees.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from lambent.core.geometry.directions import Floats
from lambent.materials.fresnel import r0_of
from lambent.scenes.loaders.mitsuba.values import LUMINANCE, Plugin, colour, number
from lambent.scenes.loaders.surfaces.surface import GREY, SpecularLobe, Surface, metallic_roughness
from lambent.scenes.loaders.surfaces.textured import Textured, combined, constant, scaled


def principled(plugin: Plugin, thin: bool = False) -> Surface:
    """The surface of `principled`, or, `thin`, of `principledthin`."""
    notes: list[str] = []
    base = colour(plugin, "base_color", GREY)
    metallic = combined(lambda m: np.clip(m, 0, 1), number(plugin, "metallic", 0.0), notes=notes)
    roughness = number(plugin, "roughness", 0.5)
    anisotropic = _share(plugin, "anisotropic")
    aspect = math.sqrt(1 - 0.9 * anisotropic)
    m = combined(lambda r: np.clip(r, 0, 1) ** 2 / aspect, roughness, notes=notes)
    eta = plugin.number("eta", 0.0)
    specular = plugin.number("specular", 0.5)
    r0 = r0_of(eta) if eta > 0 else 0.08 * min(max(specular, 0.0), 1.0)
    plain = np.minimum(r0 * _tint(plugin, base), 1.0)
    through = _share(plugin, "spec_trans")
    surface = metallic_roughness(base, metallic, m, plain, notes, aspect=aspect**2, through=through)
    if through:
        index = (1 + math.sqrt(r0)) / max(1 - math.sqrt(r0), 1e-3)
        surface = _spread(surface, index, thin)
        if not thin:
            plugin.note("becomes a thin sheet: light is not refracted")
    most = 1 - r0 - (1 - r0) / 21  # diffuse light that the lobe leaves: their total albedo stays below 1
    kd = combined(lambda b, m: np.minimum(b, most) * (1 - m) * (1 - through), base, metallic, notes=notes)
    surface = replace(surface, kd=kd, coupled=False)
    if thin:
        passed = min(max(float(number(plugin, "diff_trans", 0.0).mean[0]), 0.0), 2.0) / 2
        back = replace(surface.lobes[0], k=scaled(surface.lobes[0].k, through))
        surface = replace(surface, kd=scaled(kd, 1 - passed), kt_d=scaled(kd, passed))
        surface = replace(surface, lobes=(back, *surface.lobes[1:]) if through else ())
    coat = plugin.number("clearcoat", 0.0)
    if coat > 0:
        surface = replace(surface, lobes=(*surface.lobes, _clear_coat(plugin, coat)))
    for text in notes:
        plugin.note(text)
    return surface


def _share(plugin: Plugin, name: str) -> float:
    """Mean of a parameter in [0, 1], by default 0."""
    return min(max(float(number(plugin, name, 0.0).mean[0]), 0.0), 1.0)


def _tint(plugin: Plugin, base: Textured) -> Floats:
    """Colour (3,) of a dielectric's reflection, between white and the base colour's hue."""
    share = _share(plugin, "spec_tint")
    mean = base.mean
    bright = float(mean @ LUMINANCE)
    return np.asarray(1 + share * (mean / bright - 1)) if bright > 0 else np.ones(3)


def _spread(surface: Surface, eta: float, thin: bool) -> Surface:
    """Add transmission with Mitsuba's width and colour, of a thin sheet (Burley 2015, fig. 15) or of a solid's face."""
    *others, through = surface.lobes
    bend = (0.65 * eta - 0.35) ** 2 if thin else (eta - 1) / 2
    k = through.k if thin else combined(np.sqrt, through.k, notes=[])
    return replace(surface, lobes=(*others, replace(through, m=scaled(through.m, max(bend, 0.0)), k=k)))


def _clear_coat(plugin: Plugin, coat: float) -> SpecularLobe:
    """The lobe of GTR1's height and half width (Burley 2012): D = (a^2 - 1)/(2 pi ln a (1 + (a^2 - 1) cos^2)).

    Its long tail, most of its light, is lost. Mitsuba's masking lets it fall off as cos_i cos_o.
    """
    gloss = min(max(plugin.number("clearcoat_gloss", 0.0), 0.0), 1.0)
    a = 0.1 + (0.001 - 0.1) * gloss
    m = a / math.sqrt((math.sqrt(2) - 1) * (1 - a * a))
    height = (1 - a * a) / (-2 * math.log(a)) * (m / a) ** 2
    k = constant(np.full(3, coat * height))
    return SpecularLobe(constant(m), k, np.full(3, 0.04), masked=False, falloff=1.0)
