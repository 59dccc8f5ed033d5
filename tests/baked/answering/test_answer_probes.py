"""The compiled change of a probe's radiance against the same in arrays."""

from __future__ import annotations

import numpy as np

from lambent.baked.answering.probes import change


def test_a_probe_sees_both_states_of_both_sides() -> None:
    rng = np.random.default_rng(2)
    groups, lit, seen, size = 3, 20, 50, 80
    places, texels = np.sort(rng.permutation(size)[:seen]), rng.integers(0, lit, seen)
    material, other = rng.integers(0, 4, lit), np.where(rng.random(lit) < 0.5, rng.integers(0, lit, lit), -1)
    sun = rng.normal(size=(seen, 3)).astype(np.float32)
    states = [
        (rng.random((groups, lit, 3), np.float32), *(rng.random((n, 3), np.float32) for n in (seen, 4, 4)))
        for _ in range(2)
    ]
    found = np.zeros((groups, size, 3), np.float32)
    change(found, places, texels, material, other, sun, 1, *states)

    def exitance(light: np.ndarray, tint: np.ndarray, reflected: np.ndarray, transmitted: np.ndarray) -> np.ndarray:
        in_sun = (np.arange(groups) == 1)[:, None, None]
        here = light[:, texels] + in_sun * np.maximum(sun, 0)
        across = light[:, other[texels]] + in_sun * np.maximum(-sun, 0)
        crossed = (other[texels] >= 0)[:, None] * transmitted[material[texels]]
        return np.asarray(tint * (reflected[material[texels]] * here + crossed * across))

    expected = np.zeros_like(found)
    expected[:, places] = exitance(*states[1]) - exitance(*states[0])
    assert np.allclose(found, expected, atol=1e-5)
