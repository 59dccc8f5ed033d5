"""Light that answers: radiosity against linear algebra, gathering and ratios against sums by hand."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baked.answering.albedos import edited_albedos
from lambent.baked.answering.answer import (
    MOST_ALBEDO,
    MOST_EXCESS,
    MOST_SHARES,
    Albedos,
    Answer,
    Neighbours,
    Patches,
    Points,
    answered,
    inverses,
    ratios,
    side_by_side,
    solved,
    upsampled,
)
from lambent.baked.answering.probes import change
from lambent.baked.answering.rays import MOST_POINTS, Rays, gathered, last_points, packed_rays
from lambent.materials.document import Material


def patches(groups: int = 2, count: int = 30, paired: bool = False) -> Patches:
    rng = np.random.default_rng(3)
    transfer = rng.random((count, count)) ** 4
    transfer /= transfer.sum(axis=1, keepdims=True)  # a closed room
    other = np.arange(count)
    if paired:
        other[:10] = np.roll(np.arange(10), 5)
    direct = rng.random((groups, count, 3)).astype(np.float32) ** 8
    return Patches(rng.integers(0, 4, count), other, direct, transfer.astype(np.float32))


def albedos(seed: int = 5) -> Albedos:
    rng = np.random.default_rng(seed)
    return Albedos(rng.random((4, 3)) * 0.6, rng.random((4, 3)) * 0.3)


@pytest.mark.long
@pytest.mark.parametrize("paired", [False, True])
@pytest.mark.parametrize("groups", [1, 2, 6])
def test_the_solution_is_that_of_the_linear_system(paired: bool, groups: int) -> None:
    room, colours = patches(groups, paired=paired), albedos()
    found = solved(room, colours, tolerance=1e-6)
    assert found.converged
    for group in range(groups):
        for channel in range(3):
            across = np.eye(30)[room.paired] * (room.paired != np.arange(30))[:, None]
            sends = np.diag(colours.reflected[room.material, channel])
            sends = sends + np.diag(colours.transmitted[room.material, channel]) @ across
            light = np.linalg.solve(np.eye(30) - room.transfer @ sends, room.direct[group, :, channel])
            assert np.allclose(found.irradiance[group, :, channel], light, rtol=2e-4)


def test_dark_corners_are_solved_as_well_as_bright_ones() -> None:
    """A chain of patches, each of which sees the next one alone: the last light has gone through all of them."""
    count = 12
    chain = np.zeros((count, count), np.float32)
    chain[np.arange(1, count), np.arange(count - 1)] = 0.01
    direct = np.zeros((1, count, 3), np.float32)
    direct[0, 0] = 1
    room = Patches(np.zeros(count, int), np.arange(count), direct, chain)
    found = solved(room, grey(0.5))
    assert np.allclose(found.irradiance[0, :, 0], 0.005 ** np.arange(count), rtol=1e-3)


def test_a_solution_that_does_not_come_to_an_end_says_so() -> None:
    room = Patches(np.zeros(2, int), np.arange(2), np.ones((1, 2, 3), np.float32), np.full((2, 2), 0.5, np.float32))
    assert not solved(room, grey(1.0)).converged


def test_light_that_would_grow_without_end_is_bounded() -> None:
    """Two patches that see each other 3.5 times: in dark colours 1.3 times, in light ones as a closed box would."""
    direct, numbers = np.ones((1, 2, 3), np.float32), np.arange(2)
    pair = Patches(np.zeros(2, int), numbers, direct, np.array([[0, 3.5], [3.5, 0]], np.float32))
    for albedo, share in ((0.2, MOST_SHARES), (0.85, 1.0)):
        found = solved(pair, grey(albedo), tolerance=1e-6)
        assert found.converged and found.irradiance == pytest.approx(1 / (1 - share * albedo), rel=1e-4)


def rays_of_light(weight: np.ndarray, point: np.ndarray, light: np.ndarray) -> np.ndarray:
    """(K, G, 3) means over rays to `point` (K, R) that weigh (K, R), of light (n, G, 3)."""
    return (weight[..., None, None] * light[point]).mean(axis=1)


def padded(light: np.ndarray) -> np.ndarray:
    return side_by_side(np.moveaxis(light, 0, 1))


@pytest.mark.long
def test_gathering_sums_what_rays_end_on() -> None:
    rng = np.random.default_rng(0)
    point, weight = rng.integers(0, MOST_POINTS, (5, 64)), rng.random((5, 64)) * 2
    weight[:, ::7] = 0
    rays = packed_rays(point, weight)
    assert np.array_equal(last_points(rays), np.where(weight > 0, point, 0).max(axis=1))
    light = rng.random((MOST_POINTS, 2, 3)).astype(np.float32)
    assert np.allclose(gathered(Rays.of(rays), padded(light))[..., :3], rays_of_light(weight, point, light), rtol=0.03)


@pytest.mark.long
def test_steps_of_weights_add_no_light_and_take_none() -> None:
    """Every weight alike: sums of many are right, whatever lies between two steps."""
    point = np.tile(np.arange(256), (64, 1))
    light = np.ones((256, 1, 4), np.float32)
    for one in (1.0, 1.07, 1.3, 3.0, 0.011):
        found = gathered(Rays.of(packed_rays(point, np.full((64, 256), one))), light)
        assert found[:, 0, :3] == pytest.approx(one, rel=0.01)


@pytest.mark.parametrize("groups", [1, 2, 4, 5, 7])
def test_rays_that_end_at_one_point_are_one(groups: int) -> None:
    rng = np.random.default_rng(groups)
    point, weight = rng.integers(0, 20, (6, 256)), rng.random((6, 256)) * 3
    weight[:2, ::3] = 0
    weight[5] = 0  # a point that sees nothing
    merged = Rays.of(packed_rays(point, weight))
    assert len(merged.points) == 5 * 20 and merged.starts[-1] == 100 and merged.starts[-2] == 100
    assert (np.diff(merged.points[:20].astype(int)) > 0).all()
    light = rng.random((20, groups, 3)).astype(np.float32)
    assert np.allclose(gathered(merged, padded(light))[..., :3], rays_of_light(weight, point, light), rtol=0.08)


@pytest.mark.long
def test_points_send_the_light_of_both_their_sides() -> None:
    light = np.array([[[10.0] * 3, [4.0] * 3]], np.float32)
    points = Points(np.zeros(2, int), np.zeros(2, int), np.array([1, 0]), np.float32(0.5) * light, light)
    sheet = Albedos(np.full((1, 3), 0.2), np.full((1, 3), 0.5))
    same = np.ones((2, 1, 4), np.float32)
    as_baked = points.exitance(sheet, same, same, points.indirect)
    assert as_baked.shape == (2, 1, 4) and not as_baked[..., 3].any()
    assert np.allclose(as_baked[:, 0, 0], [0.2 * 10 + 0.5 * 4, 0.2 * 4 + 0.5 * 10])
    doubled = points.exitance(sheet, 2 * same, same, points.indirect)
    assert np.allclose(doubled[:, 0, 0], 1.5 * as_baked[:, 0, 0]), "direct light stays"
    bounded = points.exitance(sheet, 2 * same, same, 0 * points.indirect)
    assert np.allclose(bounded, as_baked), "light that was not gathered does not grow"
    halved = points.exitance(sheet, 0.5 * same, same, 0 * points.indirect)
    assert np.allclose(halved[:, 0, 0], 0.75 * as_baked[:, 0, 0]), "but gets darker"


def grey(albedo: float) -> Albedos:
    return Albedos(np.full((1, 3), albedo), np.zeros((1, 3)))


def furnace(light: float) -> Answer:
    """Two points of albedo .5, direct light 1 and all light `light`; every ray ends on one of them."""
    direct, rays = np.ones((1, 2, 3), np.float32), packed_rays(np.tile([0, 1], (2, 8)), np.ones((2, 16)))
    room = Patches(np.zeros(2, int), np.arange(2), direct, np.full((2, 2), 0.5, np.float32))
    points = Points(np.arange(2), np.zeros(2, int), np.arange(2), direct, light * direct)
    near = alone(2)
    return Answer(room, points, Rays.of(rays), near, near, direct, light * direct, grey(0.5))


@pytest.mark.long
@pytest.mark.parametrize("albedo", [0.0, 0.25, 0.8])
def test_two_points_in_a_furnace_have_the_light_of_its_series(albedo: float) -> None:
    """All light is 1 / (1 - a)."""
    answer = furnace(2.0)
    assert np.allclose(answer.irradiance(grey(albedo), answer.reference()), 1 / (1 - albedo), rtol=0.01)


def test_points_brighten_no_more_than_what_their_rays_gather() -> None:
    """Of 10 indirect W/m^2, rays gather 11/2: 1.25 times that grows, so I = a (11 - 1.25 11/2 + 1.25 I)."""
    grown = MOST_EXCESS * 11 / 2
    assert np.allclose(
        furnace(11.0).indirect(grey(0.55))[..., :3], 0.55 * (11 - grown) / (1 - 0.55 * MOST_EXCESS), rtol=0.02
    )


@pytest.mark.long
def test_light_in_a_gap_that_patches_do_not_resolve_is_reflected_many_times() -> None:
    """A patch has a lit point and seven in a gap, whose rays end on all eight alike: I = a (7 I + 1) / 8."""
    weight = np.ones((8, 64))
    weight[0] = 0

    def gap(albedo: float) -> float:
        return albedo / (8 - 7 * albedo)

    direct, light = np.zeros((1, 8, 3), np.float32), np.full((1, 8, 3), gap(0.2), np.float32)
    direct[:, 0] = light[:, 0] = 1
    patch = Patches(np.zeros(1, int), np.zeros(1, int), direct.mean(axis=1, keepdims=True), np.full((1, 1), 0.5))
    points = Points(np.zeros(8, int), np.zeros(8, int), np.arange(8), direct, light)
    near = Neighbours(np.full((1, 8), 1, np.uint32), np.full((1, 8), 255, np.uint8))
    rays = Rays.of(packed_rays(np.tile(np.arange(64) % 8, (8, 1)), weight))
    answer = Answer(patch, points, rays, alone(8), near, direct[:, 1:2], light[:, 1:2], grey(0.2))
    assert answer.reference() == pytest.approx(gap(0.2))
    assert answer.irradiance(grey(0.8), answer.reference()) == pytest.approx(gap(0.8), rel=0.12)


def test_few_rays_stand_for_all_of_a_point() -> None:
    rng = np.random.default_rng(4)
    point, weight, light = rng.integers(0, 500, (40, 256)), rng.random((40, 256)) ** 3, rng.random((500, 1, 3)) ** 3
    weight[3] = 0  # a point that sees nothing
    rays, sent = Rays.of(packed_rays(point, weight)), padded(np.asarray(light, np.float32).reshape(500, 1, 3))
    few = rays.thinned(32, light.mean(axis=(1, 2)))
    each = np.diff(few.starts)
    assert each.max() <= 32 and each[3] == 0 and len(few.points) == len(few.weights) == each.sum()
    ratio = gathered(few, sent)[..., :3].sum(axis=(1, 2)) / np.maximum(
        gathered(rays, sent)[..., :3].sum(axis=(1, 2)), 1e-9
    )
    assert np.delete(ratio, 3).std() < 0.15 and np.delete(ratio, 3).mean() == pytest.approx(1, abs=0.03)


def test_texels_show_means_of_their_points() -> None:
    near = Neighbours(np.array([[0, 1], [2, 2]], np.uint32), np.array([[255, 85], [10, 0]], np.uint8))
    light = np.arange(9, dtype=np.float32).reshape(1, 3, 3)
    assert np.allclose(upsampled(side_by_side(light), near), [[[0.75, 1.75, 2.75], [6.0, 7.0, 8.0]]])


def test_ratios_of_no_light_are_one_and_bounded() -> None:
    reference = np.array([[[1.0, 2.0, 0.0]]])
    assert ratios(np.array([[[0.5, 4e9, 5.0]]]), reference).tolist() == [[[0.5, 64.0, 1.0]]]
    assert inverses(side_by_side(reference.astype(np.float32)))[..., :3].tolist() == [[[1.0, 0.5, 0.0]]]


def test_direct_light_stays_and_light_that_was_not_gathered_never_grows() -> None:
    one = np.ones((1, 1, 3), np.float32)
    assert np.allclose(answered(one, 3 * one, one, 2 * one), 2.0), "half of the indirect light"
    found = answered(0 * one, 10 * one, 4 * one, 2 * one)
    assert np.allclose(found, 10 + 2 * MOST_EXCESS), "what was not gathered grows with no edit"
    assert np.allclose(answered(0 * one, 10 * one, 0 * one, 2 * one), 0), "but dies with the light around it"


def alone(count: int) -> Neighbours:
    """Points that are averaged with none but themselves."""
    return Neighbours(np.arange(count, dtype=np.uint32)[:, None], np.full((count, 1), 255, np.uint8))


def small_answer() -> Answer:
    rng, room = np.random.default_rng(1), patches(1)
    rays = packed_rays(rng.integers(0, 9, (9, 32)), np.ones((9, 32)))
    light = (1 + rng.random((1, 9, 3))).astype(np.float32)
    points = Points(rng.integers(0, 30, 9), rng.integers(0, 4, 9), np.arange(9), 0.3 * light, light)
    near = Neighbours(rng.integers(0, 9, (50, 8)).astype(np.uint32), np.full((50, 8), 255, np.uint8))
    baked = (1 + rng.random((1, 50, 3))).astype(np.float32)
    return Answer(room, points, Rays.of(rays), alone(9), near, 0.3 * baked, baked, albedos())


def test_before_the_first_edit_nothing_changes() -> None:
    answer = small_answer()
    reference = answer.reference()
    same = Albedos(answer.albedos.reflected.copy(), answer.albedos.transmitted.copy())
    assert answer.irradiance(same, reference) is answer.baked
    nearly = answered(answer.direct, answer.baked, reference, reference)
    assert np.allclose(nearly, answer.baked, rtol=1e-6)


def test_darker_walls_make_all_of_the_room_darker() -> None:
    answer = small_answer()
    half = Albedos(answer.albedos.reflected / 2, answer.albedos.transmitted / 2)
    found = answer.irradiance(half, answer.reference())
    assert (found < answer.baked).all() and (found >= answer.direct - 1e-6).all()


@pytest.mark.long
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


def test_albedos_of_edited_materials_are_their_diffuse_ones_below_a_bound() -> None:
    before, sheet = [Material(kd=0.1)] * 2, Material(kd=(0.1, 0.2, 0.3), kt_d=0.4)
    found = edited_albedos(before, [sheet, Material(kd=0.8, kt_d=0.8)])
    assert np.allclose(found.reflected, [[0.1, 0.2, 0.3], [MOST_ALBEDO / 2] * 3])
    assert np.allclose(found.transmitted, [[0.4] * 3, [MOST_ALBEDO / 2] * 3])
