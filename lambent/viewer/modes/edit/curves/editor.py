"""The curve editor: a material's curves, one of them on a plot, its layers, colours and parameters."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.editing.curves.operators import Region
from lambent.editing.session.session import Session
from lambent.materials.factored.parametrisations import PARAMETRISATIONS
from lambent.materials.factored.terms import Editable
from lambent.viewer.modes.edit.curves import layers, plot, quantities, toolbar
from lambent.viewer.modes.edit.curves.axes import Axes
from lambent.viewer.modes.edit.curves.state import CurveState, Shown
from lambent.viewer.panels.widgets import AMBER, coloured, explain

WIDE_PX, CONTROLS_PX = 680.0, 340.0  # least width for controls beside the plot, and their width
LEAST_PX, MOST_PX = 200.0, 420.0  # range of a plot's height in a column
MOST_ROWS = 7
HINTS = {
    "translate": "Drag in the region: Shift changes values only, Ctrl angles only. Drag beside it: new region.",
    "amplify": "Drag in the region to scale it about the base. Drag beside it: new region.",
    "draw": "Draw with the left button. Esc cancels the stroke.",
}


class CurveEditor:
    """Draws the curves of one material of a session, and edits the session.

    A drag is one step of undo. Errors of an edit are shown as a line, not raised.
    """

    def __init__(self) -> None:
        self.state = CurveState()
        self.axes: Axes | None = None  # of the last drawn plot
        self._outlined: Region | None = None

    def draw(self, session: Session, material: str) -> None:
        """Draw into the current window, at its full width."""
        state = self.state
        if state.hold is not None and state.hold.material != material:
            state.release(session)
        if state.hold is None and not imgui.is_any_item_active():
            state.strokes.end(session)
        shown = state.shown(session, material)
        name = state.curve(material, shown)
        imgui.push_id(f"curves of {material}")
        room = imgui.get_content_region_avail()
        if room.x >= WIDE_PX:
            imgui.begin_child("controls", (CONTROLS_PX, 0))
            imgui.push_item_width(-88)
            self._curves(shown, material, name)
            self._controls(session, material, shown, name)
            imgui.pop_item_width()
            imgui.end_child()
            imgui.same_line()
            imgui.begin_child("plot", (0, 0))
            self._plot(session, material, shown, name, imgui.get_content_region_avail().y)
            imgui.end_child()
        else:
            self._curves(shown, material, name)
            self._plot(session, material, shown, name, min(max(0.6 * room.x, LEAST_PX), MOST_PX) + 110)
            self._controls(session, material, shown, name)
        imgui.pop_id()

    def _curves(self, shown: Shown, material: str, chosen: str) -> None:
        """Draw the list of curves, with their angles and the terms that use them."""
        editable, line = shown.editable, imgui.get_text_line_height_with_spacing()
        rows = min(len(editable.curves), MOST_ROWS) + 1
        flags = imgui.TableFlags_.row_bg | imgui.TableFlags_.scroll_y | imgui.TableFlags_.sizing_fixed_fit
        if not imgui.begin_table("list", 3, flags, (0, rows * line + 6)):
            return
        imgui.table_setup_scroll_freeze(0, 1)
        for heading in ("curve", "angle"):
            imgui.table_setup_column(heading)
        imgui.table_setup_column("in the terms", imgui.TableColumnFlags_.width_stretch)
        imgui.table_headers_row()
        for name in editable.curves:
            over, terms = _role(editable, name)
            edit = shown.edit(name)
            star = " *" if edit.layers or edit.drawn is not None else ""
            imgui.table_next_row()
            imgui.table_next_column()
            if imgui.selectable(f"{name}{star}##curve", name == chosen, imgui.SelectableFlags_.span_all_columns)[0]:
                self.state.chosen[material] = name
            explain(f"{name}: {_meaning(over)}\nin {', '.join(terms)}" + ("\n* edited" if star else ""))
            imgui.table_next_column()
            imgui.text_disabled(_title(over))
            imgui.table_next_column()
            imgui.text_disabled(", ".join(terms))
        imgui.end_table()

    def _plot(self, session: Session, material: str, shown: Shown, name: str, height: float) -> None:
        state, top = self.state, imgui.get_cursor_pos_y()
        curve = shown.editable.curves[name]
        view = state.view(material, name, curve)
        toolbar.draw(state, view, curve.values, curve is not shown.original.curves[name])
        below = 2 * imgui.get_text_line_height_with_spacing() + imgui.get_style().item_spacing.y
        width = imgui.get_content_region_avail().x
        left = max(height - (imgui.get_cursor_pos_y() - top) - below, 60.0)
        over, _ = _role(shown.editable, name)
        axes = plot.draw(state, session, material, shown, name, (width, left), _title(over), self._outlined)
        self.axes = axes or self.axes
        self._status()

    def _status(self) -> None:
        """Draw two lines below the plot: an error, the present drag, or help for the mouse."""
        state = self.state
        at, hold = imgui.get_cursor_pos_y(), state.hold
        imgui.push_text_wrap_pos()
        if state.strokes.message:
            coloured(state.strokes.message, AMBER)
        elif hold is not None and hold.layers:
            imgui.text_unformatted(", ".join(layers.words(layer) for layer in hold.layers))
        else:
            imgui.text_disabled(HINTS[state.tool])
        imgui.pop_text_wrap_pos()
        rest = 2 * imgui.get_text_line_height_with_spacing() - (imgui.get_cursor_pos_y() - at)
        if rest > imgui.get_style().item_spacing.y:
            imgui.dummy((1, rest - imgui.get_style().item_spacing.y))

    def _controls(self, session: Session, material: str, shown: Shown, name: str) -> None:
        state = self.state
        curve = shown.editable.curves[name]
        imgui.separator_text("region")
        toolbar.draw_region(state, state.view(material, name, curve), curve)
        imgui.separator_text("layers")
        self._outlined = layers.draw(state, session, material, shown, name)
        imgui.separator_text("colour of each term")
        quantities.draw_tints(state, session, material, shown)
        title = quantities.title(shown)
        if title is not None:
            imgui.separator_text(title)
            quantities.draw_numbers(state, session, material, shown)


def _role(editable: Editable, curve: str) -> tuple[str, list[str]]:
    """The angle of a curve (a key of `PARAMETRISATIONS`), and the names of its terms."""
    terms = [term for term in editable.terms if curve in term.curves]
    over = next((factor.over for term in terms for factor in term.factors if factor.curve == curve), "theta_o")
    return over, [term.name for term in terms]


def _title(over: str) -> str:
    return PARAMETRISATIONS[over].title


def _meaning(over: str) -> str:
    return PARAMETRISATIONS[over].meaning
