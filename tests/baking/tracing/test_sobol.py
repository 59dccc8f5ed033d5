"""Samples of pixels: the Sobol sequence, scrambled and shuffled."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.stats import qmc


def points(sampler: Any, pixels: int) -> np.ndarray:
    """(pixels, samples, 2) of the next pair of dimensions."""
    return np.array(sampler.next_2d()).T.reshape(pixels, -1, 2)


def test_both_dimensions_are_those_of_the_sequence(mi: Any) -> None:
    import drjit as dr

    from lambent.baking.tracing import sobol

    index = dr.arange(mi.UInt32, 256)
    ours = np.stack([np.array(bits) for bits in (dr.brev(index), sobol.second_dimension(index))], axis=-1) * 2.0**-32
    expected = qmc.Sobol(2, scramble=False).random(256)  # the same points in each block of 2^k, in Gray code's order
    for count in (1, 2, 4, 32, 256):
        assert {tuple(p) for p in ours[:count]} == {tuple(p) for p in expected[:count]}


def test_every_first_2_to_the_k_samples_are_stratified_in_every_pair(mi: Any) -> None:
    from lambent.baking.tracing.sobol import SobolSampler

    sampler = SobolSampler.of_pixels(3, range(4), 0, 64)
    for _ in range(5):
        for one in points(sampler, 4):
            for count in (4, 16, 64):
                for columns in (1, 2, 4, count):
                    cells = np.floor(one[:count] * (columns, count // columns)).astype(int)
                    assert len({tuple(cell) for cell in cells}) == count
    assert sampler.next_1d().numpy().max() < 1


def test_parts_of_a_series_are_the_series(mi: Any) -> None:
    from lambent.baking.tracing.sobol import SobolSampler

    whole = points(SobolSampler.of_pixels(7, range(3), 0, 8), 3)
    parts = [points(SobolSampler.of_pixels(7, range(3), first, count), 3) for first, count in ((0, 2), (2, 1), (3, 5))]
    np.testing.assert_array_equal(np.concatenate(parts, axis=1), whole)
    last = points(SobolSampler.of_pixels(7, range(1, 3), 0, 8), 2)
    np.testing.assert_array_equal(last, whole[1:])


def test_dimensions_pixels_and_seeds_are_independent(mi: Any) -> None:
    from lambent.baking.tracing.sobol import SobolSampler

    sampler = SobolSampler.of_pixels(1, range(512), 0, 64)
    pairs = [points(sampler, 512) for _ in range(4)]
    values = np.concatenate([*pairs, np.roll(pairs[0], 1, axis=0)], axis=-1)  # the last are another pixel's
    values -= values.mean(axis=1, keepdims=True)
    covariance = np.einsum("pni,pnj->ij", values, values) / values.shape[1] / len(values)
    assert np.abs(12 * covariance - np.eye(10)).max() < 0.03
    others = points(SobolSampler.of_pixels(2, range(512), 0, 64), 512)
    assert abs(np.corrcoef(pairs[0].ravel(), others.ravel())[0, 1]) < 0.02
