"""The material mode: the editor and its preview, with their panels and input."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from lambent.core.errors import UserError
from lambent.materials.document import Material, load_material
from lambent.realtime.frame_state import LIGHT_MAP_NOISE
from lambent.viewer.background.lost import rescued
from lambent.viewer.background.work import POLL_S
from lambent.viewer.cameras.navigation import Navigation
from lambent.viewer.editor.editor import Editor
from lambent.viewer.editor.files import kind_of
from lambent.viewer.editor.measurement import Measurement, read_measurement, start_material
from lambent.viewer.edits.edits import MaterialEdits, rescue
from lambent.viewer.input import Input
from lambent.viewer.look import SHOWS, Look
from lambent.viewer.mode import Drawing, Mode, Panel, SidePlots, Textures
from lambent.viewer.modes.material.preview import BOUNDS, CAMERA, SHAPES, Preview
from lambent.viewer.panels import editing, overlay, statistics
from lambent.viewer.panels import look as looks
from lambent.viewer.panels.plots import side_plots
from lambent.viewer.panels.widgets import check, choice, rows, typed_field
from lambent.viewer.screen import Screen

SHORTCUTS = (
    ("left drag", "orbit the shape"),
    ("right, middle drag", "pan"),
    ("wheel", "zoom"),
    ("1", "reset the view"),
    ("Ctrl+click on a slider", "type a number"),
    ("Ctrl+Z, Ctrl+Shift+Z", "undo, redo a step"),
    ("Ctrl+S", "save the material"),
    ("Ctrl+Q", "close the window"),
    ("P", "save the picture (PNG and EXR)"),
    ("H", "hide or show everything but the picture"),
)


@dataclass
class MaterialState:
    """Loosely coupled parts of the state; a panel takes the parts that it needs."""

    screen: Screen
    look: Look
    navigation: Navigation
    preview: Preview
    editor: Editor

    @classmethod
    def of(cls, file: Path, material: Path | None, environments: Sequence[Path], screen: Screen) -> MaterialState:
        """The first state, from the arguments of `lambent.viewer.edit.run`."""
        measurement, start, other, home = _materials(file, material)
        look = Look(shows=tuple(show for show in SHOWS if show != LIGHT_MAP_NOISE))
        preview = _preview(file, environments)
        editor = Editor(MaterialEdits({start.name: start}), start.name, screen)
        if home is not None:
            editor.files.came_from(home)
        if other is not None:
            editor.subject.compare_with(other)
        editor.show_measurement(measurement)
        editor.files.open_environment = preview.choose
        return cls(screen, look, Navigation(CAMERA, BOUNDS, "orbit"), preview, editor)


def _materials(file: Path, material: Path | None) -> tuple[Measurement | None, Material, Material | None, Path | None]:
    """The measurement, the material A, the material B, and the document that A came from."""
    if material is not None and (kind_of(file), kind_of(material)) == ("material", "measurement"):
        file, material = material, file  # both orders are unambiguous
    if kind_of(file) == "environment":
        raise UserError("is a picture", file=file, expected="a measured table or a material document")
    if kind_of(file) == "material":
        return None, load_material(file), load_material(material) if material else None, file
    start = load_material(material) if material else None
    measurement = read_measurement(file)
    return measurement, start or start_material(measurement), None, material


def _preview(file: Path, environments: Sequence[Path]) -> Preview:
    preview = Preview()
    for path in sorted(file.resolve().parent.glob("*.hdr")):
        preview.add(path)
    for path in environments:
        if not path.is_file():
            raise UserError("file does not exist", file=path, field="--environment")
        preview.choose(path)
    return preview


class MaterialInput(Input):
    """Orbits the shape; saves the material."""

    def __init__(self, state: MaterialState) -> None:
        super().__init__(state.screen, state.navigation, state.editor.subject.edits)
        self._editor = state.editor

    def pressed_key(self, key: str) -> None:
        if key == "1":
            self.navigation.jump(CAMERA)

    def saved(self) -> None:
        self._editor.save()


class MaterialMode(Mode):
    """See the module."""

    def __init__(self, state: MaterialState, drawing: Drawing) -> None:
        super().__init__(state.editor.subject.name, state.screen, MaterialInput(state), drawing, panels(state))
        self.state = state
        self.head = partial(editing.draw_head, state.editor)

    @property
    def side_plots(self) -> SidePlots | None:
        return side_plots(self.state.editor)

    def draw_over(self, textures: Textures) -> None:
        overlay.false_colour_bar(self.screen.picture, self.state.look)
        overlay.draw(self.screen)

    def advance(self, dt_s: float) -> None:
        self.state.editor.tick()

    def wait_s(self) -> float | None:
        return POLL_S if self.state.editor.busy else None

    def drop(self, path: str) -> None:
        self.state.editor.files.open(path)

    @property
    def unsaved(self) -> tuple[str, ...]:
        return (self.title,) if self.state.editor.subject.unsaved else ()

    def save(self) -> None:
        self.state.editor.save()

    def rescue(self) -> None:
        subject = self.state.editor.subject
        names = [subject.name] if subject.unsaved else []
        rescued("an unsaved material", lambda: rescue(subject.edits, names, self.screen.folder))

    def close(self) -> None:
        self.state.editor.close()
        if self.unsaved:
            sys.stderr.write(f"lambent: note: changes not saved: {self.title}\n")


def panels(state: MaterialState) -> tuple[Panel, ...]:
    """Panels of the column."""
    editor = state.editor
    return (
        Panel("Material", partial(editing.draw, editor), "every number of the material", opened=True),
        Panel("Fit", partial(editing.draw_fit, editor), "fit the material to the measurement", opened=True),
        Panel(
            "Preview",
            partial(draw_preview, state.preview, editor, state.look),
            "shape and environment of the preview",
            opened=True,
        ),
        Panel("View", partial(looks.draw, state.look, state.screen), "how the preview is drawn"),
        Panel("Statistics", partial(statistics.draw, state.screen, editor), "cost of the last frame"),
        Panel("Help", partial(rows, SHORTCUTS, "shortcuts"), "mouse and keys"),
    )


def draw_preview(preview: Preview, editor: Editor, look: Look) -> None:
    """Draw shape, environment and exposure."""
    looks.draw_exposure(look, "##preview")
    preview.shape = choice("shape", preview.shape, tuple(SHAPES), "the shape that shows the material")
    meaning = "the environment; all are scaled to the same mean radiance"
    preview.environment = choice("light", preview.environment, preview.environments, meaning)
    hint = "another .hdr or .exr, lat-long, angular or cube..."
    text = typed_field("environment", editor.files.typed, "add", hint, "adds an environment to the list and shows it")
    if text is not None:
        editor.files.open(text)
    meaning = "shows plots of the material and its measurement"
    editor.plots.visible = check("disks and curves beside the picture", editor.plots.visible, meaning)
