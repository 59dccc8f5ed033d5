"""A bright texel at a known direction lands where it must, whatever the layout; layouts are told by their pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.cubemap import texel_solid_angles
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.latlong import lat_long_directions
from lambent.core.pictures.environment_layouts import as_lat_long, layout_of
from lambent.core.surroundings import Layout

N = 16  # texels of a face
FRONT, BACK, RIGHT, LEFT, TOP, BOTTOM = (0, 0, -1), (0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)

# By hand: (row, column) of a texel in units of a face, and the direction that the eye sees there from within.
# Corners tell a picture from its mirror image and from one that is turned.
CROSS_4_3 = [
    ((1.5, 1.5), FRONT), ((1.5, 2.5), RIGHT), ((1.5, 0.5), LEFT), ((0.5, 1.5), TOP), ((2.5, 1.5), BOTTOM),
    ((1.5, 3.5), BACK), ((1.25, 1.75), (0.5, 0.5, -1)), ((1.25, 2.75), (1, 0.5, 0.5)), ((1.25, 0.25), (-1, 0.5, 0.5)),
    ((0.25, 1.75), (0.5, 1, 0.5)), ((2.75, 1.75), (0.5, -1, 0.5)), ((1.25, 3.25), (0.5, 0.5, 1)),
]  # fmt: skip
CROSS_3_4 = [*CROSS_4_3[:5], *CROSS_4_3[6:11], ((3.5, 1.5), BACK), ((3.75, 1.75), (0.5, 0.5, 1))]
STRIP = [
    ((0.5, 0.5), RIGHT), ((0.5, 1.5), LEFT), ((0.5, 2.5), TOP), ((0.5, 3.5), BOTTOM), ((0.5, 4.5), FRONT),
    ((0.5, 5.5), BACK), ((0.25, 0.75), (1, 0.5, 0.5)), ((0.25, 1.25), (-1, 0.5, 0.5)), ((0.25, 2.75), (0.5, 1, 0.5)),
    ((0.75, 3.75), (0.5, -1, 0.5)), ((0.25, 4.75), (0.5, 0.5, -1)), ((0.25, 5.25), (0.5, 0.5, 1)),
]  # fmt: skip
COLUMN = [((5 * 0 + int(c) + r, c - int(c)), w) for (r, c), w in STRIP]
# (row, column) from -1 to 1 across the disc: half the radius is 90 degrees.
ANGULAR = [
    ((0, 0), FRONT), ((0, 0.5), RIGHT), ((0, -0.5), LEFT), ((-0.5, 0), TOP), ((0.5, 0), BOTTOM),
    ((0, 0.25), (1, 0, -1)), ((-0.25, 0), (0, 1, -1)), ((-0.75, 0), (0, 1, 1)), ((0, -0.75), (-1, 0, 1)),
]  # fmt: skip


def cases() -> list[tuple[Layout, tuple[int, int], tuple[float, float], tuple[float, ...]]]:
    shapes: list[tuple[Layout, tuple[int, int], list]] = [  # type: ignore[type-arg]
        ("cross", (3, 4), CROSS_4_3), ("cross", (4, 3), CROSS_3_4), ("strip", (1, 6), STRIP), ("strip", (6, 1), COLUMN),
    ]  # fmt: skip
    found = [(layout, (N * r, N * c), (y * N, x * N), w) for layout, (r, c), places in shapes for (y, x), w in places]
    size = 64
    found += [("angular", (size, size), ((1 + y) * size / 2, (1 + x) * size / 2), w) for (y, x), w in ANGULAR]
    return found  # type: ignore[return-value]


@pytest.mark.parametrize(("layout", "shape", "place", "expected"), cases())
def test_a_bright_spot_lands_in_its_direction(
    layout: Layout, shape: tuple[int, int], place: tuple[float, float], expected: tuple[float, ...]
) -> None:
    row, column = (round(x) for x in place)
    picture = np.zeros((*shape, 3), np.float32)
    picture[row - 1 : row + 1, column - 1 : column + 1] = 1
    found = as_lat_long(picture, layout)
    height, width = found.shape[:2]
    assert width == 2 * height >= 32
    w = lat_long_directions(height, width).reshape(-1, 3)
    light = found[..., 0].ravel() * np.hypot(w[:, 0], w[:, 2])
    towards = normalize(light @ w)
    assert light.sum() > 0
    assert np.degrees(np.arccos(towards @ normalize(np.array(expected, float)))) < 2.5


def test_even_light_stays_even_and_lamps_keep_their_light() -> None:
    """A lamp of one texel in a face of 16 has the light of its solid angle, within two hundredths."""
    for shape, layout in (((48, 64), "cross"), ((16, 96), "strip"), ((48, 48), "angular")):
        assert np.allclose(as_lat_long(np.ones((*shape, 3), np.float32), layout), 1, atol=1e-6)  # type: ignore[arg-type]
    picture = np.zeros((16, 96, 3), np.float32)
    picture[8, 8] = 100
    found = as_lat_long(picture, "strip")
    omega = np.repeat(-np.diff(np.cos(np.linspace(0, np.pi, len(found) + 1))), 2 * len(found)) * np.pi / len(found)
    assert found[..., 0].ravel() @ omega == pytest.approx(100 * texel_solid_angles(16)[8, 8], rel=0.02)


def filled(height: int, width: int) -> np.ndarray:
    return np.random.default_rng(1).random((height, width, 3)).astype(np.float32) + 0.1


def light_probe(size: int = 64) -> np.ndarray:
    x, y = np.meshgrid(*[(np.arange(size) + 0.5) / size * 2 - 1] * 2)
    return filled(size, size) * (np.hypot(x, y) < 1)[..., None].astype(np.float32)


def cross(rows: int, columns: int) -> np.ndarray:
    picture = filled(rows * N, columns * N)
    shown = {(1, 0), (1, 1), (1, 2), (0, 1), (2, 1), (1, 3) if columns == 4 else (3, 1)}
    for r in range(rows):
        for c in range(columns):
            if (r, c) not in shown:
                picture[r * N : (r + 1) * N, c * N : (c + 1) * N] = 0
    return picture


def test_layouts_are_recognised_by_their_pictures() -> None:
    assert layout_of(filled(32, 64)) == "lat-long"
    assert layout_of(filled(30, 64)) == "lat-long"
    assert layout_of(cross(3, 4)) == layout_of(cross(4, 3)) == "cross"
    assert layout_of(filled(48, 64)) == "lat-long", "a photograph has no black cells"
    assert layout_of(filled(16, 96)) == layout_of(filled(96, 16)) == "strip"
    probe = light_probe()
    assert layout_of(probe) == "angular"
    probe[-5:, -20:] = 1.0  # a caption
    assert layout_of(probe) == "angular"


def test_what_is_not_clear_is_an_error() -> None:
    with pytest.raises(UserError, match=r"sky\.hdr: layout: is ambiguous: .*square.*set layout"):
        layout_of(filled(32, 32) * np.linspace(1, 2, 32, dtype=np.float32)[:, None], Path("sky.hdr"))
    for layout, shape, expected in (("angular", (32, 64), "1:1"), ("cross", (32, 64), "4:3"), ("strip", (9, 9), "6:1")):
        with pytest.raises(UserError, match=expected):
            as_lat_long(filled(*shape), layout)  # type: ignore[arg-type]
