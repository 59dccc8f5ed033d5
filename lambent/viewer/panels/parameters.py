"""Controls for every parameter of a material, with the range, scale and unit of its model.

The material panel shows plain controls; the editor adds whether a fit keeps a parameter, and its range in a fit.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

from imgui_bundle import imgui

from lambent.materials.document import Lobe, Material
from lambent.materials.models.model import Parameter, Value
from lambent.viewer.edits.in_words import (
    LOBE,
    MOST_SHINE,
    ROUGH,
    parameters_of,
    rough_percent,
    shine_percent,
    with_roughness,
    with_shine,
)
from lambent.viewer.panels.widgets import check, rgb, slider, swatch

DIFFUSE = {
    "kd": "diffuse reflectance in red, green and blue",
    "kt_d": "diffuse transmittance in red, green and blue",
}
# Wraps the control of a lobe's attribute, or of a diffuse coefficient (lobe None), with the editor's additions.
Line = Callable[[int | None, str], AbstractContextManager[object]]


def in_words(material: Material, first: Material) -> Material:
    """Draw colour, and of a shiny material its brightness and roughness; return the material after this frame."""
    changes: dict[str, object] = {"kd": swatch("colour", material.kd, "colour of the matte part")}
    if any(material.kt_d):
        changes["kt_d"] = swatch("light let through", material.kt_d, "colour of the light that shines through")
    imgui.begin_disabled(not material.lobes)  # drawn all the same, so that nothing below moves
    shine, rough = shine_percent(material, first), rough_percent(material)
    meaning = "brightness of reflections; 100 % as opened"
    shine_now = slider("shine", shine, 0.0, MOST_SHINE, meaning, unit=" %%", digits=0)
    meaning = "width of reflections, from a mirror to matte"
    rough_now = slider("roughness", rough, *ROUGH, meaning, unit=" %%", digits=0)
    imgui.end_disabled()
    if shine_now != shine:
        material = with_shine(material, first, shine_now)
    if rough_now != rough:
        material = with_roughness(material, rough_now)
    return material.model_copy(update=changes)


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
    for name, parameter in parameters_of(lobe).items():
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
