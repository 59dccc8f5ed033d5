"""Images in projections that no pinhole camera has, from pinhole pictures of a cube's faces around the eye."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.ndimage import map_coordinates

from lambent.core.arrays import Floats
from lambent.core.camera import Camera, camera_axes
from lambent.core.plain import triple
from lambent.core.progress import Progress, part_of, silent
from lambent.core.projections import Projection, View
from lambent.render.images import Images, Settings

RIM_PX = 2  # of a face beyond 45 degrees, so that look-ups at its border blend with what is next to it
SUBSAMPLES = 2  # look-ups along each side of a pixel
MOST_FACE_PX = 4096
# Forward and up of the faces in the camera's right, up and forward.
_FACES = (((0, 0, 1), (0, 1, 0)), ((1, 0, 0), (0, 1, 0)), ((-1, 0, 0), (0, 1, 0)), ((0, 0, -1), (0, 1, 0)),
          ((0, 1, 0), (0, 0, -1)), ((0, -1, 0), (0, 0, 1)))  # fmt: skip


def faces_settings(settings: Settings) -> Settings:
    """Settings of the renderer that draws the faces: as fine in their middle as the picture in its own."""
    if settings.projection is Projection.perspective:
        return settings
    view = View.of(Camera("", (0, 0, 0), (0, 0, -1)), *_of(settings))
    wide = math.radians(view.width_deg)
    across = 2 * math.sin(wide / 2) if settings.projection is Projection.hemispherical else wide
    side = int(np.clip(math.ceil(2 * settings.width / across), 16, MOST_FACE_PX)) + 2 * RIM_PX
    return replace(settings, width=side, height=side, projection=Projection.perspective, field_deg=None)


def _of(settings: Settings) -> tuple[Projection, int, int, float | None]:
    return settings.projection, settings.width, settings.height, settings.field_deg


class Projected(Images):
    """Images from faces that another renderer draws, whose settings are `faces_settings`."""

    def __init__(self, faces: Images, settings: Settings) -> None:
        super().__init__(settings)
        self.quantity, self._faces = faces.quantity, faces

    def radiance(self, camera: Camera, progress: Progress = silent) -> Floats:
        width, height = self.settings.width, self.settings.height
        rays, _ = View.of(camera, *_of(self.settings)).directions(width * SUBSAMPLES, height * SUBSAMPLES)
        cameras = _face_cameras(camera, self._faces.settings.width)
        nearest = np.argmax([rays @ camera_axes(face)[2] for face in cameras], axis=0)
        found = np.zeros(rays.shape, np.float32)
        for number, face in enumerate(cameras):
            mine = (nearest == number) & rays.any(axis=-1)
            if mine.any():
                part = part_of(progress, number / len(cameras), (number + 1) / len(cameras), "faces around the eye")
                found[mine] = _looked_up(self._faces.radiance(face, part), face, rays[mine])
        return np.asarray(found.reshape(height, SUBSAMPLES, width, SUBSAMPLES, 3).mean(axis=(1, 3)))


def _face_cameras(camera: Camera, side_px: int) -> list[Camera]:
    """Cameras of the six faces, the one ahead first."""
    axes, half = np.stack(camera_axes(camera)), side_px / 2
    fov_deg = 2 * math.degrees(math.atan(half / (half - RIM_PX)))
    eye = np.asarray(camera.position, float)
    return [Camera(camera.name, camera.position, triple(eye + ahead @ axes), triple(up @ axes), fov_deg)
            for ahead, up in np.array(_FACES, float)]  # fmt: skip


def _looked_up(picture: Floats, camera: Camera, rays: Floats) -> Floats:
    """(..., 3) of a square picture along rays (..., 3), between its pixels."""
    right, up, forward = camera_axes(camera)
    over = 1 / (math.tan(math.radians(camera.fov_y_deg) / 2) * (rays @ forward))
    places = np.stack([1 - (rays @ up) * over, 1 + (rays @ right) * over]) * (len(picture) / 2) - 0.5
    return np.stack([map_coordinates(picture[..., c], places, order=1, mode="nearest") for c in range(3)], axis=-1)
