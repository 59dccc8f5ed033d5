"""Directions of lat-long images: where the axes lie, and there and back."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry.latlong import lat_long_direction, lat_long_directions, lat_long_uv


def test_pixels_are_where_they_say() -> None:
    w = lat_long_directions(6, 12)
    assert w.shape == (6, 12, 3) and np.allclose(np.linalg.norm(w, axis=-1), 1)
    column, row = lat_long_uv(w)
    np.testing.assert_allclose(column, np.broadcast_to((np.arange(12) + 0.5) / 12, (6, 12)), atol=1e-12)
    np.testing.assert_allclose(row, np.broadcast_to((np.arange(6)[:, None] + 0.5) / 6, (6, 12)), atol=1e-12)


@pytest.mark.parametrize(
    ("w", "column", "row"),
    [
        ((0, 0, -1), 0.5, 0.5),
        ((1, 0, 0), 0.75, 0.5),
        ((-1, 0, 0), 0.25, 0.5),
        ((0, 1, 0), None, 0),
        ((0, -1, 0), None, 1),
    ],
)
def test_axes(w: tuple[float, ...], column: float | None, row: float) -> None:
    """The middle column looks along -z, +x lies to its right, +y on top."""
    u, v = lat_long_uv(np.array(w, float))
    assert float(v) == pytest.approx(row) and (column is None or float(u) == pytest.approx(column))
    if column is not None:
        turn = 2 * np.pi * (column - 0.5)
        np.testing.assert_allclose(lat_long_direction(np.pi * row, turn), w, atol=1e-12)
