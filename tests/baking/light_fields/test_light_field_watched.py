"""What viewers see of an object's lobes, and errors of it, against answers by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.baked.probes.irradiance import irradiance_of
from lambent.baking.light_fields.acquisition import Surroundings
from lambent.baking.light_fields.trial import ProbeLight
from lambent.baking.light_fields.watched import Watched, watched
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.materials.document import Lobe, Material
from tests.baking.small_scenes import coloured_room

EYES = np.array([[1.5, 0.3, 1.2], [-1.4, -0.3, 1.0], [0.2, 1.5, -1.3], [0.0, -1.6, 0.3]])
GLASS = Material(
    name="glass", lobes=(Lobe(mx=0.001, my=0.001, r0=0.04), Lobe(side="transmission", mx=0.001, my=0.001, r0=0.04))
)


def seen_of(material: Material) -> Watched:
    room = coloured_room()
    scene = replace(room, materials={**room.materials, "mirror": material})
    around = Surroundings(SceneBuilder(scene).build(), None, 6)
    found = watched(scene.object("ball").mesh, material, EYES, around, 1)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def seen(mi: Any) -> Watched:
    return seen_of(Material(name="mirror", lobes=(Lobe(mx=0.001, my=0.001, r0=0.5),)))


def test_a_mirror_shows_the_share_of_its_lobe(seen: Watched) -> None:
    """Walls are at 0 or 1 in each channel: a mirror of r0 = .5 shows them by Schlick's term."""
    assert seen.directions.shape[1] == 8 and len(seen.x) > 200
    mirrored = seen.directions.mean(axis=1)
    cosine = np.sum(mirrored * seen.normals, axis=1)
    expected = 0.5 + 0.5 * (1 - cosine.clip(0, 1)) ** 5
    np.testing.assert_allclose(seen.share.sum(axis=1)[:, 0], expected, atol=0.02)
    shown = seen.light / seen.share.sum(axis=1)
    assert (np.minimum(np.abs(shown), np.abs(shown - 1)) < 0.02).mean() > 0.9, "but for edges of walls"
    assert seen.error(np.zeros(seen.directions.shape), 1.0) > 0.1
    truth = np.repeat(shown[:, None], 8, axis=1)
    assert seen.error(truth, 1.0) < 1e-6


def test_glass_is_seen_by_both_sides(mi: Any) -> None:
    seen = seen_of(GLASS)
    through = np.sum(seen.directions * seen.normals[:, None], axis=-1) < 0
    assert seen.directions.shape[1] == 16 and through[:, 8:].all() and not through[:, :8].any()
    np.testing.assert_allclose(seen.share.sum(axis=1), 1, atol=1e-6)


def test_diffuse_light_hides_errors_and_points_are_halved(seen: Watched) -> None:
    nothing = np.zeros(seen.directions.shape)
    brighter = replace(seen, own=seen.own + 10, light=seen.light + 10)
    assert brighter.error(nothing, 1.0) < 0.2 * seen.error(nothing, 1.0)
    first, second = seen.halves()
    assert not (first & second).any() and (first | second).all()
    both = [seen.of(which).error(nothing[which], 1.0) for which in (first, second)]
    assert np.average(both, weights=[first.sum(), second.sum()]) == pytest.approx(seen.error(nothing, 1.0))


def test_a_probe_is_scaled_as_the_renderer_scales_it(seen: Watched) -> None:
    """A uniform probe, of which the light map has half."""
    cube = np.full((6, 8, 8, 3), 2.0)
    planes = np.array([[1, 0, 0, 2.0], [-1, 0, 0, 2], [0, 1, 0, 2], [0, -1, 0, 2], [0, 0, 1, 2], [0, 0, -1, 2]])
    half = replace(seen, irradiance=np.full(len(seen.x), np.pi))
    for irradiance, expected in ((None, 2.0), (irradiance_of(cube), 1.0)):
        probe = ProbeLight(cube, np.ones((6, 8, 8)), planes, np.zeros(3), irradiance)
        np.testing.assert_allclose(probe.seen(half), expected, rtol=0.02)
