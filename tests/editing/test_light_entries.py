"""Entries as steps: the same numbers and values as were given, however far apart they are."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.shared_exponent import packed_rgb
from lambent.editing.interreflection.entries import Entries, TermLight


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


def test_the_first_number_may_be_far_too() -> None:
    far: Entries = np.array([1, 0, 2]), np.array([255, 256, 1023], np.uint32), packed_rgb(np.ones((3, 3), np.float32))
    light = TermLight.of_tiles([far], np.array([1, 1, 4], np.float32), ())
    assert light.codes[light.values != 0].tolist() == [255, 256, 1023]
    assert light.largest == 8


def test_fewer_bytes_than_numbers_in_full() -> None:
    entries = tile(200, 5000, 0.06, 3)
    light = TermLight.of_tiles([entries], np.ones(200, np.float32), (64,))
    assert light.steps.nbytes + light.values.nbytes < 0.65 * (entries[1].nbytes + entries[2].nbytes)
