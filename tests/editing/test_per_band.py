"""Per-band incremental pictures: better than either way alone, and exact in the end."""

from __future__ import annotations

import numpy as np

from lambent.core.wavelets import levels, transformed
from lambent.editing.incremental import IncrementalPicture
from lambent.editing.per_band import PerBandPicture

BANDS = 64


def transport() -> np.ndarray:
    return np.random.default_rng(1).random((BANDS, 1, 200)).astype(np.float16)


def checkerboard(shift: int) -> np.ndarray:
    """A smooth ramp under a checkerboard of bands: one step aside changes every finest wavelet and no other."""
    j = np.arange(BANDS)
    return (3 + np.sin(2 * np.pi * j / BANDS) + 0.5 * (-1.0) ** (j + shift))[:, None]


def test_a_moving_checkerboard_is_drawn_anew_where_it_moves() -> None:
    per_band, plain = PerBandPicture(transport(), levels(BANDS)), IncrementalPicture(transport())
    for picture in (per_band, plain):
        picture.want(transformed(checkerboard(0)))
        while not picture.is_exact:
            picture.step()
        picture.want(transformed(checkerboard(1)))
        picture.step(terms=10)
    wanted = transformed(checkerboard(1))
    error = [float(np.sum((p.effective - wanted) ** 2)) for p in (per_band, plain)]
    assert error[0] < 0.45 * error[1]


def test_frames_end_exact() -> None:
    picture = PerBandPicture(transport(), levels(BANDS))
    curve = transformed(np.random.default_rng(2).normal(size=(BANDS, 1)))
    picture.want(curve)
    frames = 0
    while not picture.is_exact:
        picture.step(terms=10)
        frames += 1
    assert frames <= 7
    truth = np.einsum("jc,jcp->cp", curve, transport().astype(float))
    assert np.allclose(picture.picture, truth, atol=1e-5)


def test_small_edits_stay_incremental() -> None:
    picture = PerBandPicture(transport(), levels(BANDS))
    curve = np.ones((BANDS, 1)) + transformed(np.random.default_rng(3).normal(size=(BANDS, 1)))
    picture.want(curve)
    while not picture.is_exact:
        picture.step()
    curve[40] += 5
    picture.want(curve)
    picture.step(terms=1)
    assert picture.is_exact
