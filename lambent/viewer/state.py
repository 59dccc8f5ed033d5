"""The one state of the window. Panels and event handlers read and write only this; the window draws what it says."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from lambent.core.camera import Camera, CameraPath, overview
from lambent.core.errors import UserError
from lambent.core.false_colour import Range
from lambent.core.plain import plain_name
from lambent.materials.document import Material
from lambent.scenes.camera_paths import camera_at
from lambent.scenes.scene import EYE_HEIGHT_M
from lambent.store.contract import ObjectRecord, SceneRecord
from lambent.viewer import cameras
from lambent.viewer.metering import Meter
from lambent.viewer.recorder import Recorder
from lambent.viewer.views import SavedViews, write_alone

if TYPE_CHECKING:
    from lambent.viewer.comparison import Comparison
    from lambent.viewer.editor.editor import Editor
    from lambent.viewer.editor.preview import Preview
    from lambent.viewer.filming import Filming, FilmOptions
    from lambent.viewer.markers import Ball, Line

Mode = Literal["orbit", "walk"]
MESSAGE_S = 6.0
TARGET_MS = 1e3 / 15
NOISE_SCALE = Range(0.5, 50.0)  # percent
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

    path: CameraPath
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
    planars: tuple[str, ...] = ("auto",)  # ways of planar reflectors


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
    scale: float = 1.0  # of the picture's width and height, by the pacing
    mirrors: int | None = 0  # planar reflectors drawn by mirror pictures; None: left out, by the pacing


@dataclass
class Walker:
    """Who walks: pace in m/s, eye above the floor in m."""

    speed_m_s: float
    eye_height_m: float


@dataclass
class Marks:
    """What is drawn over the picture, and whether it is wanted; places are shares of the picture."""

    probes: bool = False
    reflectors: bool = False
    balls: tuple[Ball, ...] = ()
    lines: tuple[Line, ...] = ()


@dataclass
class ViewerState:
    """See the module. `folder` is where pictures and materials are saved; `clock` gives seconds."""

    scene: SceneRecord
    camera: Camera
    edits: MaterialEdits
    choices: Choices
    mode: Mode
    exposure_ev: float
    view_transform: str
    integrator: str
    show: str
    lookup: str
    planar: str = "auto"
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
    touched_s: float = -math.inf  # when the last event came
    answering: bool = False  # an event was just seen: the interface answers before the picture is refined further
    adaptive_resolution: bool = True  # fewer pixels while moving, where the adapter is slow
    target_ms: float = TARGET_MS  # that a frame in motion should take
    scale: Range = field(default_factory=Range)  # of false colour
    noise_scale: Range = field(default_factory=lambda: NOISE_SCALE)  # of the noise of the light map
    light_map_noise: bool = False  # whether the store says how exact its light map is
    near_m: float | None = None  # nearer things are cut away; None: by the scene's size
    walker: Walker = field(default_factory=lambda: Walker(cameras.WALK_M_S, EYE_HEIGHT_M))
    views: SavedViews | None = None
    view_name: str = ""  # typed for the next saved view
    renaming: tuple[str, str] | None = None  # "camera" or "path", and its name
    typed_name: str = ""  # while renaming
    recorder: Recorder = field(default_factory=Recorder)
    meter: Meter = field(default_factory=Meter)
    comparison: Comparison | None = None  # where the picture can be compared with another integrator's
    marks: Marks = field(default_factory=Marks)
    film: FilmOptions | None = None  # where films can be made
    film_wanted: CameraPath | None = None
    filming: Filming | None = None
    notes: tuple[str, ...] = ()  # on the light map
    saved: dict[str, Material] = field(default_factory=dict)  # materials as they were saved last
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
        camera = scene.cameras[0] if scene.cameras else overview(*scene.bounds)
        first = (choices.view_transforms[0], choices.integrators[0], choices.shows[0], choices.lookups[0])
        state = cls(scene, camera, MaterialEdits(scene.materials), choices, mode, scene.exposure_ev, *first, **options)  # type: ignore[arg-type]
        state.walker = Walker(cameras.speed_m_s(scene.bounds, False), cameras.eye_height_m(scene.bounds))
        return state

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The scene's, and those that were saved."""
        return self.scene.cameras if self.views is None else self.views.all.cameras

    @property
    def paths(self) -> tuple[CameraPath, ...]:
        """The scene's, those that were saved, and the one just recorded."""
        paths = self.scene.paths if self.views is None else self.views.all.paths
        return paths if self.recorder.draft is None else (*paths, self.recorder.draft)

    def say(self, text: str) -> None:
        """Show a message for `MESSAGE_S` seconds."""
        self.messages.append(Message(text, self.clock() + MESSAGE_S))

    def drop_old_messages(self) -> None:
        now = self.clock()
        self.messages = [m for m in self.messages if m.until_s > now]

    def jump(self, camera: Camera) -> None:
        self.camera, self.path = camera, None

    def close_editor(self) -> None:
        """Close the editor; the material stays as it is."""
        if self.editor is not None:
            if self.editor.saved is not None:
                self.saved[self.editor.name] = self.editor.saved
            self.editor.close()
        self.editor = None

    @property
    def unsaved(self) -> tuple[str, ...]:
        """Materials that are neither the scene's nor as they were saved; of the editor's own window, its material."""
        if self.preview is not None and self.editor is not None:
            return (self.editor.name,) if self.editor.unsaved else ()
        saved = dict(self.saved)
        if self.editor is not None and self.editor.saved is not None:
            saved[self.editor.name] = self.editor.saved
        return tuple(
            name for name, now in self.edits.edited.items() if now != saved.get(name, self.scene.materials[name])
        )

    def rescue_materials(self) -> tuple[Path, ...]:
        """Write what was not saved to files of new names, because the window is about to be lost."""
        written = []
        for name in self.unsaved:
            material = self.edits.current(name)
            path = rescue_file(self.folder, material.name or name)
            material.save(path)
            written.append(path)
        return tuple(written)

    def rescue_recording(self) -> tuple[str, ...]:
        """Save what was recorded; where the store cannot take it, write a `views.json` that holds it into `folder`."""
        name = self.keep_recording()
        if name is not None:
            return (f"the store as {name!r}",)
        draft = self.recorder.draft
        if self.views is None or draft is None:
            return ()
        name = self.recorder.name.strip() or self.views.free_path_name()
        path = rescue_file(self.folder, name)
        write_alone(path, replace(draft, name=name))
        return (f"{path}, a views.json for a store",)

    # views and recordings

    def save_view(self) -> None:
        """Save where the camera stands, under the typed name or the next free one."""
        if self.views is not None:
            added = self.views.add_camera(self.camera, self.view_name if self.view_name.strip() else None)
            if added is not None:
                self.view_name, self.camera = "", added
                self.say(f"saved the view {added.name}")

    def record(self) -> None:
        """Begin to record the camera's way, or stop."""
        if self.views is None:
            return
        if not self.recorder.on:
            if self.path is not None:
                self.path.playing = False
            self.recorder.begin(self.clock())
        elif (draft := self.recorder.stop()) is not None:
            self.recorder.name = self.recorder.suggested = self.views.free_path_name()
            self.path = PathPlay(draft, draft.seconds, playing=False)  # chosen, and ready to be played
            self.say(f"recorded {draft.seconds:.1f} s")
        else:
            self.say("nothing recorded: the camera did not move")

    def save_recording(self) -> None:
        """Save the draft under the typed name; nobody asked for the suggested one, the next free one is as good."""
        recorder = self.recorder
        if self.views is not None and recorder.draft is not None:
            name = None if recorder.name == recorder.suggested else recorder.name
            self._saved_recording(self.views.add_path(recorder.draft, name))

    def _saved_recording(self, added: CameraPath | None) -> None:
        if added is not None:
            self.recorder.drop()
            self.scrub(added, 0.0)
            self.say(f"saved the path {added.name}")

    def keep_recording(self) -> str | None:
        """Save what was recorded and not yet saved, because the window closes; returns the path's name."""
        if self.recorder.on:
            self.record()
        draft = self.recorder.draft
        if self.views is None or draft is None:
            return None
        typed = self.recorder.name if self.recorder.name.strip() not in ("", self.recorder.suggested) else None
        added = self.views.add_path(draft, typed)
        if added is None and typed is not None:  # the name is taken, or none: the walk is worth more
            added = self.views.add_path(draft)
        self._saved_recording(added)
        return added.name if added is not None else None

    def drop_recording(self) -> None:
        """Forget the draft."""
        if self.path is not None and self.path.path == self.recorder.draft:
            self.path = None
        self.recorder.drop()

    def set_eye_height(self, eye_height_m: float) -> None:
        """Grow or shrink the walker; whoever stands is lifted at once."""
        lift = eye_height_m - self.walker.eye_height_m
        self.walker.eye_height_m = eye_height_m
        if self.mode == "walk" and not self.flying and lift:
            (px, py, pz), (tx, ty, tz) = self.camera.position, self.camera.target
            places = {"position": (px, py + lift, pz), "target": (tx, ty + lift, tz)}
            self.move(replace(self.camera, name="free", **places))

    def set_fov(self, fov_y_deg: float) -> None:
        """Another field of view."""
        self.move(replace(self.camera, name="free", fov_y_deg=fov_y_deg))

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

    def scrub(self, path: CameraPath, time_s: float) -> None:
        """Stand where `path` leads at `time_s`."""
        self.path, self.camera = PathPlay(path, time_s, playing=False), camera_at(path, time_s)

    def toggle(self, path: CameraPath) -> None:
        """Pause a path that plays; play one that is paused, from its start when it is over."""
        if self.path is None or self.path.path != path or self.path.time_s >= path.seconds:
            self.path = PathPlay(path)
        else:
            self.path.playing = not self.path.playing

    def move(self, camera: Camera) -> None:
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
        return self.file_names.get(material, f"{plain_name(material)}.json")

    def save_material(self, name: str) -> None:
        """Write the material as it is now into `folder`, and say so, or say why not.

        Its provenance stays, with a note where numbers were changed by hand.
        """
        from lambent.viewer.editor.documents import with_account

        file_name, material = self.file_name(name), self.edits.current(name)
        try:
            with_account(material, self.scene.materials[name], None, {}).save(file_in(self.folder, file_name))
        except UserError as error:
            self.say(f"not saved: {error}")
        except OSError as error:  # its own words name a file that was to become this one
            self.say(f"not saved: {self.folder / file_name}: cannot be written ({error.strerror})")
        else:
            self.saved[name] = material
            self.say(f"saved {file_name}")


def rescue_file(folder: Path, name: str) -> Path:
    """A file that is not there yet, for what would else be lost."""
    stem, number = plain_name(name), 1
    while (path := folder / f"{stem}-rescued-{number:03}.json").exists():
        number += 1
    return path


def file_in(folder: Path, file_name: str) -> Path:
    """`folder / file_name` for a bare `*.json` name, else a `UserError`."""
    if not file_name.endswith(".json") or file_name == ".json" or Path(file_name).name != file_name:
        raise UserError("not a file name", got=file_name, expected="a name like walnut.json")
    return folder / file_name
