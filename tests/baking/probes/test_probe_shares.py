"""Which share of a probe's light arrives at a texel, by direction."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baked.probes.lookups import distance_lookup, inverse_depth, planes_lookup
from lambent.baking.bake import bake
from lambent.baking.probes.device_lookup import DeviceProbe
from lambent.baking.probes.shares import EQUATIONS, MOST_LIGHT, RAYS, UPPER, _equations, _Rays, share_along, solved
from lambent.baking.tracing.rays import vectors
from lambent.core.geometry.cubemap import sample
from lambent.core.geometry.directions import normalize
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import patch
from lambent.scenes.scene import ImageEnvironment, Scene, SceneObject
from lambent.store.occlusion import probe_shares
from tests.baking.small_scenes import BLACK, TINY, constant_picture

RNG = np.random.default_rng(3)
GLOSSY = Material(kd=0.2, lobes=(Lobe(distribution="ggx", mx=0.2, my=0.2, r0=0.05),))


@pytest.mark.parametrize("planes", [0, 6, 8])
def test_look_ups_on_the_device_are_those_of_numpy(mi: Any, planes: int) -> None:
    n, count = 12, 400
    radiance = np.repeat(RNG.uniform(0.1, 2.0, (6, n, n, 1)), 3, axis=-1)
    distance = RNG.uniform(0.8, 1.6, (6, n, n))
    centre = np.array([0.3, -0.2, 0.1])
    about = np.concatenate([normalize(RNG.normal(size=(planes, 3))), RNG.uniform(0.5, 2, (planes, 1))], axis=1)
    x, w = RNG.uniform(-0.3, 0.3, (count, 3)), normalize(RNG.normal(size=(count, 3)))
    for by_distance in (False, True):
        probe = DeviceProbe(centre, radiance, about, distance if by_distance else None)
        found = np.array(probe.luminance(vectors(mi.Point3f, x + centre), vectors(mi.Vector3f, w)))
        direction = distance_lookup(x, w, inverse_depth(distance)) if by_distance else planes_lookup(x, w, about)
        expected = sample(radiance, normalize(direction))[:, 0]
        assert (np.abs(found - expected) < 2e-3).mean() > 0.99  # at edges of faces either side may be taken


def test_shares_that_are_linear_are_found_and_those_of_a_black_probe_are_bounded() -> None:
    w = normalize(RNG.normal(size=(600, 3)))
    probe, true = RNG.uniform(0.2, 3.0, 600), 0.8 + w @ [0.3, -0.2, 0.4]
    basis = np.concatenate([np.ones((600, 1)), w], axis=1) * probe[:, None]
    sums = np.concatenate([(basis[:, UPPER[0]] * basis[:, UPPER[1]]).sum(axis=0), basis.T @ (probe * true)])
    found = solved(np.stack([sums, np.zeros(EQUATIONS), sums * [1e-9] * EQUATIONS]))
    np.testing.assert_allclose(found[0], [0.8, 0.3, -0.2, 0.4], atol=0.02)
    np.testing.assert_allclose(found[1], [1, 0, 0, 0])
    assert (np.abs(found) <= 4).all()
    assert share_along(np.array([[-1.0, 0, 0, 0], [9, 0, 0, 0]]), w[:2]).tolist() == [0, 2]


def test_a_lamp_that_the_probe_misses_leaves_the_shares_of_other_directions() -> None:
    """A wall as bright as the probe has it, and three of 64 rays to a lamp of which the probe sees a dark underside."""
    w = normalize(RNG.normal(size=(RAYS, 3)))
    w[:, 2] = np.abs(w[:, 2])
    probe = np.full(RAYS, 0.3)
    light, lamp = probe.copy(), np.argsort(-w[:, 1])[:3]
    light[lamp], probe[lamp] = 8.0, 0.05
    rays = _Rays(np.zeros(RAYS, np.int64), *(a.astype(np.float32) for a in (w, light, probe, np.ones(RAYS))))
    others = np.setdiff1d(np.arange(RAYS), lamp)

    def shares(most: float | None) -> np.ndarray:
        return share_along(solved(_equations(rays, 0.3, most)).repeat(len(others), axis=0), w[others])

    np.testing.assert_allclose(shares(MOST_LIGHT), 1, atol=0.1)
    assert np.abs(shares(None) - 1).max() > 0.3, "otherwise it would"


@pytest.mark.long
def test_below_a_roof_no_light_comes_from_above_and_all_from_the_side(tmp_path: Path) -> None:
    """A floor under a white sky, with a black roof close over one end, which its probe sees from the side."""
    floor = SceneObject("floor", patch((-2, 0, 1), (4, 0, 0), (0, 0, -2)), "glossy")
    roof = SceneObject("roof", patch((-2, 0.3, -1), (1, 0, 0), (0, 0, 2)), "black")
    sky = ImageEnvironment(constant_picture(tmp_path))
    camera = Camera("door", (1.5, 1.2, 3.0), (-0.5, 0.0, 0.0))
    scene = Scene("roof", (floor, roof), {"glossy": GLOSSY, "black": BLACK}, environment=sky, cameras=(camera,))
    store = bake(scene, tmp_path / "s", quality=TINY, only=("probe_share",))
    values, names = probe_shares(store)
    assert values is not None and names == {"floor"}
    uv2, positions = store.read("geometry/uv2"), store.read("geometry/positions")
    of_floor = np.flatnonzero(positions[:, 1] == 0)
    on_floor = np.c_[positions[of_floor][:, [0, 2]], np.ones(len(of_floor))]
    to_uv2 = np.linalg.lstsq(on_floor, uv2[of_floor], rcond=None)[0]

    def share(x: float, w: tuple[float, float, float]) -> float:
        column, row = (np.array([x, 0.0, 1.0]) @ to_uv2) * values.shape[1::-1]
        a, *b = values[int(row), int(column)].astype(float)
        return float(a + np.dot(b, w))

    up, aside = (0.0, 1.0, 0.0), (0.8, 0.6, 0.0)
    assert share(-1.5, up) < 0.35 < 0.7 < share(-1.15, (0.97, 0.24, 0.0))
    assert share(1.0, up) == pytest.approx(1, abs=0.1) and share(1.0, aside) == pytest.approx(1, abs=0.1)
