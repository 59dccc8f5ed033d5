"""Paths by way of lit texels find the same light as those in cosine-distributed directions, with less noise."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.baking.surfaces.atlas import merged, unwrap
from lambent.core.arrays import Floats
from lambent.core.light.colour import luminance
from lambent.scenes.scene import PointLight, Scene
from tests.baking.small_scenes import room_with_step

SAMPLES = 64


def spot_room() -> Scene:
    """The room with a block and a mirror ball, dark but for a spot of a few centimetres on its floor."""
    room = room_with_step()
    objects = tuple(replace(o, emission=(0.0, 0.0, 0.0)) for o in room.objects)
    spot = PointLight((-1.2, 1.8, 1.2), (400.0,) * 3, (0.0, -1.0, 0.0), 2.0, 5.0)
    return replace(room, objects=objects, lights=(spot,))


def light_of(traced: Any, stage: Any) -> Floats:
    """(2, N) luminance of both halves of the sampled texels."""
    from lambent.baking.light.sampling import TexelJob
    from lambent.baking.light.tiles import TileSampler

    texels = traced.texels
    region = (slice(0, 2), slice(0, texels.height), slice(0, texels.width), slice(0, 4))
    job = TexelJob.of(traced.lit_sides(1.0), region, seed=7)
    raw = TileSampler(traced, stage)(job)
    known = raw[0, ..., 3] > 0
    return luminance(raw[:, known, :3].astype(float) / raw[:, known, 3:4])


@pytest.mark.parametrize("make", [room_with_step, spot_room])
@pytest.mark.parametrize("gathers", [False, True])
def test_the_same_light_with_less_noise(mi: Any, make: Any, gathers: bool) -> None:
    from lambent.baking.light.tiles import gathered, path_traced
    from lambent.baking.tracing.sent_light import sent_light
    from lambent.baking.tracing.traced_scene import TracedScene

    atlas = unwrap(make(), 48)
    traced = TracedScene(atlas, merged(atlas), [False] * len(atlas.scene.objects))
    sides, size = [traced.lit_sides(1.0)], (traced.texels.height, traced.texels.width, 3)
    dark = np.zeros(size, np.float32)
    sent = sent_light(traced, sides, [dark], whole=False, diffuse=True)
    stage = path_traced((SAMPLES, SAMPLES), 0.0, 8)
    if gathers:
        lit = np.random.default_rng(3).random(size, np.float32)
        lit.reshape(-1, 3)[sent.index[:40]] *= 100
        sent = sent_light(traced, sides, [lit], whole=True, diffuse=False)
        stage = gathered(SAMPLES, 0.0, 8, (lit, None))
    alone, shared = (light_of(traced, replace(stage, sent=one)) for one in (None, sent))
    means = [halves.mean() for halves in (alone, shared)]
    errors = [np.sqrt((((halves[0] - halves[1]) / 2) ** 2).sum()) / halves.shape[1] for halves in (alone, shared)]
    assert abs(means[1] - means[0]) < 4 * np.hypot(*errors)
    assert errors[1] < (0.7 if make is spot_room or gathers else 1.05) * errors[0]


def test_chosen_texels_are_flat_squares_around_their_points(mi: Any) -> None:
    from lambent.baking.surfaces.texels import texels_of
    from lambent.baking.tracing.lights.lit_texels import SentLight

    atlas = unwrap(room_with_step(), 48)
    geometry = merged(atlas)
    texels = texels_of(geometry, atlas.width, atlas.height)
    sent = SentLight.of(texels, geometry, np.ones(len(texels.index)))
    assert sent is not None
    chosen = np.isin(texels.index, sent.index)
    bent = (np.einsum("kpi,ki->kp", texels.flat, texels.flat[:, 0]) < 0.999).any(axis=1)
    assert bent.any() and not (chosen & bent).any()
    assert chosen[~bent].mean() > 0.9
    offset = texels.positions[chosen] - sent.corner[:, None]
    place = offset @ np.linalg.pinv(sent.sides)
    assert np.allclose(place @ sent.sides, offset, atol=1e-4) and place.min() > -0.01 and place.max() < 1.01
    assert np.allclose(np.linalg.norm(sent.sides, axis=2), texels.spacing[chosen][:, None], rtol=0.35)


def test_nothing_is_chosen_in_the_dark(mi: Any) -> None:
    from lambent.baking.surfaces.texels import texels_of
    from lambent.baking.tracing.lights.lit_texels import SentLight

    atlas = unwrap(room_with_step(), 16)
    geometry = merged(atlas)
    texels = texels_of(geometry, atlas.width, atlas.height)
    assert SentLight.of(texels, geometry, np.zeros(len(texels.index))) is None
