"""Switching curves, and incremental pictures over the folded transport: exact after enough frames."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baked.shared_exponent import packed_rgb, unpacked_rgb
from lambent.baked.transport.wavelets import transformed
from lambent.editing.folding import folded
from lambent.editing.incremental import IncrementalPicture
from lambent.editing.interreflection.entries import Cells, Entries, TermLight, rows
from lambent.editing.products import HostProducts, add_rows

Sparse = tuple[np.ndarray, np.ndarray, np.ndarray]


def sparse(points: int, bands: tuple[int, int], per_point: int, seed: int = 0) -> Sparse:
    """Spans, steps and values of random transport; spans leave gaps, and the last point has none."""
    rng = np.random.default_rng(seed)
    counts = rng.integers(per_point // 2, per_point + 1, points)
    counts[-1] = 0
    begin = np.concatenate([[0], np.cumsum(counts + 3)[:-1]])
    entries = int(begin[-1]) + 3
    steps = rng.integers(0, bands[0] * bands[1] // per_point + 1, entries).astype(np.uint8)
    steps[begin] = 1
    values = packed_rgb(rng.random((entries, 3), np.float32))
    return np.stack([begin, begin + counts], axis=1).astype(np.uint32), steps, values


def matrix(transport: Sparse, bands: tuple[int, int]) -> np.ndarray:
    """(P, J, K, 3) of the same."""
    spans, steps, values = transport
    whole = np.zeros((len(spans), *bands, 3))
    for p, (begin, end) in enumerate(spans):
        np.add.at(
            whole[p], np.divmod(np.cumsum(steps[begin:end].astype(int)) - 1, bands[1]), unpacked_rgb(values[begin:end])
        )
    return whole


@pytest.mark.long
@pytest.mark.parametrize("bands", [(16, 8), (8, 64), (256, 4)])
@pytest.mark.parametrize("edited", [0, 1])
def test_folding_is_the_product_with_the_idle_curve(bands: tuple[int, int], edited: int) -> None:
    transport = sparse(70, bands, 90)
    idle = np.random.default_rng(1).uniform(0, 3e4, (bands[1 - edited], 3))
    rows, scale = folded(*transport, idle, edited, bands[edited])
    product = np.einsum("pjkc,kc->jcp" if edited == 0 else "pjkc,jc->kcp", matrix(transport, bands), idle)
    expected = transformed(product)
    assert rows.shape == (bands[edited], 3, 70)
    assert np.abs(rows.astype(float) * scale - expected).max() < 2e-3 * np.abs(expected).max()
    assert not rows[..., -1].any()


def test_pictures_do_not_depend_on_the_curve_that_is_edited() -> None:
    bands, rng = (32, 16), np.random.default_rng(2)
    transport, curves = sparse(50, bands, 100), [rng.random((n, 3)) for n in bands]
    pictures = []
    for edited in (0, 1):
        rows, scale = folded(*transport, curves[1 - edited], edited, bands[edited])
        incremental = IncrementalPicture(HostProducts(rows))
        incremental.want(transformed(curves[edited] * scale))
        incremental.draw()
        pictures.append(incremental.picture)
    expected = np.einsum("pjkc,jc,kc->cp", matrix(transport, bands), *curves)
    assert np.allclose(pictures[0], expected, rtol=2e-3)
    assert np.allclose(pictures[0], pictures[1], rtol=2e-3)


def test_curves_without_light_give_none() -> None:
    rows, scale = folded(*sparse(5, (8, 8), 9), np.zeros((8, 3)), 0, 8)
    assert scale == 1.0
    assert not rows.any()


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


def tile(points: int, numbers: int, share: float, seed: int) -> Entries:
    """Random entries; some points have none."""
    rng = np.random.default_rng(seed)
    point, code = np.nonzero(rng.random((points, numbers)) < share * (rng.random((points, 1)) > 0.2))
    values = packed_rgb(rng.random((len(code), 3)).astype(np.float32) + 0.1)
    return np.bincount(point, minlength=points).astype(np.uint32), code.astype(np.uint32), values


@pytest.mark.parametrize(
    ("numbers", "share", "width"), [(64, 0.5, 1), (4096, 0.02, 1), (1 << 18, 1e-4, 2), (1 << 18, 0.0, 1)]
)
def test_entries_come_back(numbers: int, share: float, width: int) -> None:
    """Dense ones with a byte, sparse ones with two, and with gaps that neither holds."""
    tiles = [tile(9, numbers, 0.0, 0), tile(30, numbers, share, 1), tile(7, numbers, share / 3, 2)]
    units = np.ones(46, np.float32)
    light = TermLight.of_tiles(iter(tiles), units, (4, 2))
    given = light.values != 0
    assert light.steps.nbytes == width * len(light.values)
    assert np.array_equal(light.codes[given], np.concatenate([codes for _, codes, _ in tiles]))
    assert np.array_equal(light.values[given], np.concatenate([values for *_, values in tiles]))
    point = np.repeat(np.arange(46), np.diff(light.ends))[given]
    assert np.array_equal(np.bincount(point, minlength=46), np.concatenate([each for each, *_ in tiles]))
    assert np.array_equal(light.met, np.unique(light.codes[given] // 8))


@pytest.mark.parametrize("channel", range(3))
def test_the_first_number_may_be_far_too(channel: int) -> None:
    """The largest sum of a point's entries is that of its brightest channel."""
    values = packed_rgb(np.eye(3, dtype=np.float32)[[channel] * 3])
    far: Entries = np.array([1, 0, 2]), np.array([255, 256, 1023], np.uint32), values
    light = TermLight.of_tiles([far], np.array([1, 1, 4], np.float32), ())
    assert light.codes[light.values != 0].tolist() == [255, 256, 1023]
    assert light.largest == 8


@pytest.mark.long
@pytest.mark.parametrize("scale", [1e-4, 1.0, 3e3])
def test_rows_of_very_bright_light_are_the_sums_of_its_entries(scale: float) -> None:
    """Four tails in two cells, eight bands in two rows; half floats end at 65504."""
    rng, units = np.random.default_rng(4), np.array([1, 50, 0.02, 900], np.float32)
    light = TermLight.of_tiles([tile(4, 32, 0.8, 4)], units, (8,))
    band, tail = rng.uniform(0, 7, (8, 3)) * scale, rng.uniform(0.2, 0.4, (4, 3)) * scale
    band[0], tail[0] = 1e-3 * band[0], 1e-3 * tail[0]
    cell, row = np.array([0, 1, 1, 0]), np.arange(8) % 2
    found, unit = rows(light, band, tail, Cells(cell, np.arange(2), np.arange(2)), row, 2)
    point = np.repeat(np.arange(4), np.diff(light.ends))
    of_tail, of_band = np.divmod(light.codes, 8)
    sums = np.zeros((2, 2, 3, 4))
    each = unpacked_rgb(light.values) * units[point, None] * band[of_band] * tail[of_tail]
    np.add.at(sums, (cell[of_tail], row[of_band], slice(None), point), each)
    expected = np.stack([transformed(one) for one in sums])
    assert np.allclose(found.astype(float) * unit, expected, atol=2e-3 * expected.max())
