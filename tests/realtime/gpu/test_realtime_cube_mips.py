"""MIP chains keep light, and nothing poisons them."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry.cubemap import texel_solid_angles
from lambent.core.light.colour import HALF_MAX
from lambent.realtime.gpu.cube_mips import SMOOTH_AREA, finite, mip_chain, smooth_chain


@pytest.mark.parametrize("n", [1, 2, 7, 64])
def test_solid_angles_of_a_cube_fill_the_sphere(n: int) -> None:
    assert 6 * texel_solid_angles(n).sum() == pytest.approx(4 * np.pi)


@pytest.mark.parametrize("n", [2, 5, 12, 33, 64])
def test_every_level_keeps_the_light_and_constants(n: int) -> None:
    cube = np.random.default_rng(n).gamma(0.3, size=(6, n, n, 3)).astype(np.float32)
    light = (cube * texel_solid_angles(n)[..., None]).sum(axis=(0, 1, 2))
    levels = mip_chain(cube)
    assert [level.shape[1] for level in levels] == [n >> i for i in range(n.bit_length())]
    for level in levels:
        omega = texel_solid_angles(level.shape[1])[..., None]
        np.testing.assert_allclose((level * omega).sum(axis=(0, 1, 2)), light, rtol=2e-2 if n & (n - 1) else 1e-4)
    for level in mip_chain(np.full((6, n, n, 3), 2.5)):
        np.testing.assert_allclose(level, 2.5, rtol=1e-5)


@pytest.mark.parametrize("n", [1, 2, 7, 32])
def test_smooth_levels_keep_constants_and_nearly_the_light(n: int) -> None:
    for level in smooth_chain(np.full((6, n, n, 3), 2.5)):
        np.testing.assert_allclose(level, 2.5, rtol=1e-5)
    cube = np.random.default_rng(n).gamma(0.3, size=(6, n, n, 3)).astype(np.float32)
    for plain, smooth in zip(mip_chain(cube), smooth_chain(cube), strict=True):
        omega = texel_solid_angles(plain.shape[1])[..., None]
        np.testing.assert_allclose((smooth * omega).sum(), (plain * omega).sum(), rtol=0.03)


@pytest.mark.parametrize("column", [8, 15])  # the middle of a face and its edge
def test_a_smooth_level_spreads_a_lamp_evenly(column: int) -> None:
    """A texel's variance grows by 1 texel^2 per axis: with box and interpolation SMOOTH_AREA times what they blur."""
    cube = np.zeros((6, 32, 32, 1), np.float32)
    cube[4, 16:18, 2 * column : 2 * column + 2] = 1.0
    level = smooth_chain(cube)[1]
    here, beyond = level[4, :, :, 0], level[0, :, :, 0]  # to the right of +z lies +x
    across = np.concatenate([here, beyond], axis=1)
    column_at, row_at = np.arange(32), np.arange(16)
    mean = across.sum(axis=0) @ column_at / across.sum()
    assert mean == pytest.approx(column, abs=0.06)
    assert across.sum(axis=0) @ (column_at - mean) ** 2 / across.sum() == pytest.approx(1, abs=0.05)
    assert across.sum(axis=1) @ (row_at - 8) ** 2 / across.sum() == pytest.approx(1, abs=0.05)
    assert pytest.approx((1 / 12 + 1 / 6 + 1) / (1 / 12 + 1 / 6)) == SMOOTH_AREA


def test_bad_texels_become_black_and_are_counted() -> None:
    values, bad = finite(np.array([1.0, np.nan, np.inf, -2.0, 1e9]))
    np.testing.assert_array_equal(values, [1, 0, 0, 0, HALF_MAX])
    assert bad == 3
