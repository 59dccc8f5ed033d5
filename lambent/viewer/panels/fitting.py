"""Fit from here: what is asked of it, how far it is, what it warns of."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.editor.editor import DISTRIBUTIONS, LOBES, METHODS
from lambent.viewer.panels.widgets import choice, explain
from lambent.viewer.state import ViewerState

TITLE = "Fit"


def draw(state: ViewerState) -> None:
    editor = state.editor
    if editor is None:
        return
    options = editor.options
    options.lobes = choice("lobes", options.lobes, LOBES)
    explain("per side; auto adds lobes as long as they take off a share of the error")
    options.distribution = choice("distribution", options.distribution, DISTRIBUTIONS)
    explain("distribution of the microfacets; best tries both")
    options.method = choice("method", options.method, METHODS)
    explain("gradient: least squares from several starts; grid: the hierarchical search of the thesis")
    _restricted(state)
    if editor.fitting is None:
        imgui.begin_disabled(editor.measurement is None)
        if imgui.button("fit from here", (-1, 0)):
            editor.start_fit()
        imgui.end_disabled()
        explain("under the metric above, with what is fixed and narrowed; the result is one step of undo")
    else:
        work = editor.fitting
        imgui.progress_bar(work.share, (-1, 0), f"{100 * work.share:.0f} %")
        imgui.text_disabled("stopping" if work.cancelling else work.what)
        imgui.begin_disabled(work.cancelling)
        width = (imgui.get_content_region_avail().x - imgui.get_style().item_spacing.x) / 2
        if imgui.button("cancel##fit", (width, 0)):
            editor.stop_fit(keep=False)
        imgui.same_line()
        if imgui.button("stop, keep the best", (width, 0)):
            editor.stop_fit(keep=True)
        imgui.end_disabled()
    imgui.push_text_wrap_pos()
    for line in editor.warnings:
        imgui.push_style_color(imgui.Col_.text, (1.0, 0.75, 0.35, 1.0))
        imgui.text_unformatted(line)
        imgui.pop_style_color()
    imgui.pop_text_wrap_pos()


def _restricted(state: ViewerState) -> None:
    editor = state.editor
    assert editor is not None
    restrictions = editor.restrictions
    words = [*sorted(restrictions.fixed)] + [
        f"{n} {a:.3g}..{b:.3g}" for n, (a, b) in sorted(restrictions.ranges.items())
    ]
    if words:
        imgui.push_text_wrap_pos()
        imgui.text_disabled("fixed or narrowed: " + ", ".join(words))
        imgui.pop_text_wrap_pos()
