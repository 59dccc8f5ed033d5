"""`lambent edit`: the material editor in a window of its own, beside a preview."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from lambent.core.errors import UserError
from lambent.materials.document import Material, load_material
from lambent.realtime.device import open_device
from lambent.realtime.frame_state import LIGHT_MAP_NOISE
from lambent.scenes.geometry import sphere
from lambent.viewer.app import Window, check_display
from lambent.viewer.editor.documents import kind_of
from lambent.viewer.editor.editor import Editor
from lambent.viewer.editor.measurement import Measurement, read_measurement
from lambent.viewer.editor.preview import OBJECT, Preview, preview_record
from lambent.viewer.editor.stage import Stage
from lambent.viewer.editor.start import start_material
from lambent.viewer.lost import kept
from lambent.viewer.picking import Geometry
from lambent.viewer.picture import CHOICES
from lambent.viewer.state import ViewerState


def run(
    file: Path,
    material: Path | None = None,
    environments: Sequence[Path] = (),
    *,
    size: tuple[int, int] = (1680, 1050),
    frames: int | None = None,
    folder: Path | None = None,
) -> None:
    """Show the editor; returns when its window is closed.

    Parameters
    ----------
    file : Path
        A measured table in any known format, or a material document.
    material : Path, optional
        A document: the material to start from, or, where `file` is one too, the material B to compare with.
    environments : sequence of Path
        Lat-long pictures to light the preview with; the .hdr files beside `file` are offered too.
    size, frames, folder
        As in `app.run`.

    Raises
    ------
    UserError
        Where there is no display or adapter, or a file cannot be used.
    """
    check_display("the editor needs one: use `lambent fit --plot`")
    state = editor_state(file, material, environments, folder=folder or Path.cwd())
    ball = sphere(1.0)
    geometry = Geometry(ball.positions, ball.faces, ())
    editor = state.editor
    window = Window(state, geometry, Stage(open_device()), size=size, frames=frames)
    with kept(state):
        window.run()
    if editor is not None and editor.unsaved:
        sys.stderr.write(f"lambent: note: {editor.name} was changed and not saved\n")


def editor_state(
    file: Path, material: Path | None = None, environments: Sequence[Path] = (), *, folder: Path
) -> ViewerState:
    """The state that the window of `run` starts with."""
    measurement, start, other, home = _materials(file, material)
    choices = replace(CHOICES, shows=tuple(show for show in CHOICES.shows if show != LIGHT_MAP_NOISE))
    state = ViewerState.of(preview_record(start), choices, "orbit", folder=folder)
    state.preview = _preview(file, environments)
    state.select(OBJECT)
    editor = Editor(state.edits, start.name, folder, state.say)
    if home is not None:
        editor.file_name = str(home)
        editor.may_replace(home)
    if other is not None:
        editor.compare_with(other)
    editor.show_measurement(measurement)

    def open_environment(path: Path) -> None:
        assert state.preview is not None
        state.preview.environment = state.preview.add(path)

    editor.open_environment = open_environment
    state.editor = editor
    return state


def _materials(file: Path, material: Path | None) -> tuple[Measurement | None, Material, Material | None, Path | None]:
    """What to show: the measurement, the material A, the material B, and the document that A came from."""
    if material is not None and (kind_of(file), kind_of(material)) == ("material", "measurement"):
        file, material = material, file  # the other way round is as clear
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
            raise UserError("no such file", file=path, field="--environment")
        preview.environment = preview.add(path)
    return preview
