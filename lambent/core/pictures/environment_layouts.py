"""Convert pictures of the surroundings from the layouts that tools write to lat-long (`core.geometry.latlong`).

Every layout shows the surroundings from within, unmirrored: front -z, right +x, top +y.

    lat-long   the middle column is front, the top row top
    angular    light probe (Debevec 1998): the centre is front, the angle from it grows with the radius, to 180 degrees
               at the rim of the disc; right and top as in the picture
    cross      six faces of a cube unfolded. 4:3: left, front, right, back in a row, top and bottom above and below the
               front. 3:4: the back below the bottom instead, turned by 180 degrees
    strip      right, left, top, bottom, front, back in a row or in a column: +x, -x, +y, -y, +z, -z of OpenGL and
               Direct3D, whose cube maps are left-handed, so that their +z is our front
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from lambent.core.arrays import Flags, Floats, Image
from lambent.core.errors import UserError
from lambent.core.geometry import cubemap
from lambent.core.geometry.latlong import lat_long_directions
from lambent.core.surroundings import Layout

DARK, MOSTLY = 1e-3, 0.75  # black, relative to the mean; share of unused pixels that are (captions are not)
MOST_ROWS, SAMPLES = 4096, 3  # of a resampled picture; samples per pixel and axis
ROWS_AT_ONCE = 64
LEFT_HANDED = np.array([1.0, 1.0, -1.0])
# Cells (row, column) of +x, -x, +y, -y, +z, -z in crosses of 3 rows by 4 columns, and of 4 by 3.
CELLS = {
    (3, 4): ((1, 2), (1, 0), (0, 1), (2, 1), (1, 1), (1, 3)),
    (4, 3): ((1, 2), (1, 0), (0, 1), (2, 1), (1, 1), (3, 1)),
}
HINT = 'set layout = "lat-long", "angular", "cross" or "strip"'


def layout_of(picture: Image, file: Path | None = None) -> Layout:
    """Detect the layout of a picture (H, W, 3) from its proportions and its black regions.

    1:6 and 6:1 are strips; 3:4 and 4:3 are crosses if the empty cells are black; squares are angular maps if the
    corners are black; everything else is lat-long, squares of one colour as well.

    Raises
    ------
    UserError
        If a square picture of several colours is not an angular map.
    """
    height, width = picture.shape[:2]
    if height == 6 * width or width == 6 * height:
        return "strip"
    if (shape := _cross(height, width)) and _is_black(picture, _empty(height, width, shape)):
        return "cross"
    if height != width or (picture == picture[0, 0]).all():
        return "lat-long"
    x, y = np.meshgrid(*[(np.arange(width) + 0.5) / width * 2 - 1] * 2)
    if not _is_black(picture, np.hypot(x, y) > 1 + 2 / width):
        what = "is ambiguous: the picture is square, but its corners are not black as in an angular map"
        raise UserError(what, file=file, field="layout", got=f"{width} x {height}", hint=HINT)
    return "angular"


def as_lat_long(picture: Image, layout: Layout, file: Path | None = None) -> Image:
    """Resample a picture (H, W, 3) to lat-long at about its own resolution; lat-long pictures are returned unchanged.

    Raises
    ------
    UserError
        If the proportions do not fit the layout.
    """
    height, width = picture.shape[:2]
    if layout == "lat-long":
        return picture
    if layout == "angular":
        _check(height == width, layout, "1:1", picture, file)
        return _resampled(lambda w: _angular(picture, w), height)
    if layout == "strip":
        _check(height == 6 * width or width == 6 * height, layout, "6:1 or 1:6", picture, file)
        faces = np.stack(np.split(picture, 6, axis=0 if height > width else 1))
    else:
        shape = _cross(height, width)
        _check(shape is not None, layout, "4:3 or 3:4", picture, file)
        assert shape is not None
        n = height // shape[0]
        faces = np.stack([picture[r * n : (r + 1) * n, c * n : (c + 1) * n] for r, c in CELLS[shape]])
        if shape == (4, 3):
            faces[5] = faces[5, ::-1, ::-1]
    return _resampled(lambda w: cubemap.sample(faces, w * LEFT_HANDED), 2 * faces.shape[1])


def _check(fits: bool, layout: str, expected: str, picture: Image, file: Path | None) -> None:
    if not fits:
        got = f"{picture.shape[1]} x {picture.shape[0]}"
        raise UserError(
            f"picture does not have the proportions of layout {layout}", file=file, got=got, expected=expected
        )


def _cross(height: int, width: int) -> tuple[int, int] | None:
    fits = [shape for shape in CELLS if height % shape[0] == 0 and height // shape[0] * shape[1] == width]
    return fits[0] if fits else None


def _empty(height: int, width: int, shape: tuple[int, int]) -> Flags:
    """(H, W) bool: the empty cells of a cross."""
    cells = np.ones(shape, bool)
    cells[tuple(np.transpose(CELLS[shape]))] = False
    return np.repeat(np.repeat(cells, height // shape[0], axis=0), width // shape[1], axis=1)


def _is_black(picture: Image, where: Flags) -> bool:
    light = picture.mean(axis=-1)
    used = float(light[~where].mean()) if (~where).any() else 0.0
    return bool(where.any() and used > 0 and np.mean(light[where] <= DARK * used) >= MOSTLY)


def _angular(picture: Image, w: Floats) -> Floats:
    """Bilinear look-up (..., 3) of an angular map at unit directions (..., 3)."""
    n = len(picture)
    across = np.hypot(w[..., 0], w[..., 1])
    radius = np.minimum(np.arctan2(across, -w[..., 2]) / np.pi, 1 - 2.0 / n)  # beyond the rim the picture is black
    scale = radius / np.maximum(across, 1e-12)
    column, row = ((1 + w[..., 0] * scale) / 2 * n - 0.5), ((1 - w[..., 1] * scale) / 2 * n - 0.5)
    c0, r0 = (np.clip(np.floor(x).astype(int), 0, n - 2) for x in (column, row))
    fc, fr = (column - c0)[..., None], (row - r0)[..., None]
    top = picture[r0, c0] * (1 - fc) + picture[r0, c0 + 1] * fc
    bottom = picture[r0 + 1, c0] * (1 - fc) + picture[r0 + 1, c0 + 1] * fc
    return np.asarray(top * (1 - fr) + bottom * fr)


def _resampled(look_up: Callable[[Floats], Floats], rows: int) -> Image:
    rows = min(max(rows, 2), MOST_ROWS)
    found = np.empty((rows, 2 * rows, 3), np.float32)
    for top in range(0, rows, ROWS_AT_ONCE):
        part = slice(top, min(top + ROWS_AT_ONCE, rows))
        fine = lat_long_directions(rows * SAMPLES, 2 * rows * SAMPLES, slice(part.start * SAMPLES, part.stop * SAMPLES))
        values = look_up(fine).reshape(part.stop - part.start, SAMPLES, 2 * rows, SAMPLES, 3)
        found[part] = values.mean(axis=(1, 3))
    return found
