"""Mitsuba's `principled` and `principledthin` (Burley 2012, 2015) as lobes.

The diffuse term is uncoupled, as theirs is nearly: it loses a fifth of itself at 75 degrees where ours loses nothing.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from lambent.core.directions import Floats
from lambent.scenes.loaders.metallic import metallic_roughness
from lambent.scenes.loaders.mitsuba.interfaces import normal_reflectance
from lambent.scenes.loaders.mitsuba.textures import LUMINANCE, colour, number
from lambent.scenes.loaders.mitsuba.values import Plugin
from lambent.scenes.loaders.surface import Gloss, Surface
from lambent.scenes.loaders.varying import Varying, combined, constant, scaled

GREY = 0.5


def principled(plugin: Plugin, thin: bool = False) -> Surface:
    """The surface of `principled`, or, `thin`, of `principledthin`."""
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
    plain = np.minimum(r0 * _tint(plugin, base), 1.0)
    through = min(max(float(number(plugin, "spec_trans", 0.0).mean[0]), 0.0), 1.0)
    surface = metallic_roughness(base, metallic, m, plain, said, aspect=aspect**2, through=through)
    if through:
        index = (1 + math.sqrt(r0)) / max(1 - math.sqrt(r0), 1e-3)
        surface = _spread(surface, index, thin)
        if not thin:
            plugin.say("is a thin sheet here: light is not bent")
    most = 1 - r0 - (1 - r0) / 21  # what the lobe leaves of diffuse light: together they never return more than arrives
    kd = combined(lambda b, m: np.minimum(b, most) * (1 - m) * (1 - through), base, metallic, said=said)
    surface = replace(surface, kd=kd, coupled=False)
    if thin:
        passed = min(max(float(number(plugin, "diff_trans", 0.0).mean[0]), 0.0), 2.0) / 2
        back = replace(surface.glosses[0], k=scaled(surface.glosses[0].k, through))
        surface = replace(surface, kd=scaled(kd, 1 - passed), kt_d=scaled(kd, passed))
        surface = replace(surface, glosses=(back, *surface.glosses[1:]) if through else ())
    coat = plugin.number("clearcoat", 0.0)
    if coat > 0:
        surface = replace(surface, glosses=(*surface.glosses, _clear_coat(plugin, coat)))
    for text in dict.fromkeys(said):
        plugin.say(text)
    return surface


def _tint(plugin: Plugin, base: Varying) -> Floats:
    """Colour (3,) of a dielectric's reflection: towards that of the base."""
    share = min(max(float(number(plugin, "spec_tint", 0.0).mean[0]), 0.0), 1.0)
    mean = base.mean
    bright = float(mean @ LUMINANCE)
    return np.asarray(1 + share * (mean / bright - 1)) if bright > 0 else np.ones(3)


def _spread(surface: Surface, eta: float, thin: bool) -> Surface:
    """With transmission as wide and as coloured as Mitsuba's: of a thin sheet (Burley 2015, fig. 15), or a face."""
    *others, through = surface.glosses
    bend = (0.65 * eta - 0.35) ** 2 if thin else (eta - 1) / 2
    k = through.k if thin else combined(np.sqrt, through.k, said=[])
    return replace(surface, glosses=(*others, replace(through, m=scaled(through.m, max(bend, 0.0)), k=k)))


def _clear_coat(plugin: Plugin, coat: float) -> Gloss:
    """The lobe of GTR1's height and half width (Burley 2012): D = (a^2 - 1)/(2 pi ln a (1 + (a^2 - 1) cos^2)).

    Its long tail, most of its light, is not kept. Mitsuba's masking lets it fall off as cos_i cos_o.
    """
    gloss = min(max(plugin.number("clearcoat_gloss", 0.0), 0.0), 1.0)
    a = 0.1 + (0.001 - 0.1) * gloss
    m = a / math.sqrt((math.sqrt(2) - 1) * (1 - a * a))
    height = (1 - a * a) / (-2 * math.log(a)) * (m / a) ** 2
    k = constant(np.full(3, coat * height))
    return Gloss(constant(m), k, np.full(3, 0.04), masked=False, falloff=1.0)


def principled_thin(plugin: Plugin) -> Surface:
    return principled(plugin, thin=True)
