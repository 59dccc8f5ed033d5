"""Lamps of cube maps: found whole across the edges of faces, and taken out with all of their light."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baked.probe_lamps.find import MOST, find_lamps, neighbours, texel_at
from lambent.core.geometry.cubemap import face_directions, texel_solid_angles
from lambent.core.geometry.directions import normalize

N = 64
W = normalize(face_directions(N))
OMEGA = texel_solid_angles(N)[..., None]


def lit(*lamps: tuple[tuple[float, float, float], float, float], rest: float = 0.1) -> np.ndarray:
    """(6, N, N, 3): discs (direction, radius in rad, radiance) on an even background."""
    cube = np.full((6, N, N, 3), rest)
    for direction, radius, radiance in lamps:
        cube[W @ normalize(np.array(direction)) > np.cos(radius)] = radiance
    return cube


def test_a_lamp_on_a_corner_of_the_cube_is_one() -> None:
    (lamp,) = find_lamps(lit(((1.0, 1.0, 1.0), 0.08, 50.0)))
    assert len({int(texel) // (N * N) for texel in lamp.texels}) == 3
    expected = 49.9 * 2 * np.pi * (1 - np.cos(0.08))
    np.testing.assert_allclose(lamp.flux.sum(axis=0), expected, rtol=0.05)
    assert lamp.radius_rad == pytest.approx(0.08 / np.sqrt(2), rel=0.06)


def test_what_is_left_is_the_background_and_no_light_is_lost() -> None:
    cube = lit(((0.2, 0.9, -0.4), 0.05, 30.0), ((-1.0, 0.1, 0.3), 0.08, 20.0), ((0.0, -1.0, 0.2), 0.4, 3.0))
    lamps = find_lamps(cube)
    left = cube.reshape(-1, 3).copy()
    for lamp in lamps:
        left[lamp.texels] -= lamp.excess
    np.testing.assert_allclose(left, 0.1, atol=1e-9)
    total = left.reshape(cube.shape) * OMEGA
    flux = sum(lamp.flux.sum(axis=0) for lamp in lamps)
    np.testing.assert_allclose(total.sum(axis=(0, 1, 2)) + flux, (cube * OMEGA).sum(axis=(0, 1, 2)))
    assert len({int(texel) for lamp in lamps for texel in lamp.texels}) == sum(len(lamp.texels) for lamp in lamps)


def test_the_sun_in_a_window_is_a_lamp_of_its_own() -> None:
    cube = lit(((0.3, 0.2, 1.0), 0.3, 5.0), ((0.35, 0.25, 1.0), 0.04, 3000.0))
    lamps = find_lamps(cube)
    sun = max(lamps, key=lambda lamp: lamp.excess.max())
    assert sun.radius_rad < 0.04
    assert sun.excess.max() == pytest.approx(3000, rel=0.002)
    assert sum(lamp.power for lamp in lamps if lamp is not sun) == pytest.approx(
        4.9 * 2 * np.pi * (1 - np.cos(0.3)), rel=0.1
    )


def test_a_long_lamp_is_cut_across() -> None:
    cube = np.full((6, N, N, 3), 0.1)
    cube[4, 30:33, 4:60] = 20.0
    lamps = find_lamps(cube)
    assert 4 <= len(lamps) <= MOST
    assert max(lamp.radius_rad for lamp in lamps) < 0.3
    assert sum(len(lamp.texels) for lamp in lamps) == 3 * 56


@pytest.mark.parametrize("level", [0.0, 1.0])
def test_even_light_has_no_lamps(level: float) -> None:
    assert find_lamps(np.full((6, 16, 16, 3), level)) == []
    assert find_lamps(np.full((6, 1, 1, 3), level)) == []


def test_of_many_equal_lamps_no_more_than_most_leave_and_always_the_same() -> None:
    rng = np.random.default_rng(2)
    cube = np.full((6, N, N, 3), 0.05)
    at = np.unravel_index(rng.choice(6 * (N // 4) ** 2, 200, replace=False), (6, N // 4, N // 4))
    cube[at[0], 4 * at[1] + 1, 4 * at[2] + 1] = 60.0
    one, two = find_lamps(cube), find_lamps(cube)
    assert len(one) == MOST
    for a, b in zip(one, two, strict=True):
        np.testing.assert_array_equal(a.texels, b.texels)


def test_one_saturated_texel() -> None:
    cube = np.full((6, N, N, 3), 0.1)
    cube[2, 10, 20] = 65504.0
    (lamp,) = find_lamps(cube)
    assert list(lamp.texels) == [(2 * N + 10) * N + 20]
    assert 0 < lamp.radius_rad < 2 / N


def test_neighbours_are_mutual_and_near() -> None:
    n = 8
    beside, w = neighbours(n), normalize(face_directions(n)).reshape(-1, 3)
    np.testing.assert_array_equal(texel_at(w, n), np.arange(6 * n * n))
    assert (np.einsum("ijk,ik->ij", w[beside], w) > np.cos(0.36)).all()
    assert all(texel in beside[other] for texel in range(6 * n * n) for other in beside[texel])


@pytest.mark.parametrize("direction", [(0.0, -0.2, 1.0), (0.1, 1.0, 0.2)])
def test_a_lamp_leaves_a_bright_third_of_the_sky_that_stays(direction: tuple[float, float, float]) -> None:
    cube = lit(((0.0, 1.0, 0.0), 0.7, 2.0), (direction, 0.05, 90.0), rest=0.05)
    lamps = find_lamps(cube)
    assert {lamp.excess.max() > 80 for lamp in lamps} == {True}
    around = float(np.sum([lamp.flux.sum(axis=0)[0] for lamp in lamps]))
    assert around == pytest.approx(89 * 2 * np.pi * (1 - np.cos(0.05)), rel=0.15)
