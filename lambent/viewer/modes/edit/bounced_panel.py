"""The panel of interreflections: materials and costs of a bake, its progress, and the shown part."""

from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import imgui

from lambent.baking.interreflection.proposal import Proposal
from lambent.viewer.modes.edit.interreflections import SAMPLES, SERIES, SHOWN, Bounced
from lambent.viewer.panels.widgets import AMBER, DIM, buttons, check, choice, press, wrapped

SHARES, MERGE = ("in view", "passes on"), "merge"
Merge = Callable[[str, str], None]
MOST_ROWS = 8  # rows of materials before they scroll


def draw_interreflections(bounced: Bounced, merge: Merge) -> None:
    """Draw materials and costs, the bake, and the shown part; `merge` merges one material with another."""
    imgui.begin_disabled(bounced.baking is not None)
    series = SERIES if bounced.series in SERIES else (*SERIES, bounced.series)
    meaning = "bands per curve at the first surface, the second, ...; 1: a diffuse surface of the same albedo"
    bounced.change(choice("series", bounced.series, series, meaning))
    meaning = "paths per pixel when the bake is done"
    bounced.wanted = int(choice("samples", str(bounced.wanted), [str(n) for n in SAMPLES], meaning))
    if bounced.proposal is not None and bounced.fixed is not None:
        _draw_materials(bounced, bounced.proposal, bounced.fixed, merge)
    imgui.end_disabled()
    wanted = bounced.samples < bounced.wanted
    buttons([
        ("continue" if bounced.samples else "bake", not bounced.on and wanted, bounced.start,
         "bakes in the background and shows the picture after every pass, with less noise each time"),
        ("stop", bounced.on, bounced.stop, "stops the bake and keeps finished passes"),
    ])  # fmt: skip
    if bounced.baking is None:  # below the buttons, which stay where they are
        _draw_costs(bounced)
    lines = [bounced.line] if bounced.line else []
    if bounced.samples:
        noise = f", noise {bounced.noise:.1%} of the mean" if bounced.noise is not None else ""
        lines.append(f"{bounced.samples} samples a pixel{noise}")
    wrapped(lines, DIM)
    meaning = "shows light after this number of surfaces, as soon as it is baked"
    bounced.shown = choice("shown", bounced.shown, list(SHOWN), meaning)
    wrapped([bounced.trouble] if bounced.trouble else [], AMBER)


def _draw_materials(bounced: Bounced, proposal: Proposal, fixed: frozenset[str], merge: Merge) -> None:
    """Draw a check box per material, for edits of the light it passes on, and a merge button if it has a twin."""
    flags = imgui.TableFlags_.row_bg | imgui.TableFlags_.sizing_fixed_fit | imgui.TableFlags_.scroll_y
    line = imgui.get_frame_height() + 2 * imgui.get_style().cell_padding.y
    height = (min(len(proposal.rows), MOST_ROWS) + 1) * line
    titles = (*SHARES, MERGE) if proposal.alike else SHARES
    if not imgui.begin_table("materials", 1 + len(titles), flags, (0, height)):
        return
    imgui.table_setup_column("edited", imgui.TableColumnFlags_.width_stretch)
    for title in titles:
        framed = 2 * imgui.get_style().frame_padding.x if title == MERGE else 0
        imgui.table_setup_column(title, imgui.TableColumnFlags_.width_fixed, imgui.calc_text_size(title).x + framed)
    imgui.table_setup_scroll_freeze(0, 1)
    imgui.table_headers_row()
    for row in proposal.rows:
        imgui.table_next_column()
        meaning = (
            "its edits change the light on other surfaces; otherwise light on them stays that of the original material"
        )
        edited = check(f"{row.material}##edited", row.material not in fixed, meaning)
        if edited != (row.material not in fixed):
            bounced.choose(row.material, edited)
        for share in (row.in_view, row.passed_on):
            imgui.table_next_column()
            imgui.text_unformatted(f"{share:.1%}")
        if proposal.alike:
            imgui.table_next_column()
            _draw_merge(row.material, proposal.alike.get(row.material), merge)
    imgui.end_table()


def _draw_merge(material: str, twin: str | None, merge: Merge) -> None:
    meaning = f"looks like {twin}: merging both saves time and memory; undo splits them again"
    if twin is not None and press(f"{MERGE}##{material}", meaning):
        merge(material, twin)


def _draw_costs(bounced: Bounced) -> None:
    """Draw time and memory of the choice; nothing while they are measured."""
    proposal = bounced.proposal
    if bounced.is_measured and proposal is not None:
        alike = [f"{one} and {other} look the same" for one, other in proposal.alike.items()]
        wrapped([*proposal.sums(), *proposal.reasons[:3], *alike[:3]], DIM)
    elif bounced.is_measuring:
        wrapped(["measuring time and memory"], DIM)
