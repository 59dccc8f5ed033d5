"""The material being edited: how far it is from its measurement, its history, its files, and every number of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Literal, get_args

from imgui_bundle import imgui

from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.metrics import METRICS
from lambent.viewer.editor.editor import REFERENCES, Editor
from lambent.viewer.editor.restrictions import DIFFUSE, lobe_names
from lambent.viewer.panels import parameters
from lambent.viewer.panels.widgets import choice, explain, path_field
from lambent.viewer.state import ViewerState

TITLE = "Material"
SIDES: tuple[Literal["reflection", "transmission"], ...] = ("reflection", "transmission")
DISTRIBUTIONS: tuple[str, ...] = get_args(Lobe.model_fields["distribution"].annotation)
LABEL_PX = 52
RANGE_PX = 26
AMBER, DIM = (1.0, 0.75, 0.35, 1.0), (0.62, 0.65, 0.70, 1.0)


def draw_head(state: ViewerState) -> None:
    """Error, history and files: what stays in sight above the sections."""
    editor = state.editor
    assert editor is not None
    _names(editor)
    _error(editor)
    _history(editor)
    _files(editor)
    imgui.separator()


def draw(state: ViewerState) -> None:
    """Every number of the material, what to do with its lobes, and what to compare it with."""
    editor = state.editor
    assert editor is not None
    material = editor.material
    edited, editor.linked_roughness = _numbers(editor, material)
    if edited != material:
        editor.change(edited)
    elif not imgui.is_any_item_active():
        editor.edits.end_stroke()
    _new_lobes(editor)
    _compare(editor)


def _names(editor: Editor) -> None:
    measurement = editor.measurement
    info = measurement.samples.info if measurement else None
    imgui.align_text_to_frame_padding()
    imgui.text_unformatted(f"{editor.material.name}{' *' if editor.unsaved else ''}")
    explain("the material; * there is something to save")
    if editor.leave is not None:
        imgui.same_line(imgui.get_content_region_avail().x - 46)
        if imgui.button("close##editor", (-1, 0)):
            editor.queue(editor.leave)
    text = "no measurement" if info is None else f"{len(measurement.samples)} tuples of {info.file}"  # type: ignore[union-attr]
    imgui.push_style_color(imgui.Col_.text, DIM)
    imgui.text_unformatted(text if editor.loading is None else f"reading: {editor.loading.what}")
    imgui.pop_style_color()
    if info is not None:
        explain("\n".join((info.file, info.format, *info.notes)))


def _error(editor: Editor) -> None:
    shown, measurement = editor.shown, editor.measurement
    imgui.set_next_item_width(104)
    names = list(METRICS)
    _, index = imgui.combo("##metric", names.index(editor.metric), names)
    editor.metric = names[index]
    explain(f"what an error is, here and in a fit: {METRICS[editor.metric].source}, in {METRICS[editor.metric].unit}")
    imgui.same_line()
    if measurement is None or shown.error is None:
        imgui.text_disabled("load a measurement to see the error")
        return
    flat = max(measurement.lambertian[editor.metric], 1e-300)
    mark = "" if shown.exact else "~ "
    imgui.text_unformatted(f"{mark}{shown.error:.4g}   {100 * shown.error / flat:.1f} % of Lambertian")
    explain(
        "error of the material; its share of the error of the best Lambertian surface; ~: of a choice of the tuples"
    )
    if shown.compared_error is None:
        imgui.text_disabled("B: nothing to compare with" if editor.compared is None else "B")
    else:
        share = 100 * shown.compared_error / flat
        imgui.text_disabled(f"B ({editor.reference}): {shown.compared_error:.4g}   {share:.1f} % of Lambertian")


def _history(editor: Editor) -> None:
    edits = editor.edits
    actions: tuple[tuple[str, bool, Callable[[], None], str], ...] = (
        ("undo", edits.can_undo, edits.undo, "Ctrl+Z"),
        ("redo", edits.can_redo, edits.redo, "Ctrl+Shift+Z or Ctrl+Y"),
        ("revert", editor.material != editor.loaded, editor.revert, "the material as it was loaded; can be undone"),
    )
    width = (imgui.get_content_region_avail().x - 2 * imgui.get_style().item_spacing.x) / 3
    for index, (label, possible, act, meaning) in enumerate(actions):
        if index:
            imgui.same_line()
        imgui.begin_disabled(not possible)
        if imgui.button(label, (width, 0)):
            act()
        imgui.end_disabled()
        explain(meaning)


def _files(editor: Editor) -> None:
    editor.file_name, wanted = path_field("file", editor.file_name, "save", hint="name.json")
    if wanted:
        editor.save()
    typed, wanted = path_field("open", editor.typed.get("open", ""), "load", hint="another measurement or material...")
    editor.typed["open"] = typed
    if wanted:
        editor.open(typed)


def _numbers(editor: Editor, material: Material) -> tuple[Material, bool]:
    names = lobe_names(material)
    imgui.set_next_item_width(-LABEL_PX - RANGE_PX)
    changed, name = imgui.input_text("name", material.name)
    renamed = material.model_copy(update={"name": name}) if changed and name.strip() else material
    changed, coupled = imgui.checkbox("kd falls off as Fresnel rises", material.kd_coupled)
    explain("couples the diffuse reflection to the lobes: kd is then the albedo from straight above; a fit keeps this")
    if changed:
        renamed = renamed.model_copy(update={"kd_coupled": coupled})
    imgui.text_disabled("fix")
    explain("a fixed number stays as it is in a fit; <> narrows the interval where a fit may seek it")

    @contextmanager
    def line(lobe: int | None, attribute: str) -> Iterator[None]:
        parameter = attribute if lobe is None else names[lobe][attribute]
        restrictions = editor.restrictions
        changed, fixed = imgui.checkbox(f"##fix {parameter}", parameter in restrictions.fixed)
        explain(f"a fit keeps {parameter} as it is")
        if changed:
            restrictions.fix(parameter, fixed)
        imgui.same_line()
        right = imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x
        imgui.push_item_width(-LABEL_PX - RANGE_PX)
        yield
        imgui.pop_item_width()
        if parameter not in DIFFUSE:
            imgui.same_line(right - RANGE_PX)
            _interval(editor, parameter, attribute)

    return parameters.edited(
        renamed, editor.linked_roughness, line=line, all_terms=True, heading=lambda i, lobe: _heading(editor, i, lobe)
    )


def _interval(editor: Editor, parameter: str, attribute: str) -> None:
    """The button that narrows a parameter's interval, and the interval where there is one."""
    restrictions = editor.restrictions
    model = parameters.LOBE[attribute]
    interval = restrictions.ranges.get(parameter)
    if imgui.small_button(f"{'x' if interval else '<>'}##narrow {parameter}"):
        interval = None if interval else (model.low, model.high)
        restrictions.narrow(parameter, interval)
    explain("no interval" if interval else f"seek {parameter} only within an interval")
    if interval is None:
        return
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + imgui.get_frame_height() + imgui.get_style().item_spacing.x)
    imgui.set_next_item_width(-LABEL_PX - RANGE_PX)
    log = model.scale == "log"
    changed, low, high = imgui.drag_float_range2(
        f"sought##{parameter}", *interval, 0.002 * (model.high - model.low), model.low, model.high,
        "%.4f" if log else "%.3f", None, imgui.SliderFlags_.always_clamp,
    )  # fmt: skip
    if changed and low < high:
        restrictions.narrow(parameter, (max(low, model.low), min(high, model.high)))


def _heading(editor: Editor, index: int, lobe: Lobe) -> Lobe:
    imgui.separator()
    imgui.align_text_to_frame_padding()
    imgui.text_unformatted(f"lobe {index + 1}")
    imgui.same_line()
    imgui.set_next_item_width(112)
    _, at = imgui.combo("##side", SIDES.index(lobe.side), list(SIDES))
    if SIDES[at] != lobe.side:
        editor.queue(lambda: editor.turn_lobe(index, SIDES[at]))
    imgui.same_line()
    imgui.set_next_item_width(96)
    _, kind = imgui.combo("##distribution", DISTRIBUTIONS.index(lobe.distribution), list(DISTRIBUTIONS))
    explain("of the microfacets: beckmann falls off as a bell, ggx has long tails")
    imgui.same_line()
    if imgui.button("remove", (-1, 0)):
        editor.queue(lambda: editor.remove_lobe(index))
    return (
        lobe
        if DISTRIBUTIONS[kind] == lobe.distribution
        else lobe.model_copy(update={"distribution": DISTRIBUTIONS[kind]})
    )


def _new_lobes(editor: Editor) -> None:
    imgui.separator()
    width = (imgui.get_content_region_avail().x - imgui.get_style().item_spacing.x) / 2
    for side in SIDES:
        if imgui.button(f"add {side} lobe", (width, 0)):
            editor.queue(partial(editor.add_lobe, side))
        if side == SIDES[0]:
            imgui.same_line()


def _compare(editor: Editor) -> None:
    imgui.separator_text("compare with B")
    editor.reference = choice("B", editor.reference, REFERENCES)
    if editor.reference == "a document":
        typed, wanted = path_field("B", editor.typed.get("B", ""), "open", hint="material document (.json)")
        editor.typed["B"] = typed
        if wanted:
            editor.open_compared(typed)
    if editor.reference != "nothing" and editor.compared is None:
        imgui.text_disabled("there is none yet")
    if editor.compared is not None and imgui.button("take B's numbers", (-1, 0)):
        other = editor.compared
        editor.queue(lambda: editor.step(other.model_copy(update={"name": editor.material.name})))
