"""Navigation: the camera, how it moves, and the played camera path."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from lambent.core.views.camera import Camera, CameraPath, overview
from lambent.scenes.camera_paths import camera_at
from lambent.store.contract import SceneRecord
from lambent.viewer.cameras import cameras

Movement = Literal["orbit", "walk"]


@dataclass
class PathPlay:
    """The camera path being shown."""

    path: CameraPath
    time_s: float = 0.0
    playing: bool = True


@dataclass
class Navigation:
    """The camera within `bounds` of the scene, in metres."""

    camera: Camera
    bounds: cameras.Bounds
    movement: Movement
    flying: bool = False
    path: PathPlay | None = None

    def __post_init__(self) -> None:
        self.walker = cameras.Walker.of(self.bounds)

    @classmethod
    def of(cls, scene: SceneRecord, movement: Movement) -> Navigation:
        """Start at the scene's first camera, or at one that sees the whole scene."""
        camera = scene.cameras[0] if scene.cameras else overview(*scene.bounds)
        return cls(camera, scene.bounds, movement)

    def jump(self, camera: Camera) -> None:
        self.camera, self.path = camera, None

    def move(self, camera: Camera) -> None:
        """Set the camera moved by the user, and leave a shown path."""
        if camera != self.camera:
            self.jump(camera)

    def set_fov(self, fov_y_deg: float) -> None:
        self.move(replace(self.camera, name="free", fov_y_deg=fov_y_deg))

    def set_eye_height(self, eye_height_m: float) -> None:
        """Set the walker's eye height, and raise or lower a standing camera."""
        lift_m = eye_height_m - self.walker.eye_height_m
        self.walker.eye_height_m = eye_height_m
        if self.movement == "walk" and not self.flying and lift_m:
            self.move(cameras.lifted(self.camera, lift_m))

    @property
    def playing(self) -> bool:
        return self.path is not None and self.path.playing

    def play(self, dt_s: float) -> None:
        """Advance a playing path; it stops at its end."""
        if self.path is None or not self.path.playing:
            return
        self.path.time_s = min(self.path.time_s + dt_s, self.path.path.seconds)
        self.path.playing = self.path.time_s < self.path.path.seconds
        self.camera = camera_at(self.path.path, self.path.time_s)

    def scrub(self, path: CameraPath, time_s: float) -> None:
        """Go to the camera of `path` at `time_s`."""
        self.path, self.camera = PathPlay(path, time_s, playing=False), camera_at(path, time_s)

    def toggle(self, path: CameraPath) -> None:
        """Pause a playing path, or play a paused one, from the start if it has ended."""
        if self.path is None or self.path.path != path or self.path.time_s >= path.seconds:
            self.path = PathPlay(path)
        else:
            self.path.playing = not self.path.playing
