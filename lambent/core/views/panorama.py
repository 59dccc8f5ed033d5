"""A panorama around the eye, assembled from pinhole pictures of a cube's faces."""

from __future__ import annotations

import math

import numpy as np
import scipy

from lambent.core.arrays import Floats
from lambent.core.plain import triple
from lambent.core.views.camera import Camera, camera_axes
from lambent.core.views.projections import Projection, View

RIM_PX = 2  # beyond 45 degrees on each face, so that look-ups near its border interpolate
SUBSAMPLES = 2  # look-ups along each side of a pixel
MOST_FACE_PX = 4096
# Forward and up axis of each face in the camera's (right, up, forward) coordinates; the face ahead comes first.
_FACES = (((0, 0, 1), (0, 1, 0)), ((1, 0, 0), (0, 1, 0)), ((-1, 0, 0), (0, 1, 0)), ((0, 0, -1), (0, 1, 0)),
          ((0, 1, 0), (0, 0, -1)), ((0, -1, 0), (0, 0, 1)))  # fmt: skip


def face_px(view: View, width: int) -> int:
    """Pixels along a face, rim included: as fine at its centre as the centre of a picture of this width."""
    wide = math.radians(view.width_deg)
    across = 2 * math.sin(wide / 2) if view.projection is Projection.hemispherical else wide
    return int(np.clip(math.ceil(2 * width / across), 16, MOST_FACE_PX)) + 2 * RIM_PX


class Panorama:
    """A panorama that is filled face by face.

    Attributes
    ----------
    cameras : list of Camera
        One per face that the view shows, each for a square picture of `side_px` pixels.
    """

    def __init__(self, view: View, width: int, height: int) -> None:
        self.side_px = face_px(view, width)
        rays, _ = view.directions(width * SUBSAMPLES, height * SUBSAMPLES)
        faces = _face_cameras(view.camera, self.side_px)
        self._rays, self._found = rays, np.zeros(rays.shape, np.float32)
        self._nearest = np.where(rays.any(axis=-1), np.argmax([rays @ camera_axes(f)[2] for f in faces], axis=0), -1)
        self._numbers = [number for number in range(len(faces)) if (self._nearest == number).any()]
        self.cameras = [faces[number] for number in self._numbers]

    def fill(self, index: int, picture: Floats) -> None:
        """Store the picture (side_px, side_px, 3) of `cameras[index]`."""
        mine = self._nearest == self._numbers[index]
        self._found[mine] = _looked_up(picture, self.cameras[index], self._rays[mine])

    def image(self) -> Floats:
        """The panorama (height, width, 3); 0 outside the view."""
        height, width = (n // SUBSAMPLES for n in self._rays.shape[:2])
        return np.asarray(self._found.reshape(height, SUBSAMPLES, width, SUBSAMPLES, 3).mean(axis=(1, 3)))


def _face_cameras(camera: Camera, side_px: int) -> list[Camera]:
    axes, half = np.stack(camera_axes(camera)), side_px / 2
    fov_deg = 2 * math.degrees(math.atan(half / (half - RIM_PX)))
    eye = np.asarray(camera.position, float)
    return [Camera(camera.name, camera.position, triple(eye + ahead @ axes), triple(up @ axes), fov_deg)
            for ahead, up in np.array(_FACES, float)]  # fmt: skip


def _looked_up(picture: Floats, camera: Camera, rays: Floats) -> Floats:
    """Bilinear look-up (..., 3) of a square picture along rays (..., 3)."""

    right, up, forward = camera_axes(camera)
    over = 1 / (math.tan(math.radians(camera.fov_y_deg) / 2) * (rays @ forward))
    places = np.stack([1 - (rays @ up) * over, 1 + (rays @ right) * over]) * (len(picture) / 2) - 0.5
    return np.stack(
        [scipy.ndimage.map_coordinates(picture[..., c], places, order=1, mode="nearest") for c in range(3)], axis=-1
    )
