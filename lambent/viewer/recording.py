"""A walk, recorded: what the camera did, when, made smooth, as a path that films and the window can follow."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lambent.core.camera import Camera, CameraPath

Floats = NDArray[np.floating]
KEY_S = 0.1  # between two keys of a path
STILL_S = 0.1  # a longer gap between two frames is standing still, not a slow frame
LONGEST_S = 600.0
SMOOTH_S = 0.3  # standard deviation of the bell that takes the jerks out


@dataclass
class Recording:
    """Cameras and their times in seconds, as they were drawn."""

    times_s: list[float] = field(default_factory=list)
    cameras: list[Camera] = field(default_factory=list)

    def take(self, camera: Camera, time_s: float) -> None:
        """The camera at this moment. Frames in which nothing moves need not be told of."""
        if self.cameras and camera == self.cameras[-1]:
            return
        if self.cameras and time_s - self.times_s[-1] > STILL_S:
            self.times_s.append(time_s - STILL_S / 2)
            self.cameras.append(self.cameras[-1])
        if self.times_s and time_s <= self.times_s[-1]:
            return
        self.times_s.append(time_s)
        self.cameras.append(camera)

    @property
    def seconds(self) -> float:
        """From the first movement to the last."""
        return self.times_s[-1] - self._start_s if len(self.times_s) > 1 else 0.0

    @property
    def _start_s(self) -> float:
        """When the first movement began: what was waited for before belongs to nobody's walk."""
        waited = len(self.cameras) > 1 and self.cameras[1] == self.cameras[0]
        return self.times_s[1] if waited else self.times_s[0]

    def path(self, name: str, smooth_s: float = SMOOTH_S) -> CameraPath | None:
        """The recorded way; None where nothing moved.

        Keys stand `KEY_S` apart. Positions, lines of sight and angles of view are averaged with a bell of standard
        deviation `smooth_s`; the ends stay where they were.
        """
        if self.seconds < 2 * KEY_S:
            return None
        count = round(self.seconds / KEY_S) + 1
        times = np.linspace(0.0, self.seconds, count)
        at = np.array(self.times_s) - self._start_s
        values = np.array([_numbers(camera) for camera in self.cameras])
        even = np.stack([np.interp(times, at, column) for column in values.T], axis=-1)
        smooth = smoothed(even, smooth_s / (times[1] - times[0]))
        keys = tuple(_camera(row, name) for row in smooth)
        return CameraPath(name=name, keys=keys, seconds=float(times[-1]), times_s=tuple(map(float, times)))


def smoothed(values: Floats, sigma: float) -> Floats:
    """Columns of (N, C), averaged with a bell of `sigma` rows; the first and last row stay.

    Beyond the ends the values go on mirrored through the end point, so that a straight way stays straight.
    """
    reach = min(round(3 * sigma), len(values) - 1)
    if reach < 1:
        return values
    before, after = 2 * values[0] - values[reach:0:-1], 2 * values[-1] - values[-2 : -reach - 2 : -1]
    padded = np.concatenate([before, values, after])
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    bell /= bell.sum()
    return np.stack([np.convolve(column, bell, mode="valid") for column in padded.T], axis=-1)


def _numbers(camera: Camera) -> tuple[float, ...]:
    return (*camera.position, *camera.target, camera.fov_y_deg)


def _camera(row: Floats, name: str) -> Camera:
    px, py, pz, tx, ty, tz, fov = map(float, row)
    return Camera(name=name, position=(px, py, pz), target=(tx, ty, tz), fov_y_deg=fov)
