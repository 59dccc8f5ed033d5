"""Daubechies' wavelets: the published taps, orthonormality, vanishing moments."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baked.transport.wavelets import TAPS, transformed


def test_taps_are_the_published_ones() -> None:
    assert np.allclose(TAPS, [0.4829629131445341, 0.8365163037378077, 0.2241438680420134, -0.1294095225512603])


@pytest.mark.parametrize("length", [1, 2, 4, 8, 32, 256])
def test_transform_is_orthonormal(length: int) -> None:
    matrix = transformed(np.eye(length))
    assert np.allclose(matrix @ matrix.T, np.eye(length), atol=1e-13)


def test_first_step_by_hand() -> None:
    """A unit at the fourth of four values: its low passes end with d4 and begin, wrapped around, with d2."""
    d1, d2, d3, d4 = TAPS
    low = np.array([d4, d2])  # windows (0, 1, 2, 3) and (2, 3, 0, 1)
    high = np.array([-d1, -d3])
    mean, detail = low.sum() / np.sqrt(2), (low[0] - low[1]) / np.sqrt(2)
    assert np.allclose(transformed(np.eye(4)[3]), [mean, detail, *high])


def test_straight_lines_have_no_fine_details_away_from_the_wrap() -> None:
    finest = transformed(np.arange(64.0))[32:]
    assert np.allclose(finest[:-1], 0, atol=1e-12)
    assert abs(finest[-1]) > 1


def test_other_lengths_are_refused() -> None:
    with pytest.raises(ValueError, match="power of two"):
        transformed(np.zeros(48))
