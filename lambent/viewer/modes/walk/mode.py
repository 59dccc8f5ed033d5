"""The walk mode: its panels, its drawing, its input."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from imgui_bundle import imgui

from lambent.viewer.background.fitting import Fitting
from lambent.viewer.background.lost import rescued
from lambent.viewer.background.work import POLL_S
from lambent.viewer.cameras.navigation import Movement
from lambent.viewer.mode import Drawing, Panel, SidePlots, Textures
from lambent.viewer.modes.walk import dropping
from lambent.viewer.modes.walk.comparison import error_scale
from lambent.viewer.modes.walk.input import CARD, SHORTCUTS, WalkInput
from lambent.viewer.modes.walk.light.falling import FallingLight
from lambent.viewer.modes.walk.panels import (
    compare,
    film,
    lamps,
    light_field,
    lights,
    marks,
    material,
    metering,
    room,
    scene,
    show,
    states,
    view,
)
from lambent.viewer.modes.walk.session.finishes import Finishes
from lambent.viewer.modes.walk.session.leaving import can_leave, edit_view
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.modes.walk.walking import Walking, opened
from lambent.viewer.panels import card, overlay, statistics
from lambent.viewer.panels.curves import CurvesPanel
from lambent.viewer.panels.plots import side_plots
from lambent.viewer.panels.widgets import rows
from lambent.viewer.screen import Screen, least
from lambent.viewer.sizes import SizedPanel


def open_store(path: Path, movement: Movement, screen: Screen, *how: Any, **options: Any) -> WalkMode:
    """Start the mode on a store; parameters and errors as of `walking.opened`."""
    found = opened(path, movement, screen, *how, **options)
    falling = FallingLight(found.baked, found.store, lambda: found.pictures.light_groups)
    return WalkMode(found.state, found.input, found.pictures, falling)


class WalkMode(Walking):
    """See the module."""

    def __init__(
        self, state: WalkState, input: WalkInput, drawing: Drawing, falling: FallingLight | None = None
    ) -> None:
        self.finishes = Finishes(state.materials.edits, state.texturing, state.screen)
        self.fitting = Fitting(state.screen)
        of_column = panels(state, falling, self.finishes, self.fitting)
        super().__init__(state, input, drawing, of_column)
        self.falling = falling
        self.head = partial(room.draw, state)

    @property
    def side_plots(self) -> SidePlots | None:
        return side_plots(self.state.materials.editor) if self.screen.size == "measure" else None

    def draw_over(self, textures: Textures) -> None:
        state, place = self.state, self.screen.picture
        if self.screen.size != "show":
            overlay.over(place, textures.get("outline"))
        light_field.draw_over(state.fields, place, textures)
        lamps.draw_over(state.lamps, state.navigation.camera, place)
        marks.draw(state.marks, state.selected_parts, place, textures)
        comparison, recorder, filming = state.comparison, state.recordings.recorder, state.films.under_way
        if comparison.mode == "error map" and comparison.figures is not None:
            overlay.scale_bar(place, *error_scale(comparison.kind))
        else:
            overlay.false_colour_bar(place, state.look)
        metering.draw_readout(state.meter, state.look, place)
        lines = [] if filming is None else [f"film: frame {filming.done} of {filming.total}"]
        if recorder.on:
            lines.append(f"recording {self.screen.clock() - recorder.began_s:.0f} s   (R stops)")
        if state.session.fault:
            lines.append(state.session.fault)
        bar_px = show.height_px(state, moving=self.moving, dragging=self.input.dragging)
        overlay.draw(self.screen, lines, bar_px)
        if bar_px:
            show.draw(state, bar_px)
        card.draw(self.screen, CARD)

        if not imgui.is_any_item_active() and not self.input.moves_lamp:
            state.materials.edits.end_stroke()

    def advance(self, dt_s: float) -> None:
        super().advance(dt_s)
        if self.state.materials.editor is not None:
            self.state.materials.editor.tick()
        self.fitting.poll()

    def wait_s(self) -> float | None:
        editor, falling = self.state.materials.editor, self.falling
        busy = self.fitting.busy or (editor is not None and editor.busy) or (falling is not None and falling.busy)
        return least(POLL_S if busy else None, super().wait_s())

    def drop(self, path: str) -> None:
        dropping.drop(path, self.state, self.input, self.finishes)

    def save(self) -> None:
        if not self.state.session.keeps or not self.state.session.save():
            for name in self.state.unsaved_materials:
                self.state.materials.save(name)
        self.state.recordings.keep()

    def discard(self) -> None:
        self.state.recordings.drop()

    def rescue(self) -> None:
        if self.state.session.keeps:
            rescued("the session", self.state.session.rescue)
        else:
            rescued("an unsaved material", lambda: self.state.materials.rescue(self.state.unsaved_materials))
        rescued("the recorded walk", self.state.recordings.rescue)
        self.drawing.close()  # a running film leaves no file

    def close(self) -> None:
        self.fitting.close()
        self.state.materials.close_editor()
        super().close()


def panels(state: WalkState, falling: FallingLight | None, finishes: Finishes, fitting: Fitting) -> tuple[Panel, ...]:
    """Panels of the column, sorted into the sizes of the window."""
    light_on_it = partial(metering.draw_falling, falling, state)
    edits = state.materials.edits
    edit, can_edit = partial(edit_view, state), partial(can_leave, state)
    curves = CurvesPanel(lambda: state.selection.material, edits, edits.change, state.screen, fitting, edit, can_edit)
    of_lamps = SizedPanel("Lamps", partial(lamps.draw, state.lamps), "move, aim and exchange a lamp of the scene")
    return (
        SizedPanel("Material", partial(material.draw, state, finishes), "the selected object, its material", True),
        SizedPanel("Curves", curves.draw, "pull the curves of the selected material"),
        SizedPanel("Light on it", light_on_it, "illuminance on the selected object, by group", True, ("design",)),
        SizedPanel("Light", partial(lights.draw, state), "each group of lamps: on or off, brightness, colour"),
        *([of_lamps] if state.lamps.records else []),
        SizedPanel("View", partial(view.draw, state), "what the picture shows, and its exposure", True),
        SizedPanel("Scene", partial(scene.draw, state), "navigation, cameras, saved views and walks", True),
        SizedPanel("States", partial(states.draw, state), "store the room's state, restore it, compare states"),
        SizedPanel("Film", partial(film.draw, state), "a film along the chosen camera path"),
        *(SizedPanel(*one, sizes=("measure",)) for one in numbers(state, light_on_it)),
        SizedPanel("Help", partial(rows, SHORTCUTS, "shortcuts"), "mouse and keys"),
    )


def numbers(state: WalkState, light_on_it: Callable[[], None]) -> tuple[tuple[str, Callable[[], None], str], ...]:
    """Titles, drawing and meaning of the panels of numbers and settings."""
    cost = lambda: statistics.draw(state.screen, state.materials.editor, state.notes)  # noqa: E731
    return (
        ("Camera", partial(view.draw_camera, state), "field of view, walking speed, and marks over the picture"),
        ("Drawing", partial(view.draw_drawing, state), "how reflections are drawn, and how fast"),
        ("Light field", partial(light_field.draw, state), "points around the selected object and their maps"),
        ("Light meter", partial(metering.draw, state, light_on_it), "illuminance, luminance and glare in numbers"),
        ("Compare", partial(compare.draw, state.comparison), "the picture compared with another"),
        ("Statistics", cost, "cost of the last frame, and noise of the light map"),
    )
