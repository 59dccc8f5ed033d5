"""MIP chains keep light, and nothing poisons them."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.realtime.cube_mips import exact_solid_angles, finite, mip_chain
from lambent.store.contract import HALF_MAX


@pytest.mark.parametrize("n", [1, 2, 7, 64])
def test_solid_angles_of_a_cube_fill_the_sphere(n: int) -> None:
    assert 6 * exact_solid_angles(n).sum() == pytest.approx(4 * np.pi)


@pytest.mark.parametrize("n", [2, 5, 12, 33, 64])
def test_every_level_keeps_the_light_and_constants(n: int) -> None:
    cube = np.random.default_rng(n).gamma(0.3, size=(6, n, n, 3)).astype(np.float32)
    light = (cube * exact_solid_angles(n)[..., None]).sum(axis=(0, 1, 2))
    levels = mip_chain(cube)
    assert [level.shape[1] for level in levels] == [n >> i for i in range(n.bit_length())]
    for level in levels:
        omega = exact_solid_angles(level.shape[1])[..., None]
        np.testing.assert_allclose((level * omega).sum(axis=(0, 1, 2)), light, rtol=2e-2 if n & (n - 1) else 1e-4)
    for level in mip_chain(np.full((6, n, n, 3), 2.5)):
        np.testing.assert_allclose(level, 2.5, rtol=1e-5)


def test_bad_texels_become_black_and_are_counted() -> None:
    values, bad = finite(np.array([1.0, np.nan, np.inf, -2.0, 1e9]))
    np.testing.assert_array_equal(values, [1, 0, 0, 0, HALF_MAX])
    assert bad == 3
