"""The panels of the edit mode: scene, material and curves, comparison, look, files."""

from __future__ import annotations

from functools import partial

from imgui_bundle import imgui

from lambent.viewer.edits.keeping import SessionKeeper
from lambent.viewer.modes.edit.state import OFF, EditState
from lambent.viewer.panels import parameters
from lambent.viewer.panels.widgets import (
    AMBER,
    DIM,
    buttons,
    check,
    choice,
    coloured,
    press,
    rows,
    typed_field,
    wrapped,
)

HISTORY = ("undo", "redo")
LEAST_CHOICE_PX = 80.0


def draw_head(state: EditState, keeper: SessionKeeper) -> None:
    """Draw the way back to the room, and lines on the store's session, where it is not kept or not taken over whole."""
    meaning = "walks through the room from here, with its materials as edited"
    buttons([("walk from here", keeper.keeps and not state.files.fitting.busy, state.enter_room, meaning)])
    lines = dict.fromkeys(line for line in (keeper.fault, *state.subject.lines) if line)
    wrapped(list(lines), AMBER)


def draw_scene(state: EditState) -> None:
    """Draw the view, its light, and the progress of its transport."""
    document = state.session.document
    width, height = document.size
    light = document.environment.file.rpartition("/")[2] if document.environment else "the scene's"
    rows(
        [("camera", document.camera.name), ("picture", f"{width} x {height}"), ("light", light),
         ("transport", f"{state.loading.lights} lights" if state.loading.lights else "not baked yet")], "scene"
    )  # fmt: skip
    if state.baking is not None:
        imgui.push_text_wrap_pos()
        coloured(state.baking.line, DIM)
        imgui.pop_text_wrap_pos()
    wrapped([line for line in (state.trouble, *state.subject.scene.warnings[:3]) if line], AMBER)
    text = typed_field(
        "environment",
        state.files.typed,
        "light",
        "another .hdr or .exr, lat-long...",
        "lights the scene with this image; can be undone",
    )
    if text is not None:
        state.files.open(text, state.material)
    meaning = "replaces the material before its edits; you can also drop a file onto the window"
    text = typed_field("become", state.files.typed, "open", "a material document or a table...", meaning)
    if text is not None:
        state.files.open(text, state.material)


def draw_material(state: EditState) -> None:
    """Draw the selected material in plain words, undo and redo."""
    names = state.materials
    if not names:
        return
    if state.material not in names:
        state.material = names[0]
    meaning = "the material to edit (Tab selects the next)"
    room = imgui.get_content_region_avail().x - sum(imgui.calc_text_size(word).x for word in ("material", *HISTORY))
    room -= 2 * imgui.get_style().item_spacing.x + 6 * imgui.get_style().frame_padding.x
    chosen = choice("material", state.material, names, meaning, max(room, LEAST_CHOICE_PX))
    if chosen != state.material:
        state.select(chosen)
    if room >= LEAST_CHOICE_PX:
        imgui.same_line()
    history, session = state.session.history, state.session
    buttons([
        (HISTORY[0], history.can_undo, session.undo, "undoes the last step (Ctrl+Z)"),
        (HISTORY[1], history.can_redo, session.redo, "redoes the step (Ctrl+Shift+Z)"),
    ])  # fmt: skip
    edits = state.subject.edits
    state.change(chosen, parameters.in_words(edits.current(chosen), edits.scene[chosen]))
    buttons(
        [("reset material", chosen in edits.edited, partial(edits.reset, chosen), "restores the material as baked")]
    )


class Numbers:
    """Every parameter of the selected material."""

    def __init__(self, state: EditState) -> None:
        self._state, self._linked = state, True

    def draw(self) -> None:
        if (name := self._state.selected) is not None:
            material, self._linked = parameters.edited(self._state.subject.edits.current(name), self._linked)
            self._state.change(name, material)


def draw_compare(state: EditState) -> None:
    """Draw the choice of the picture A, and whether B shows its difference from A."""
    compared = state.compared
    before = compared.chosen
    compared.chosen = choice("A", compared.chosen, compared.choices, "state A, with which the picture is compared")
    compared.divider.a_label, compared.divider.b_label = compared.chosen, "now"
    buttons(
        [
            (
                "snapshot",
                bool(state.now),
                lambda: compared.keep(state.now),
                "stores the present state, to compare with later",
            )
        ]
    )
    imgui.same_line()
    imgui.begin_disabled(compared.chosen == OFF)
    meaning = "shows the difference from A in false colours: blue darker, orange brighter, black equal"
    shown = check("difference", state.is_difference, meaning)
    if compared.chosen != OFF:
        compared.is_difference = shown
    imgui.end_disabled()
    if compared.chosen != before:
        compared.scale = None
    if state.is_difference:
        imgui.same_line()
        if press("fit scale", "fits the colour range to the differences, without the largest half per cent"):
            compared.scale = None


def draw_files(state: EditState) -> None:
    """Draw saving of the session and of the material."""
    files, keeper, chosen = state.files, state.files.keeper, bool(state.material)
    saved = "save session", True, files.save, "saves the session (Ctrl+S); never overwrites another session's file"
    export = partial(files.export, state.material)
    buttons([
        *([] if keeper is not None and keeper.keeps else [saved]),
        ("save material", chosen, export, "saves the edited material as a document for all other commands"),
    ])  # fmt: skip
    if files.home is not None:
        coloured(files.home.name + (" (changed)" if files.unsaved else ""), DIM)
    if files.fitting.busy:
        coloured(files.fitting.doing, DIM)
