"""Pictures that light scenes: reading any layout, and orientation in the world."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats, Image
from lambent.core.ceilings import PIXELS, SURROUNDINGS_PIXELS
from lambent.core.errors import UserError
from lambent.core.geometry.latlong import lat_long_uv
from lambent.core.pictures.environment_layouts import as_lat_long, layout_of
from lambent.core.pictures.images import read_image
from lambent.core.surroundings import Axis, Layout
from lambent.scenes.geometry import turn
from lambent.scenes.looks.textures import halved
from lambent.scenes.scene import ComputedEnvironment, ConstantEnvironment, Environment, ImageEnvironment
from lambent.scenes.sky.computed import lat_long_image

LEAST_ROWS, LEAST_COLUMNS = 4, 4  # of a lat-long picture: the path tracer interpolates between them
_UPRIGHT = np.eye(3)
# Minimal rotations from +y to an axis: columns are the images of +x, +y, +z. Upside down, front stays front.
_TURNS: dict[Axis, Floats] = {
    "+y": _UPRIGHT,
    "-y": np.diag([-1.0, -1.0, 1.0]),
    "+z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
    "-z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
    "+x": np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "-x": np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
}


def read_lat_long(file: Path, layout: Layout | None = None) -> Image:
    """(H, W, 3) float32 lat-long picture of a file in any layout, detected if `layout` is None.

    Negative values, which filters leave next to bright lamps, become black; so do single ones that are not numbers.
    Single infinite values become 65504, or the picture's largest value. Pixels of a picture with fewer than
    `LEAST_ROWS` or `LEAST_COLUMNS` are repeated.

    Raises
    ------
    UserError
        If the file is not a picture, or not of that layout, or its layout is ambiguous.
    """
    picture = read_surroundings(file)
    np.maximum(picture, 0, out=picture)
    picture = as_lat_long(picture, layout or layout_of(picture, file), file)
    rows, columns = (-(-least // n) for least, n in zip((LEAST_ROWS, LEAST_COLUMNS), picture.shape, strict=False))
    return picture if rows == columns == 1 else np.ascontiguousarray(picture.repeat(rows, 0).repeat(columns, 1))


def read_surroundings(file: Path) -> Image:
    """(H, W, 3) float32 picture of a file; means of 2x2 pixels of one that has more than `PIXELS`.

    Raises
    ------
    UserError
        If the file is not a picture, or has more than `SURROUNDINGS_PIXELS`.
    """
    picture = read_image(file, SURROUNDINGS_PIXELS, mend=True)
    return halved(picture) if picture.shape[0] * picture.shape[1] > PIXELS.most else picture


def up_turn(up: Axis) -> Floats:
    """(3, 3) rotation that takes +y, the up of a picture, to an axis of the world."""
    return _TURNS[up]


def orientation(environment: ImageEnvironment) -> Floats:
    """(3, 3) rotation from directions in an environment's picture to those in the world."""
    return up_turn(environment.up) @ turn("y", environment.rotation_deg)


def environment_picture(environment: Environment) -> Image:
    """(H, W, 3) lat-long picture of an environment, not rotated, scaled to its radiance.

    Raises
    ------
    UserError
        If it is daylight, which only a bake can compute, or its file cannot be read.
    """
    if isinstance(environment, ImageEnvironment):
        return read_lat_long(environment.file, environment.layout) * np.float32(environment.scale)
    if isinstance(environment, ComputedEnvironment):
        return lat_long_image(environment.name)
    if isinstance(environment, ConstantEnvironment):
        return np.full((2, 4, 3), environment.radiance, np.float32)
    hint = "bake the scene with it, or use a picture"
    raise UserError("daylight is computed only in a bake", field="environment", got="sunsky", hint=hint)


def seen_at(picture: Image, w: Floats) -> Image:
    """(..., 3) radiance of the texels of a lat-long picture (H, W, 3) in unit directions (..., 3)."""
    height, width = picture.shape[:2]
    column, row = lat_long_uv(w)
    at = np.minimum((row * height).astype(int), height - 1), (column * width).astype(int) % width
    return np.asarray(picture[at])
