"""Projections beyond the pinhole camera: fisheyes and a cylinder around a camera's eye, and their Radiance options.

A picture point is (x, y) in [-1, 1], x to the right, y upwards. Directions are in the camera's own axes: right, up,
forward. Sources: G. Ward, "The RADIANCE lighting simulation and rendering system" (1994); view types of Radiance's
rpict, whose options are in the VIEW line of its pictures.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.geometry.directions import normalize
from lambent.core.plain import triple
from lambent.core.views.camera import Camera, camera_axes


class Projection(StrEnum):
    """Mapping of directions to the picture."""

    perspective = "perspective"
    fisheye = "fisheye"  # angle from the view direction is proportional to the distance from the centre
    hemispherical = "hemispherical"  # its sine is: picture area is projected solid angle
    cylinder = "cylinder"  # angle around the up axis is proportional to x, height as in perspective


MOST_DEG: Mapping[Projection, float] = {
    Projection.perspective: 170.0,
    Projection.fisheye: 360.0,
    Projection.hemispherical: 180.0,
    Projection.cylinder: 360.0,
}
RADIANCE = {
    Projection.perspective: "v",
    Projection.fisheye: "a",
    Projection.hemispherical: "h",
    Projection.cylinder: "c",
}


@dataclass(frozen=True)
class View:
    """A picture's projection around a camera's eye.

    Attributes
    ----------
    width_deg : float
        Field of view from edge to edge. A fisheye's circle touches both edges of the picture.
    height_deg : float
        Vertical field of view: equals `width_deg` for a fisheye; for a cylinder, as in a perspective picture.
    """

    camera: Camera
    projection: Projection
    width_deg: float
    height_deg: float

    def check(self) -> None:
        """Raise `UserError` if a field of view is out of range."""
        most = MOST_DEG[self.projection]
        upwards = most if self.projection is not Projection.cylinder else 170.0
        for found, limit in ((self.width_deg, most), (self.height_deg, upwards)):
            if not 0 < found <= limit:
                raise UserError(
                    f"field of view is out of range for {self.projection}", got=found, expected=f"above 0, to {limit:g}"
                )

    def directions(self, width: int, height: int) -> tuple[Floats, Floats]:
        """World directions (H, W, 3), 0 outside the view, and solid angles (H, W) in sr of the pixels."""
        x, y = np.meshgrid(2 * (np.arange(width) + 0.5) / width - 1, 1 - 2 * (np.arange(height) + 0.5) / height)
        local, density = self._local(x, y)
        axes = np.stack(camera_axes(self.camera))
        return local @ axes, density * (4.0 / (width * height))

    def _local(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Directions (..., 3) as (right, up, forward), and solid angle per unit of picture area (...)."""
        half_x, half_y = (math.radians(angle) / 2 for angle in (self.width_deg, self.height_deg))
        if self.projection is Projection.perspective:
            u, v = x * math.tan(half_x), y * math.tan(half_y)
            return normalize(np.stack([u, v, np.ones_like(u)], axis=-1)), math.tan(half_x) * math.tan(half_y) / (
                1 + u * u + v * v
            ) ** 1.5
        if self.projection is Projection.cylinder:
            around, v = x * half_x, y * math.tan(half_y)
            rays = np.stack([np.sin(around), v, np.cos(around)], axis=-1)
            return normalize(rays), half_x * math.tan(half_y) / (1 + v * v) ** 1.5
        fisheye = self.projection is Projection.fisheye
        u, v = (x * half_x, y * half_y) if fisheye else (x * math.sin(half_x), y * math.sin(half_y))
        r = np.hypot(u, v)
        inside = r <= (max(half_x, half_y) if fisheye else max(math.sin(half_x), math.sin(half_y)))
        theta = r if fisheye else np.arcsin(np.minimum(r, 1))
        over = np.sin(theta) / np.maximum(r, 1e-12)
        rays = np.stack([u * over, v * over, np.cos(theta)], axis=-1)
        # dw = sin(theta) dtheta dphi over r dr dphi; at the edge of the hemispherical view cos(theta) is 0.
        density = (
            half_x * half_y * over if fisheye else math.sin(half_x) * math.sin(half_y) / np.maximum(np.cos(theta), 1e-3)
        )
        return rays * inside[..., None], density * inside

    def radiance_options(self) -> str:
        """The options for the VIEW line."""
        _, up, forward = camera_axes(self.camera)
        places = ((" -vp", self.camera.position), (" -vd", triple(forward)), (" -vu", triple(up)))
        text = f"-vt{RADIANCE[self.projection]}" + "".join(
            option + "".join(f" {value:.7g}" for value in place) for option, place in places
        )
        return f"{text} -vh {self.width_deg:.7g} -vv {self.height_deg:.7g} -vo 0 -va 0 -vs 0 -vl 0"

    @classmethod
    def of(
        cls, camera: Camera, projection: Projection, width: int, height: int, field_deg: float | None = None
    ) -> View:
        """View for a picture of `width` x `height` with square pixels at its centre.

        `field_deg` is the field of view across the width. Default: 180 for fisheyes, 360 for a cylinder, the camera's
        own for perspective.
        """
        shape = height / width
        if projection is Projection.perspective:
            tangent = math.tan(math.radians(camera.fov_y_deg) / 2)
            found = cls(camera, projection, _twice_atan_deg(tangent / shape), camera.fov_y_deg)
            return found if field_deg is None else cls(camera, projection, field_deg, _taller_deg(field_deg, shape))
        if projection is Projection.cylinder:
            wide = 360.0 if field_deg is None else field_deg
            return cls(camera, projection, wide, _twice_atan_deg(math.radians(wide) / 2 * shape))
        if width != height:
            raise UserError(
                "a fisheye picture must be square", field="--size", got=f"{width}x{height}", expected=f"{width}x{width}"
            )
        wide = 180.0 if field_deg is None else field_deg
        return cls(camera, projection, wide, wide)


def _twice_atan_deg(tangent: float) -> float:
    return 2 * math.degrees(math.atan(tangent))


def _taller_deg(wide_deg: float, shape: float) -> float:
    return _twice_atan_deg(math.tan(math.radians(wide_deg) / 2) * shape)
