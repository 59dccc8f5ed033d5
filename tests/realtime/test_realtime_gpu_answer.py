"""Light that answers on the GPU against the same on the cores and, in a furnace, against its series."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.core.answer import (
    MOST_ALBEDO,
    Albedos,
    Answer,
    Neighbours,
    Patches,
    Points,
    solved,
)
from lambent.core.answer_rays import Rays, packed_rays
from lambent.realtime.answered import stages
from lambent.realtime.answered.gpu_answer import GpuAnswer, Unsolved, gpu_answer

PATCHES, POINTS, RECEIVERS, TEXELS, MATERIALS = (
    70,
    300,
    40,
    900,
    4,
)  # more points and texels than a workgroup has threads


def room(groups: int, seed: int = 3) -> Answer:
    """A closed room of random shares and rays, in which light crosses some surfaces."""
    rng = np.random.default_rng(seed)
    transfer = np.where(rng.random((PATCHES, PATCHES)) < 0.3, rng.random((PATCHES, PATCHES)), 0)
    transfer /= transfer.sum(axis=1, keepdims=True)
    paired, other = np.arange(PATCHES), np.arange(POINTS)
    paired[:20], other[:50] = np.roll(paired[:20], 10), np.roll(other[:50], 25)
    direct = rng.random((groups, PATCHES, 3)) ** 4
    patches = Patches(rng.integers(0, MATERIALS, PATCHES), paired, *(x.astype(np.float32) for x in (direct, transfer)))
    weight = rng.random((POINTS, 33)) * 2
    weight[:, ::5] = 0
    weight[7] = 0  # a point that sees nothing
    rays = Rays.of(packed_rays(rng.integers(0, POINTS, (POINTS, 33)), weight))
    more = rng.integers(0, POINTS, (RECEIVERS, 9)), rng.random((RECEIVERS, 9))
    rays = rays.followed_by(Rays.of(packed_rays(*more)))
    light = (0.2 + rng.random((groups, POINTS, 3))).astype(np.float32)
    of_patch = rng.integers(0, PATCHES, POINTS)
    points = Points(of_patch, patches.material[of_patch], other, np.float32(0.4) * light, light)
    shares = rng.integers(1, 256, (TEXELS, 8)).astype(np.uint8)
    near = Neighbours(rng.integers(0, POINTS + RECEIVERS, (TEXELS, 8)).astype(np.uint32), shares)
    baked = (0.2 + rng.random((groups, TEXELS, 3)) ** 4 * 5).astype(np.float32)
    alike = rng.integers(0, POINTS + RECEIVERS, (POINTS + RECEIVERS, 8)).astype(np.uint32)
    around = Neighbours(alike, -np.sort(-rng.integers(0, 256, alike.shape)).astype(np.uint8))
    return Answer(patches, points, rays, around, near, np.float32(0.3) * baked, baked, colours(5))


def colours(seed: int, most: float = 0.8) -> Albedos:
    rng = np.random.default_rng(seed)
    reflected = rng.random((MATERIALS, 3)) * most
    return Albedos(reflected, rng.random((MATERIALS, 3)) * (most - reflected))


EDITS = [colours(8), colours(9, 0.3), Albedos(*(np.full((MATERIALS, 3), x) for x in (MOST_ALBEDO - 0.02, 0.01)))]


def texels_of(answer: Answer) -> np.ndarray:
    return np.arange(answer.baked.shape[1], dtype=np.uint32) * 2


@pytest.mark.parametrize("groups", [1, 3])
def test_the_gpu_answers_as_the_cores_do(device: Any, groups: int) -> None:
    answer = room(groups)
    reference = answer.reference()
    on_gpu = GpuAnswer(device, answer, reference, texels_of(answer))
    for edited in EDITS:
        found = on_gpu.begin(edited).irradiance()
        patches = solved(answer.patches, edited, tolerance=1e-6)
        assert np.allclose(on_gpu.solved(), patches.irradiance - answer.patches.direct, rtol=1e-3, atol=1e-6)
        assert all(stands for _, stands in on_gpu.sweeps())
        exact = answer.at_texels(answer.indirect(edited, patches), reference)
        assert np.allclose(found, exact, rtol=1e-3, atol=0)
        assert np.abs(exact / answer.baked - 1).max() > 0.2, "the edit changes the light"


def test_light_that_grows_without_end_is_left_to_the_cores(device: Any) -> None:
    answer = room(1)
    crowded = replace(answer, patches=replace(answer.patches, transfer=3 * answer.patches.transfer))
    on_gpu = GpuAnswer(device, crowded, crowded.reference(), texels_of(crowded))
    with pytest.raises(Unsolved):
        on_gpu.begin(EDITS[2])
    found = on_gpu.begin(EDITS[1]).irradiance()
    assert np.isfinite(found).all(), "the next edit is solved"


def test_the_gpu_finds_the_series_of_a_furnace(device: Any) -> None:
    """Direct light 1 everywhere, albedo a, every ray ends on a point: all light is 1 / (1 - a)."""
    direct, rays = np.ones((1, 2, 3), np.float32), packed_rays(np.tile([0, 1], (2, 8)), np.ones((2, 16)))
    box = Patches(np.zeros(2, int), np.arange(2), direct, np.full((2, 2), 0.5, np.float32))
    points = Points(np.arange(2), np.zeros(2, int), np.arange(2), direct, 2 * direct)
    near = Neighbours(np.array([[0], [1]], np.uint32), np.full((2, 1), 255, np.uint8))
    half = Albedos(np.full((1, 3), 0.5), np.zeros((1, 3)))
    answer = Answer(box, points, Rays.of(rays), near, near, direct, 2 * direct, half)
    on_gpu = GpuAnswer(device, answer, answer.reference(), texels_of(answer))
    for albedo in (0.0, 0.25, 0.5, 0.8):
        found = on_gpu.begin(Albedos(np.full((1, 3), albedo), np.zeros((1, 3)))).irradiance()
        assert np.allclose(found, 1 / (1 - albedo), rtol=0.01)


def test_dark_corners_are_solved_as_well_as_bright_ones(device: Any) -> None:
    """A chain of patches, each of which sees the next one alone: the last light has gone through all of them."""
    answer, count = room(1), PATCHES
    chain = np.zeros((count, count), np.float32)
    chain[np.arange(1, count), np.arange(count - 1)] = 0.5
    direct = np.zeros((1, count, 3), np.float32)
    direct[0, 0] = 1
    lined = Patches(np.zeros(count, int), np.arange(count), direct, chain)
    answer = Answer(
        lined, answer.points, answer.rays, answer.around, answer.near, answer.direct, answer.baked, answer.albedos
    )
    on_gpu = GpuAnswer(device, answer, answer.reference(), texels_of(answer))
    on_gpu.begin(Albedos(np.full((4, 3), 0.5), np.zeros((4, 3))))
    expected = np.where(np.arange(count) > 0, 0.25 ** np.arange(count, dtype=float), 0)[:, None]
    lit = expected[:, 0] > 1e-28  # what is darker counts as no light
    assert np.allclose(on_gpu.solved()[0][lit], expected[lit], rtol=1e-3)


def test_edits_do_not_disturb_one_another(device: Any) -> None:
    answer = room(2)
    on_gpu = GpuAnswer(device, answer, answer.reference(), texels_of(answer))
    alone = on_gpu.begin(EDITS[0]).irradiance()
    begun = [on_gpu.begin(edited) for edited in (EDITS[0], EDITS[1])]
    assert np.array_equal(begun[0].irradiance(), alone)
    assert not np.allclose(begun[1].irradiance(), alone, rtol=0.05)


def test_a_sweep_too_few_says_so(device: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lambent.realtime.answered.gpu_answer.GPU_SWEEPS", 2)
    answer = room(1)
    on_gpu = GpuAnswer(device, answer, answer.reference(), texels_of(answer))
    with pytest.raises(Unsolved):
        on_gpu.begin(EDITS[0])
    assert on_gpu.sweeps() == [(2, False)]


def test_sweeps_in_many_submissions_are_those_of_one(device: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    answer, found, taken = room(2), [], []
    for sweeps in (100, 3):
        monkeypatch.setattr("lambent.realtime.answered.gpu_answer.SWEEPS_AT_ONCE", sweeps)
        on_gpu = GpuAnswer(device, answer, answer.reference(), texels_of(answer))
        found.append(on_gpu.begin(EDITS[0]).irradiance())
        taken.append(on_gpu.sweeps())
    assert np.array_equal(found[0], found[1]) and taken[0] == taken[1] and min(taken[0])[0] > 3


def test_many_patches_with_long_rows_are_solved(device: Any) -> None:
    """More steps of a thread than a software adapter lets one submission take."""
    rng, count = np.random.default_rng(2), 1000
    transfer = rng.random((count, count)).astype(np.float32)
    transfer /= transfer.sum(axis=1, keepdims=True)
    small = room(1)
    direct = (rng.random((1, count, 3)) ** 4).astype(np.float32)
    large = Patches(rng.integers(0, MATERIALS, count), np.arange(count), direct, transfer)
    answer = Answer(large, small.points, small.rays, small.around, small.near, small.direct, small.baked, small.albedos)
    on_gpu, white = GpuAnswer(device, answer, answer.reference(), texels_of(answer)), EDITS[2]
    on_gpu.begin(white)
    exact = solved(large, white, tolerance=1e-6).irradiance - direct
    assert on_gpu.sweeps()[0][1] and np.allclose(on_gpu.solved(), exact, rtol=1e-3)


def test_without_room_the_cores_have_it(device: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    answer = room(1)

    class Small:
        def __init__(self) -> None:
            self.limits = {**device.limits, "max-storage-buffer-binding-size": 1000}

        def __getattr__(self, name: str) -> Any:
            return getattr(device, name)

    assert gpu_answer(Small(), answer, answer.reference(), texels_of(answer)) is None
    assert stages.computes(device) != device.adapter.info["adapter_type"].startswith("CPU")
