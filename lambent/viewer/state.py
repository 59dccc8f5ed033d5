"""The one state of the window. Panels and event handlers read and write only this; the window draws what it says."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from lambent.core.errors import UserError
from lambent.materials.document import Material
from lambent.store.camera_paths import camera_at
from lambent.store.contract import CameraRecord, ObjectRecord, PathRecord, SceneRecord

if TYPE_CHECKING:
    from lambent.viewer.editor.editor import Editor
    from lambent.viewer.editor.preview import Preview

Mode = Literal["orbit", "walk"]
MESSAGE_S = 6.0
UNDO_LIMIT = 200


@dataclass
class MaterialEdits:
    """Materials that differ from the scene's, with undo and redo.

    A stroke is what one drag of a slider does: any number of `change`, then one `end_stroke`. It is undone as a whole.
    """

    scene: Mapping[str, Material]
    edited: dict[str, Material] = field(default_factory=dict)
    _undo: list[dict[str, Material]] = field(default_factory=list)
    _redo: list[dict[str, Material]] = field(default_factory=list)
    _before: dict[str, Material] | None = None  # what the open stroke started from

    def current(self, name: str) -> Material:
        return self.edited.get(name, self.scene[name])

    def change(self, name: str, material: Material) -> None:
        if self._before is None:
            self._before = dict(self.edited)
        self.edited[name] = material
        if material == self.scene[name]:
            del self.edited[name]

    def end_stroke(self) -> None:
        before, self._before = self._before, None
        if before is not None and before != self.edited:
            self._undo = [*self._undo, before][-UNDO_LIMIT:]
            self._redo.clear()

    def reset(self, name: str) -> None:
        """Back to the scene's material, as a stroke of its own."""
        self.end_stroke()
        self.change(name, self.scene[name])
        self.end_stroke()

    @property
    def in_stroke(self) -> bool:
        """Whether something is being changed at this moment."""
        return self._before is not None

    def previous(self, name: str) -> Material | None:
        """The material before the last stroke, or before the one under way; None where there was none."""
        before = self._before if self._before is not None else self._undo[-1] if self._undo else None
        return None if before is None else before.get(name, self.scene[name])

    @property
    def can_undo(self) -> bool:
        return bool(self._undo) or self._before is not None

    @property
    def can_redo(self) -> bool:
        return bool(self._redo)

    def undo(self) -> None:
        self.end_stroke()
        if self._undo:
            self._redo.append(self.edited)
            self.edited = self._undo.pop()

    def redo(self) -> None:
        self.end_stroke()
        if self._redo:
            self._undo.append(self.edited)
            self.edited = self._redo.pop()


@dataclass
class PathPlay:
    """A camera path being shown."""

    path: PathRecord
    time_s: float = 0.0
    playing: bool = True


@dataclass(frozen=True)
class Choices:
    """What the renderer can be asked for, so that a panel offers nothing else."""

    integrators: tuple[str, ...]
    view_transforms: tuple[str, ...]
    shows: tuple[str, ...]
    lookups: tuple[str, ...]
    sample_counts: tuple[int, ...]


@dataclass
class Message:
    text: str
    until_s: float


@dataclass(frozen=True)
class Statistics:
    """What the last frame cost. Times in ms; `gpu_ms` is empty where the adapter has no timers."""

    adapter: str = ""
    integrator: str = ""
    frame_ms: float = 0.0
    gpu_ms: Mapping[str, float] = field(default_factory=dict)
    draw_calls: int = 0
    resolution: tuple[int, int] = (0, 0)
    samples: int = 0  # per pixel, of the frame
    accumulated: int = 0  # per pixel, since the camera rests
    accumulate_to: int = 0


@dataclass
class ViewerState:
    """See the module. `folder` is where pictures and materials are saved; `clock` gives seconds."""

    scene: SceneRecord
    camera: CameraRecord
    edits: MaterialEdits
    choices: Choices
    mode: Mode
    exposure_ev: float
    view_transform: str
    integrator: str
    show: str
    lookup: str
    n: int | None = None  # samples per lobe; None: chosen per material from its roughness
    flying: bool = False
    selected: str | None = None  # object name
    reveal_selected: bool = False  # the list of objects has yet to scroll to it
    linked_roughness: bool = True  # mx and my keep their ratio
    file_names: dict[str, str] = field(default_factory=dict)  # material -> where it is saved
    typed_measurement: str = ""  # path of a file to compare the selected material with
    path: PathPlay | None = None
    missing: tuple[str, ...] = ()  # what the store lacks
    refine: bool = True  # accumulate while nothing moves
    answering: bool = False  # an event was just seen: the interface answers before the picture is refined further
    adaptive_resolution: bool = True  # fewer pixels while moving, where the adapter is slow
    panels_shown: bool = True
    screenshot_wanted: bool = False
    statistics: Statistics = field(default_factory=Statistics)
    messages: list[Message] = field(default_factory=list)
    preview: Preview | None = None  # where the picture is one, and no scene
    editor: Editor | None = None  # of one of the materials, with a measurement
    folder: Path = field(default_factory=Path)
    clock: Callable[[], float] = time.monotonic

    @classmethod
    def of(cls, scene: SceneRecord, choices: Choices, mode: Mode, **options: object) -> ViewerState:
        """State at the scene's first camera, or, where it has none, at one that sees the whole scene.

        Every choice starts at its first value.
        """
        camera = scene.cameras[0] if scene.cameras else overview(scene)
        first = (choices.view_transforms[0], choices.integrators[0], choices.shows[0], choices.lookups[0])
        return cls(scene, camera, MaterialEdits(scene.materials), choices, mode, scene.exposure_ev, *first, **options)  # type: ignore[arg-type]

    def say(self, text: str) -> None:
        """Show a message for `MESSAGE_S` seconds."""
        self.messages.append(Message(text, self.clock() + MESSAGE_S))

    def drop_old_messages(self) -> None:
        now = self.clock()
        self.messages = [m for m in self.messages if m.until_s > now]

    def jump(self, camera: CameraRecord) -> None:
        self.camera, self.path = camera, None

    def close_editor(self) -> None:
        """Close the editor; the material stays as it is."""
        if self.editor is not None:
            self.editor.close()
        self.editor = None

    @property
    def playing(self) -> bool:
        return self.path is not None and self.path.playing

    def play(self, dt_s: float) -> None:
        """Go on along a path that is playing; it stops at its end."""
        if self.path is None or not self.path.playing:
            return
        self.path.time_s = min(self.path.time_s + dt_s, self.path.path.seconds)
        self.path.playing = self.path.time_s < self.path.path.seconds
        self.camera = camera_at(self.path.path, self.path.time_s)

    def scrub(self, path: PathRecord, time_s: float) -> None:
        """Stand where `path` leads at `time_s`."""
        self.path, self.camera = PathPlay(path, time_s, playing=False), camera_at(path, time_s)

    def toggle(self, path: PathRecord) -> None:
        """Pause a path that plays; play one that is paused, from its start when it is over."""
        if self.path is None or self.path.path != path or self.path.time_s >= path.seconds:
            self.path = PathPlay(path)
        else:
            self.path.playing = not self.path.playing

    def move(self, camera: CameraRecord) -> None:
        """Take a camera the user moved; that ends a path being shown."""
        if camera != self.camera:
            self.jump(camera)

    def select(self, name: str | None) -> None:
        self.selected, self.reveal_selected = name, name is not None

    @property
    def selected_object(self) -> ObjectRecord | None:
        return next((o for o in self.scene.objects if o.name == self.selected), None)

    @property
    def selected_material(self) -> str | None:
        chosen = self.selected_object
        return chosen.material if chosen else None

    def file_name(self, material: str) -> str:
        """Where `material` will be saved: what was typed, else its name."""
        plain = "".join(c if c.isalnum() or c in " ._-" else "_" for c in material).strip(" .") or "material"
        return self.file_names.get(material, f"{plain}.json")

    def save_material(self, name: str) -> None:
        """Write the material as it is now into `folder`, and say so, or say why not."""
        file_name = self.file_name(name)
        try:
            self.edits.current(name).save(file_in(self.folder, file_name))
        except (UserError, OSError) as error:
            self.say(f"not saved: {error}")
        else:
            self.say(f"saved {file_name}")


def file_in(folder: Path, file_name: str) -> Path:
    """`folder / file_name` for a bare `*.json` name, else a `UserError`."""
    if not file_name.endswith(".json") or file_name == ".json" or Path(file_name).name != file_name:
        raise UserError("not a file name", got=file_name, expected="a name like walnut.json")
    return folder / file_name


def overview(scene: SceneRecord) -> CameraRecord:
    """A camera in front of the scene that sees all of it."""
    (x0, y0, z0), (x1, y1, z1) = scene.bounds
    centre = ((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2)
    away = 1.3 * max(x1 - x0, y1 - y0) + (z1 - z0) / 2
    return CameraRecord(name="overview", position=(centre[0], centre[1], centre[2] + away), target=centre)
