"""Recording of walks: cameras and times, smoothed to a path for films and playback; saving of views and paths."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.light.light_mix import MixTrack
from lambent.core.plain import Triple, triple
from lambent.core.views.camera import Camera, CameraPath
from lambent.viewer.cameras.cameras import LONGEST_STEP_S
from lambent.viewer.cameras.navigation import Navigation, PathPlay
from lambent.viewer.edits.edits import rescue_file
from lambent.viewer.modes.walk.light.light_keys import key_times, mix_at, with_key, without_key
from lambent.viewer.modes.walk.light.lights import Lights, RecordedLight
from lambent.viewer.modes.walk.views.views import Kind, SavedViews, write_alone
from lambent.viewer.screen import Screen

KEY_S = 0.1  # time between two keys of a path
STILL_S = LONGEST_STEP_S  # a longer gap between two frames counts as standing still
LONGEST_S = 600.0
DRAFT = "recorded"
SMOOTH_S = 0.3  # standard deviation of the smoothing Gaussian


@dataclass
class Recording:
    """Drawn cameras and their times in seconds."""

    times_s: list[float] = field(default_factory=list)
    cameras: list[Camera] = field(default_factory=list)
    still_s: float = 0.0  # last time at which the last camera was seen

    def take(self, camera: Camera, time_s: float) -> None:
        """Record the camera. Call it every frame, so that a slow frame is not taken for standing still."""
        if self.cameras and camera == self.cameras[-1]:
            self.still_s = max(time_s, self.still_s)
            return
        still_s = max(self.still_s, time_s - STILL_S)
        if self.cameras and self.times_s[-1] < still_s < time_s:
            self.times_s.append(still_s)
            self.cameras.append(self.cameras[-1])
        if self.times_s and time_s <= self.times_s[-1]:
            return
        self.times_s.append(time_s)
        self.cameras.append(camera)
        self.still_s = time_s

    @property
    def seconds(self) -> float:
        """Duration from the first movement to the last."""
        return self.times_s[-1] - self.start_s if len(self.times_s) > 1 else 0.0

    @property
    def start_s(self) -> float:
        """Start of the first movement; the time before it is left out."""
        waited = len(self.cameras) > 1 and self.cameras[1] == self.cameras[0]
        return self.times_s[1] if waited else self.times_s[0]

    def path(self, name: str, smooth_s: float = SMOOTH_S) -> CameraPath | None:
        """The recorded path; None if nothing moved.

        Keys are `KEY_S` apart. Positions, lines of sight and fields of view are smoothed with a Gaussian of standard
        deviation `smooth_s`; the ends stay in place.
        """
        if self.seconds <= 0:
            return None
        count = max(1, round(self.seconds / KEY_S)) + 1
        times = np.linspace(0.0, self.seconds, count)
        at = np.array(self.times_s) - self.start_s
        values = np.array([(*camera.position, *camera.target, camera.fov_y_deg) for camera in self.cameras])
        even = np.stack([np.interp(times, at, column) for column in values.T], axis=-1)
        smooth = smoothed(even, smooth_s / (times[1] - times[0]))
        keys = tuple(Camera(name, triple(row[:3]), triple(row[3:6]), fov_y_deg=float(row[6])) for row in smooth)
        return CameraPath(name=name, keys=keys, seconds=float(times[-1]), times_s=tuple(map(float, times)))


@dataclass
class Recorder:
    """Records the camera while `on`; then `draft` can be smoothed and played until it is saved or discarded."""

    on: bool = False
    recording: Recording = field(default_factory=Recording)
    light: RecordedLight = field(default_factory=RecordedLight)
    draft: CameraPath | None = None
    smooth_s: float = SMOOTH_S
    began_s: float = 0.0
    name: str = ""
    suggested: str = ""  # the suggested name

    def begin(self, now_s: float) -> None:
        """Start to record; discard a draft."""
        self.drop()
        self.on, self.began_s = True, now_s

    def take(self, camera: Camera, now_s: float) -> bool:
        """Record the camera; return whether the recording has reached its longest duration."""
        if self.on:
            self.recording.take(camera, now_s - self.began_s)
        return self.on and now_s - self.began_s > LONGEST_S

    def stop(self) -> CameraPath | None:
        """End the recording and make a draft of it; None if nothing moved."""
        self.on = False
        self.smooth(self.smooth_s)
        return self.draft

    def smooth(self, smooth_s: float) -> None:
        """Smooth the draft again, with another `smooth_s`."""
        self.smooth_s, self.draft = smooth_s, self.recording.path(DRAFT, smooth_s)

    def drop(self) -> None:
        """Discard the draft."""
        self.recording, self.light, self.draft = Recording(), RecordedLight(), None

    @property
    def track(self) -> MixTrack | None:
        """The light of the draft over time; None if it was as baked."""
        return self.light.track(self.recording.start_s) if self.recording.times_s else None


@dataclass
class Recordings:
    """Saves views and camera paths."""

    views: SavedViews
    navigation: Navigation
    screen: Screen
    lights: Lights = field(default_factory=Lights)
    recorder: Recorder = field(default_factory=Recorder)
    view_name: str = ""  # typed for the next saved view
    written: dict[str, MixTrack | None] = field(default_factory=dict)  # light along paths saved by this window
    keying: bool = False  # light keys are being set: a paused path shows the mix, not its own light

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """Cameras of the scene, then saved cameras."""
        return self.views.all.cameras

    @property
    def paths(self) -> tuple[CameraPath, ...]:
        """Paths of the scene, saved paths, and the draft."""
        paths = self.views.all.paths
        return paths if self.recorder.draft is None else (*paths, self.recorder.draft)

    @property
    def light(self) -> dict[str, Triple]:
        """Factors of the light groups in the picture, from the played walk, else from the mix."""
        play = self.navigation.path
        keying = self.keying and play is not None and not play.playing
        track = None if play is None or keying else self.track_of(play.path)
        found = self.lights.mix.factors if track is None or play is None else track.factors_at(play.time_s)
        return self.lights.known(found)

    def track_of(self, path: CameraPath) -> MixTrack | None:
        """The light over time of a saved path or of the draft."""
        return self.recorder.track if path == self.recorder.draft else self.views.saved.tracks.get(path.name)

    def set_key(self) -> None:
        """Set the present mix as the path's light at the present time, as one step of undo."""
        play = self.navigation.path
        if play is None:
            return
        groups = [group.name for group in self.lights.groups]
        before = self.track_of(play.path)
        if self._light_path(play.path.name, before, with_key(before, play.time_s, self.lights.mix, groups)):
            self.screen.say(f"set the light of {play.path.name} at {play.time_s:.1f} s to the present mix")

    def drop_key(self, time_s: float) -> None:
        """Remove a key of the path's light, as one step of undo."""
        play = self.navigation.path
        track = None if play is None else self.track_of(play.path)
        if play is not None and track is not None:
            self._light_path(play.path.name, track, without_key(track, time_s))

    def _light_path(self, path: str, before: MixTrack | None, track: MixTrack | None) -> bool:
        """Save changed light along a path, as one step of undo; return whether it was saved."""
        if not self.views.set_track(path, track):
            return False
        self.lights.edits.light_path(path, before, track)
        self.written[path] = track
        return True

    def _follow_undo(self) -> None:
        """Save light along paths after undo or redo has changed it."""
        for path, track in self.lights.edits.tracks.items():
            if track == self.written.get(path):
                continue
            self.written[path] = track
            if path not in {one.name for one in self.paths}:
                self.screen.say(f"light not changed: there is no path {path}")
            elif self.views.set_track(path, track):
                keys = len(key_times(track))
                self.screen.say(f"restored {keys} light key{'' if keys == 1 else 's'} of {path}")

    def go_to_key(self, time_s: float) -> None:
        """Go to a key of the path's light and apply its mix, as one step of undo."""
        play = self.navigation.path
        track = None if play is None else self.track_of(play.path)
        if play is not None and track is not None:
            self.navigation.scrub(play.path, time_s)
            self.keying = True
            self.lights.edits.end_stroke()
            self.lights.mix = mix_at(track, time_s)
            self.lights.edits.end_stroke()

    def visit(self, camera: Camera) -> None:
        """Go to a camera of the list and apply its light mix, also if the camera is already there."""
        self.navigation.jump(camera)
        if camera in self.views.saved.cameras and camera.name in self.views.saved.lights:
            self.lights.edits.end_stroke()
            self.lights.mix = self.views.saved.lights[camera.name]
            self.lights.edits.end_stroke()

    def save_view(self) -> None:
        """Save the camera as a view, under the typed name or the next free one."""
        mix = self.lights.mix if self.lights.groups else None
        added = self.views.add(self.navigation.camera, self.view_name if self.view_name.strip() else None, mix)
        if added is not None:
            self.view_name, self.navigation.camera = "", added
            self.screen.say(f"saved the view {added.name}")

    def rename(self, kind: Kind, name: str) -> None:
        """Rename a saved camera or path to the typed name, and show it."""
        if self.views.rename(kind, name, self.views.typed_name):
            new, self.views.renaming = self.views.typed_name.strip(), None
            if kind == "camera":
                self.navigation.jump(replace(self.navigation.camera, name=new))
            else:
                self.navigation.scrub(next(path for path in self.views.saved.paths if path.name == new), 0.0)

    def delete(self, kind: Kind, name: str) -> None:
        """Delete a saved camera or path; the view stays where it is."""
        if self.views.delete(kind, name):
            self.navigation.path = None
            if kind == "camera":
                self.navigation.camera = replace(self.navigation.camera, name="free")
            self.screen.say(f"deleted the {'view' if kind == 'camera' else kind} {name}")

    def record(self) -> None:
        """Start to record the camera's path, or stop."""
        recorder, navigation = self.recorder, self.navigation
        if not recorder.on:
            if navigation.path is not None:
                navigation.path.playing = False
            recorder.begin(self.screen.clock())
        elif (draft := recorder.stop()) is not None:
            recorder.name = recorder.suggested = self.views.free_name("path")
            navigation.path = PathPlay(draft, draft.seconds, playing=False)  # selected and ready to play
            self.screen.say(f"recorded {draft.seconds:.1f} s")
        else:
            self.screen.say("nothing recorded: the camera did not move")

    def follow(self) -> None:
        """Record the camera of this frame; end a recording that is too long."""
        self._follow_undo()
        now_s = self.screen.clock()
        if self.recorder.on:
            self.recorder.light.take(self.lights.mix, now_s - self.recorder.began_s)
        if self.recorder.take(self.navigation.camera, now_s):
            self.record()

    def save(self) -> None:
        """Save the draft under the typed name; a suggested name may become the next free one."""
        recorder = self.recorder
        if recorder.draft is not None:
            name = None if recorder.name == recorder.suggested else recorder.name
            self._saved(self.views.add(recorder.draft, name, recorder.track))

    def _saved(self, added: CameraPath | None) -> None:
        if added is not None:
            self.recorder.drop()
            self.navigation.scrub(added, 0.0)
            self.screen.say(f"saved the path {added.name}")

    @property
    def unsaved(self) -> bool:
        """Whether there is an unsaved recording."""
        recorder = self.recorder
        return recorder.draft is not None or (recorder.on and recorder.recording.path(DRAFT) is not None)

    def keep(self) -> str | None:
        """Save an unsaved recording because the window closes; return the path's name."""
        if self.recorder.on:
            self.record()
        draft = self.recorder.draft
        if draft is None:
            return None
        typed = self.recorder.name if self.recorder.name.strip() not in ("", self.recorder.suggested) else None
        added = self.views.add(draft, typed, self.recorder.track)
        if added is None and typed is not None:  # the name is used or empty: save the walk under another
            added = self.views.add(draft, light=self.recorder.track)
        self._saved(added)
        return added.name if added is not None else None

    def rescue(self) -> tuple[str, ...]:
        """Save the recording in the store or, if that fails, in a separate file; yield the place."""
        name = self.keep()
        if name is not None:
            return (f"the store as {name!r}",)
        draft = self.recorder.draft
        if draft is None:
            return ()
        name = self.recorder.name.strip() or self.views.free_name("path")
        file = rescue_file(self.screen.folder, name)
        write_alone(file, replace(draft, name=name), self.recorder.track)
        return (f"{file}, a views.json for a store",)

    def drop(self) -> None:
        """Discard the draft or the present recording."""
        self.recorder.on = False
        path = self.navigation.path
        if path is not None and path.path == self.recorder.draft:
            self.navigation.path = None
        self.recorder.drop()


def smoothed(values: Floats, sigma: float) -> Floats:
    """Columns of (N, C), smoothed with a Gaussian of `sigma` rows; the first and last row stay.

    Beyond the ends the values are mirrored through the end point, so that a straight path stays straight.
    """
    reach = min(round(3 * sigma), len(values) - 1)
    if reach < 1:
        return values
    padded = np.pad(values, ((reach, reach), (0, 0)), mode="reflect", reflect_type="odd")
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    bell /= bell.sum()
    return np.stack([np.convolve(column, bell, mode="valid") for column in padded.T], axis=-1)
