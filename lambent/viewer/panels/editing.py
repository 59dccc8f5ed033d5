"""The panels of the editor: error, undo and files; parameters and the comparison with B; the fit."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import get_args

from imgui_bundle import imgui

from lambent.materials.document import KINDS, Distribution, Lobe, Material
from lambent.materials.fitting.choices import DISTRIBUTION_CHOICES
from lambent.materials.lobes import with_distribution
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.models.model import Parameter
from lambent.viewer.editor.editor import LOBES, Editor
from lambent.viewer.editor.restrictions import DIFFUSE, lobe_names
from lambent.viewer.editor.subject import REFERENCES
from lambent.viewer.edits.in_words import LOBE, RETRO
from lambent.viewer.panels import parameters
from lambent.viewer.panels.widgets import (
    DIM,
    buttons,
    choice,
    coloured,
    explain,
    path_field,
    press,
    px,
    typed_field,
    wrapped,
)

OF_LOBES: tuple[Distribution, ...] = get_args(Lobe.model_fields["distribution"].annotation)
LABEL_PX = 52
RANGE_PX = 26


def draw_head(editor: Editor) -> None:
    """Draw error, undo and files, above the panels."""
    _names(editor)
    _error(editor)
    _history(editor)
    _files(editor)
    imgui.separator()


def draw(editor: Editor) -> None:
    """Draw every parameter of the material, buttons for lobes, and the choice of B."""
    subject = editor.subject
    material = subject.material
    edited, editor.linked_roughness = _numbers(editor, material)
    if edited != material:
        subject.change(edited)
    elif not imgui.is_any_item_active():
        subject.edits.end_stroke()
    _new_lobes(editor)
    _compare(editor)


def _names(editor: Editor) -> None:
    loading, measurement = editor.files.loading, editor.measurement
    imgui.align_text_to_frame_padding()
    imgui.text_unformatted(f"{editor.subject.material.name}{' *' if editor.subject.unsaved else ''}")
    explain("the material; * means unsaved changes")
    if editor.leave is not None:
        imgui.same_line(imgui.get_content_region_avail().x - px(46))
        if press("close##editor", "closes the editor; the material stays as it is", -1):
            editor.queue(editor.leave)
    text = f"{len(measurement.samples)} tuples of {measurement.samples.info.file}" if measurement else "no measurement"
    coloured(f"reading: {loading.what}" if loading else text, DIM)
    if measurement is not None:
        info = measurement.samples.info
        explain("\n".join((info.file, info.format, *info.notes)))


def _error(editor: Editor) -> None:
    shown, measurement, subject = editor.shown, editor.measurement, editor.subject
    metric = METRICS[editor.metric]
    meaning = f"error metric, here and in a fit: {metric.source}, in {metric.unit}"
    editor.metric = choice("##metric", editor.metric, tuple(METRICS), meaning, px(104))
    imgui.same_line()
    if measurement is None or shown.error is None:
        wrapped(["load a measurement to see the error"], DIM)
        return
    flat = max(measurement.lambertian[editor.metric], 1e-300)
    mark = "" if shown.exact else "~ "
    imgui.text_unformatted(f"{mark}{shown.error:.4g}   {100 * shown.error / flat:.1f} % of Lambertian")
    explain("error of the material, also relative to the best Lambertian surface; ~: from a sample of the tuples")
    if shown.compared_error is None:
        imgui.text_disabled("B: nothing to compare with" if subject.compared is None else "B")
    else:
        share = 100 * shown.compared_error / flat
        imgui.text_disabled(f"B ({subject.reference}): {shown.compared_error:.4g}   {share:.1f} % of Lambertian")


def _history(editor: Editor) -> None:
    subject, edits = editor.subject, editor.subject.edits
    changed, revert = subject.material != subject.loaded, partial(subject.step, subject.loaded)
    width = (imgui.get_content_region_avail().x - 2 * imgui.get_style().item_spacing.x) / 3
    undo = ("undo", edits.can_undo, edits.undo, "undoes the last step (Ctrl+Z)")
    redo = ("redo", edits.can_redo, edits.redo, "redoes the step (Ctrl+Shift+Z)")
    buttons([undo, redo, ("revert", changed, revert, "restores the material as loaded; can be undone")], width)


def _files(editor: Editor) -> None:
    files = editor.files
    meaning = "saves the material as a document (Ctrl+S)"
    files.name, wanted = path_field("file", files.name, "save", "name.json", meaning)
    if wanted:
        editor.save()
    text = typed_field(
        "open",
        files.typed,
        "load",
        "another measurement or material...",
        "opens another measured table or material document; you can also drop a file onto the window",
    )
    if text is not None:
        files.open(text)


def _numbers(editor: Editor, material: Material) -> tuple[Material, bool]:
    names = lobe_names(material)
    imgui.set_next_item_width(-px(LABEL_PX + RANGE_PX))
    changed, name = imgui.input_text("name", material.name)
    explain("name of the material in its document")
    renamed = material.model_copy(update={"name": name}) if changed and name.strip() else material
    changed, coupled = imgui.checkbox("kd falls as Fresnel rises", material.kd_coupled)
    explain("couples diffuse reflection to the lobes: kd becomes the albedo at normal incidence; a fit keeps this")
    if changed:
        renamed = renamed.model_copy(update={"kd_coupled": coupled, "kd_curve": None})
    imgui.text_disabled("fix")
    explain("a fit keeps fixed parameters; <> limits the range of a parameter in a fit")

    @contextmanager
    def line(lobe: int | None, attribute: str) -> Iterator[None]:
        parameter = attribute if lobe is None else names[lobe][attribute]
        restrictions = editor.subject.restrictions
        changed, fixed = imgui.checkbox(f"##fix {parameter}", parameter in restrictions.fixed)
        explain(f"a fit keeps {parameter} as it is")
        if changed:
            restrictions.fix(parameter, fixed)
        imgui.same_line()
        right = imgui.get_cursor_pos_x() + imgui.get_content_region_avail().x
        imgui.push_item_width(-px(LABEL_PX + RANGE_PX))
        yield
        imgui.pop_item_width()
        if parameter not in DIFFUSE:
            imgui.same_line(right - px(RANGE_PX))
            retro = lobe is not None and editor.subject.material.lobes[lobe].retro
            _interval(editor, parameter, (RETRO if retro else LOBE)[attribute])

    heading = partial(_heading, editor)
    return parameters.edited(renamed, editor.linked_roughness, line=line, all_terms=True, heading=heading)


def _interval(editor: Editor, parameter: str, model: Parameter) -> None:
    """Draw the button that limits a parameter's range, and the range if there is one."""
    restrictions = editor.subject.restrictions
    interval = restrictions.ranges.get(parameter)
    if imgui.small_button(f"{'x' if interval else '<>'}##narrow {parameter}"):
        interval = None if interval else (model.low, model.high)
        restrictions.narrow(parameter, interval)
    explain(f"lets a fit vary {parameter} freely" if interval else f"limits the range of {parameter} in a fit")
    if interval is None:
        return
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + imgui.get_frame_height() + imgui.get_style().item_spacing.x)
    imgui.set_next_item_width(-px(LABEL_PX + RANGE_PX))
    log = model.scale == "log"
    changed, low, high = imgui.drag_float_range2(
        f"sought##{parameter}", *interval, 0.002 * (model.high - model.low), model.low, model.high,
        "%.4g" if log else "%.3f", None, imgui.SliderFlags_.always_clamp,
    )  # fmt: skip
    explain(f"range of {parameter} in a fit")
    if changed and low < high:
        restrictions.narrow(parameter, (max(low, model.low), min(high, model.high)))


def _heading(editor: Editor, index: int, lobe: Lobe) -> Lobe:
    subject = editor.subject
    imgui.separator()
    imgui.align_text_to_frame_padding()
    imgui.text_unformatted(f"lobe {index + 1}")
    imgui.same_line()
    meaning = "direction of the lobe: mirror direction, through the surface, or back to the light"
    room = imgui.get_content_region_avail().x
    turned = choice("##kind", lobe.kind, KINDS, meaning, min(px(112), 0.37 * room))
    if turned != lobe.kind:
        editor.queue(lambda: subject.turn_lobe(index, turned))
    imgui.same_line()
    meaning = "microfacet distribution: beckmann is bell-shaped, ggx has long tails, a curve has any shape"
    kind = choice("##distribution", lobe.distribution, OF_LOBES, meaning, min(px(96), 0.3 * room))
    imgui.same_line()
    if press("remove", "removes the lobe; can be undone", -1):
        editor.queue(lambda: subject.remove_lobe(index))
    return lobe if kind == lobe.distribution else with_distribution(lobe, kind)


def _new_lobes(editor: Editor) -> None:
    imgui.separator()
    gaps = (len(KINDS) - 1) * imgui.get_style().item_spacing.x
    width, add = (imgui.get_content_region_avail().x - gaps) / len(KINDS), editor.subject.add_lobe
    buttons(
        [(f"add {kind}", True, partial(editor.queue, partial(add, kind)), f"adds a {kind} lobe") for kind in KINDS],
        width,
    )


def _compare(editor: Editor) -> None:
    subject, files = editor.subject, editor.files
    imgui.separator_text("compare with B")
    subject.reference = choice("B", subject.reference, REFERENCES, "the material to compare with")
    if subject.reference == "a document":
        text = typed_field("B", files.typed, "open", "material document (.json)", "reads the document to compare with")
        if text is not None:
            files.open_compared(text)
    other = subject.compared
    if subject.reference != "nothing" and other is None:
        imgui.text_disabled("no document chosen yet")
    if other is not None and press("copy B", "copies B's parameters; can be undone", -1):
        named = other.model_copy(update={"name": subject.material.name})
        editor.queue(lambda: subject.step(named))


def draw_fit(editor: Editor) -> None:
    """Draw options of a fit, its progress, and its warnings."""
    fit = editor.fit
    meaning = "lobes per side; auto adds lobes as long as they reduce the error enough"
    fit.lobes = choice("lobes", fit.lobes, LOBES, meaning)
    meaning = "microfacet distribution; best tries both"
    fit.distribution = choice("distribution", fit.distribution, DISTRIBUTION_CHOICES, meaning)
    restrictions = editor.subject.restrictions
    words = [*sorted(restrictions.fixed)]
    words += [f"{name} {low:.3g}..{high:.3g}" for name, (low, high) in sorted(restrictions.ranges.items())]
    if words:
        imgui.push_text_wrap_pos()
        imgui.text_disabled("fixed or limited: " + ", ".join(words))
        imgui.pop_text_wrap_pos()
    work = fit.work
    if work is None:
        meaning = "fits under the metric above, with the fixed and limited parameters; one undo step"
        start = partial(fit.start, editor.measurement, editor.metric)
        buttons([("fit from here", editor.measurement is not None, start, meaning)], -1)
    else:
        imgui.progress_bar(work.share, (-1, 0), f"{100 * work.share:.0f} %")
        imgui.text_disabled("stopping" if work.cancelling else work.what)
        goes_on = not work.cancelling
        width = (imgui.get_content_region_avail().x - imgui.get_style().item_spacing.x) / 2
        cancel, stop = partial(fit.stop, keep=False), partial(fit.stop, keep=True)
        keep = "stops the fit and takes its best material"
        actions = [
            ("cancel##fit", goes_on, cancel, "stops the fit; the material stays as it was"),
            ("stop, keep the best", goes_on, stop, keep),
        ]
        buttons(actions, width)
    wrapped(fit.warnings)
