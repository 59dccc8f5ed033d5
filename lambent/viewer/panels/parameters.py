"""Controls for every parameter of a material, with the range, scale and unit of its model.

The material panel shows plain controls; the editor adds whether a fit keeps a parameter, and its range in a fit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

import numpy as np
from imgui_bundle import imgui

from lambent.core.plain import triple
from lambent.materials.document import Lobe, Material
from lambent.materials.models.kurt import Kurt, KurtRetro
from lambent.materials.models.model import Parameter, Value
from lambent.viewer.panels.widgets import check, rgb, slider, swatch

LOBE = {parameter.name: parameter for parameter in Kurt.parameters}
RETRO = {parameter.name: parameter for parameter in KurtRetro.parameters}
MOST_SHINE, LEAST_SHINE = 200.0, 0.1  # per cent; at 0, the colours of lobes would be lost
ROUGH = (4.0, 100.0)  # per cent
DIFFUSE = {
    "kd": "diffuse reflectance in red, green and blue",
    "kt_d": "diffuse transmittance in red, green and blue",
}
# Wraps the control of a lobe's attribute, or of a diffuse coefficient (lobe None), with the editor's additions.
Line = Callable[[int | None, str], AbstractContextManager[object]]


def in_words(material: Material, first: Material) -> Material:
    """Draw colour, and of a shiny material its brightness and roughness; return the material after this frame.

    Shine is relative to the material at `first`; roughness is the square root of the brightest lobe's slope, as in
    Burley 2012, "Physically-based shading at Disney", and scales all lobes.
    """
    changes: dict[str, object] = {"kd": swatch("colour", material.kd, "colour of the matte part")}
    if any(material.kt_d):
        changes["kt_d"] = swatch("light let through", material.kt_d, "colour of the light that shines through")
    imgui.begin_disabled(not material.lobes)  # drawn all the same, so that nothing below moves
    changes["lobes"] = _lobes_in_words(material, first)
    imgui.end_disabled()
    return material.model_copy(update=changes)


def _lobes_in_words(material: Material, first: Material) -> tuple[Lobe, ...]:
    lobes, whole = material.lobes, _shine(first) or _shine(material) or 1.0
    brightest = max(lobes, key=lambda lobe: sum(lobe.k), default=Lobe(mx=1.0, my=1.0))
    shine, rough = 100 * _shine(material) / whole, 100 * math.sqrt(math.sqrt(brightest.mx * brightest.my))
    meaning = "brightness of reflections; 100 % as opened"
    shine_now = slider("shine", shine, 0.0, MOST_SHINE, meaning, unit=" %%", digits=0)
    meaning = "width of reflections, from a mirror to matte"
    rough_now = slider("roughness", rough, *ROUGH, meaning, unit=" %%", digits=0)
    if shine_now != shine and shine > 0:
        factor = max(shine_now, LEAST_SHINE) / shine
        lobes = tuple(lobe.model_copy(update={"k": triple(factor * np.array(lobe.k))}) for lobe in lobes)
    if rough_now != rough:
        wider, low, high = (rough_now / rough) ** 2, LOBE["mx"].low, LOBE["mx"].high
        slopes = [[min(max(wider * m, low), high) for m in (lobe.mx, lobe.my)] for lobe in lobes]
        lobes = tuple(
            lobe.model_copy(update={"mx": mx, "my": my}) for lobe, (mx, my) in zip(lobes, slopes, strict=True)
        )
    return lobes


def _shine(material: Material) -> float:
    return sum(sum(lobe.k) for lobe in material.lobes)


def edited(
    material: Material,
    linked: bool,
    *,
    line: Line = lambda lobe, name: nullcontext(),
    all_terms: bool = False,
    heading: Callable[[int, Lobe], Lobe] | None = None,
) -> tuple[Material, bool]:
    """The material after this frame, and whether mx and my keep their ratio.

    `all_terms`: show the diffuse transmittance even if it is 0. `heading` draws the heading of a lobe and may change
    the lobe.
    """
    changes: dict[str, object] = {}
    for name in ("kd", "kt_d") if all_terms or any(material.kt_d) else ("kd",):
        with line(None, name):
            changes[name] = rgb(name, getattr(material, name), 1.0, DIFFUSE[name])
    if material.lobes:
        linked = check("keep the ratio of mx and my", linked, "scales both roughnesses by the same factor")
    changes["lobes"] = tuple(_lobe(index, lobe, linked, line, heading) for index, lobe in enumerate(material.lobes))
    return material.model_copy(update=changes), linked


def _lobe(index: int, lobe: Lobe, linked: bool, line: Line, heading: Callable[[int, Lobe], Lobe] | None) -> Lobe:
    imgui.push_id(index)
    if heading is None:
        imgui.separator_text(f"lobe {index + 1}: {lobe.kind}, {lobe.distribution}")
    else:
        lobe = heading(index, lobe)
    values = {}
    for name, parameter in (RETRO if lobe.retro else LOBE).items():
        imgui.begin_disabled(name == "r0" and lobe.fresnel is not None)  # of a curve, the value at normal incidence
        with line(index, name):
            values[name] = _parameter(parameter, lobe)
        imgui.end_disabled()
    after = lobe.model_copy(update=values)
    imgui.pop_id()
    return _linked(lobe, after) if linked else after


def _parameter(parameter: Parameter, lobe: Lobe) -> Value:
    value = getattr(lobe, parameter.name)
    meaning = parameter.meaning if parameter.unit == "1" else f"{parameter.meaning} ({parameter.unit})"
    if parameter.rgb:
        return rgb(parameter.name, value, max(parameter.high, *value), meaning)
    low, high = min(parameter.low, value), max(parameter.high, value)
    return slider(parameter.name, value, low, high, meaning, log=parameter.scale == "log")


def _linked(before: Lobe, after: Lobe) -> Lobe:
    """Scale the other roughness like the changed one."""
    if (before.mx, before.my) == (after.mx, after.my):
        return after
    scale = after.mx / before.mx if after.mx != before.mx else after.my / before.my
    low, high = LOBE["mx"].low, LOBE["mx"].high
    mx, my = (min(max(m * scale, low), high) for m in (before.mx, before.my))
    return after.model_copy(update={"mx": mx, "my": my})
