"""Incremental pictures: the published example, exactness after enough frames, no drift."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.editing.incremental import IncrementalPicture
from lambent.editing.products import HostProducts, add_rows


def random_transport(bands: int = 64, pixels: int = 5000) -> np.ndarray:
    rng = np.random.default_rng(3)
    return (rng.random((bands, 3, pixels)) * rng.random((bands, 1, 1))).astype(np.float16)


def dense(transport: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    return np.einsum("jc,jcp->cp", coefficients, transport.astype(float))


def test_the_published_example() -> None:
    """Ben-Artzi 2007, table 7.1: T = (3, 5, 2), one multiplication a frame."""
    transport = np.array([3, 5, 2], np.float16).reshape(3, 1, 1)
    picture = IncrementalPicture(HostProducts(transport))
    shown, perfect = [], []
    for curve in ([4, 2, 1], [4, 3, 1], [4, 2, 0]):
        picture.want(np.array(curve, float)[:, None])
        picture.step(terms=1)
        shown.append(picture.picture.item())
        perfect.append(float(dense(transport, picture.wanted).item()))
    assert perfect == [24, 29, 22]
    assert shown == [12, 27, 22]
    assert picture.is_exact


@pytest.mark.parametrize("pixels", [1, 7, 2048, 5001])
def test_sum_of_rows_is_numpys(pixels: int) -> None:
    transport = random_transport(16, pixels)
    transport[3] *= np.float16(-1e-7)  # subnormal halves
    rows, weights = np.array([3, 0, 15]), np.random.default_rng(4).normal(size=(3, 3))
    picture = np.ones((3, pixels), np.float32)
    add_rows(picture, transport, rows, weights)
    assert np.allclose(picture, 1 + np.einsum("kc,kcp->cp", weights, transport[rows].astype(float)), atol=1e-6)


def test_frames_finish_a_large_edit() -> None:
    transport = random_transport()
    picture = IncrementalPicture(HostProducts(transport))
    picture.want(np.random.default_rng(5).normal(size=(64, 3)))
    errors = []
    for _ in range(3):
        assert not picture.is_exact
        picture.step(terms=30)
        errors.append(np.abs(picture.picture - dense(transport, picture.wanted)).max())
    assert picture.is_exact
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-5
