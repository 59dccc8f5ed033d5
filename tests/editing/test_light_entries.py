"""Entries as steps: the same numbers and values as were given, however far apart they are."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baked.shared_exponent import packed_rgb, unpacked_rgb
from lambent.baked.transport.wavelets import transformed
from lambent.editing.interreflection.entries import Cells, Entries, TermLight, rows


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
