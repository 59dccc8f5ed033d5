"""Lamps at points: their light on the light map, their profiles and their shadow maps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.engine import engine
from lambent.baking.surfaces.texels import texels_of
from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize
from lambent.materials.document import Material
from lambent.scenes.geometry import patch
from lambent.scenes.photometry.distribution import Photometry
from lambent.scenes.scene import DirectionalLight, IesLight, PointLight, Scene, SceneObject
from lambent.store.lamps import DISTANCES, LAMPS, REACHED, drawn_lamps
from lambent.store.store import Store
from tests.baking.small_scenes import TINY

SPOT = PointLight((0.2, 2.0, -0.1), (3.0, 2.0, 1.0), tuple(normalize(np.array([0.1, -1.0, 0.2])).tolist()), 15.0, 40.0)
BULB = PointLight((-0.3, 1.5, 0.4), (1.0, 1.0, 2.0))
SIDE_ON = (100.0, 300.0, 50.0, 0.0)
WASHER = IesLight(
    (0.0, 1.8, 0.0),
    Photometry(
        (0.0, 30.0, 60.0, 80.0),
        (0.0, 90.0, 180.0, 270.0, 360.0),
        (SIDE_ON, (100.0, 80.0, 20.0, 0.0), (100.0, 10.0, 0.0, 0.0), (100.0, 80.0, 20.0, 0.0), SIDE_ON),
    ),
    (0.01, 0.02, 0.01),
    aim=tuple(normalize(np.array([0.2, -1.0, 0.0])).tolist()),
    rotation_deg=25.0,
)
OF_ROOM = [SPOT, BULB, WASHER]


@pytest.fixture(autouse=True, scope="module")
def _path_tracer() -> None:
    engine()


def room() -> Scene:
    """A floor of 4 m, and a plate of .4 m half a metre above its middle."""
    floor = SceneObject("floor", patch((-2, 0, 2), (4, 0, 0), (0, 0, -4)), "grey")
    plate = SceneObject("plate", patch((-0.2, 0.5, 0.2), (0.4, 0, 0), (0, 0, -0.4)), "grey")
    lights = (SPOT, DirectionalLight((0.0, -1.0, 0.0), (0.1, 0.1, 0.1)), BULB, WASHER)
    return Scene("room", (floor, plate), {"grey": Material(kd=0.5)}, lights=lights)


def intensity(lamp: PointLight | IesLight, w: Floats) -> Floats:
    """W/sr along unit world directions (n, 3), from the lamp's definition."""
    if isinstance(lamp, IesLight):
        x, y, z = (w @ lamp.axes.T).T
        return lamp.photometry.at(np.degrees(np.arccos(z)), np.degrees(np.arctan2(y, x)))[:, None] * lamp.scale
    if lamp.direction is None:
        return np.broadcast_to(lamp.intensity, w.shape)
    angle = np.degrees(np.arccos(np.clip(w @ lamp.direction, -1, 1)))
    share = ((lamp.outer_deg - angle) / (lamp.outer_deg - lamp.inner_deg)).clip(0, 1)
    return share[:, None] * lamp.intensity


def is_behind_plate(p: Floats, position: Floats) -> Floats:
    """Whether the plate hides a place on the floor; NaN where its edge is within 2 cm."""
    at = p + (position - p) * (0.5 / position[1])
    inside = np.abs(at[:, [0, 2]]).max(axis=1) - 0.2
    return np.where(np.abs(inside) < 0.02, np.nan, inside < 0)


@pytest.mark.parametrize("number", range(3))
def test_rays_bring_the_intensity_over_the_square_of_the_distance(number: int) -> None:
    import drjit as dr
    import mitsuba as mi

    from lambent.baking.tracing.lights.lamps import LampRays
    from lambent.baking.tracing.rays import array_of, vectors
    from lambent.baking.tracing.scene_builder import SceneBuilder

    scene, rng = room(), np.random.default_rng(number)
    builder = SceneBuilder(scene)
    lamps = scene.lamps
    assert lamps == (0, 2, 3), "the directional light is none"
    rays = LampRays(builder, builder.build(), lamps, np.array([[1, 1, 1], [2, 1, 0.5], [1, 1, 1]]))
    p = np.column_stack([rng.uniform(-1.5, 1.5, 4000), np.zeros(4000), rng.uniform(-1.5, 1.5, 4000)])
    si = dr.zeros(mi.SurfaceInteraction3f, len(p))
    si.p, si.n = vectors(mi.Point3f, p), mi.Normal3f(0, 1, 0)
    si.sh_frame = mi.Frame3f(mi.Normal3f(0, -1, 0))  # turned over: the light is on the back
    found = array_of(rays.of(dr.opaque(mi.UInt32, number), si, mi.Point2f(0.5), mi.Bool(True)))
    lamp, position = OF_ROOM[number], np.array(OF_ROOM[number].position)
    away = position - p
    distance = np.linalg.norm(away, axis=1)
    expected = intensity(lamp, -away / distance[:, None]) * (away[:, 1] / distance**3)[:, None]
    expected = -expected * ([2, 1, 0.5] if number == 1 else [1, 1, 1])
    hidden = is_behind_plate(p, position)
    assert np.nansum(hidden) > 20
    known = ~np.isnan(hidden)
    np.testing.assert_allclose(found[known], np.where(hidden == 1, 0, expected.T).T[known], rtol=2e-3, atol=1e-5)
    if number == 0:
        front, back = (array_of(side) for side in rays(si, mi.Bool(True)))
        assert not front.any() and (back.sum(axis=0) > 1.5 * -found.sum(axis=0)).all()


@pytest.mark.parametrize("lamp", OF_ROOM, ids=["spot", "bulb", "washer"])
def test_profiles_are_the_lamps(lamp: PointLight | IesLight) -> None:
    from scipy.ndimage import map_coordinates

    from lambent.store.lamp_discs import SIDE, axes_of, profile, reach_deg

    disc, most = profile(lamp)
    axes, scale = axes_of(lamp), np.sin(np.radians(reach_deg(lamp)) / 2)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    w = normalize(np.random.default_rng(1).normal(size=(5000, 3)))
    local = w @ axes.T
    q = local[:, :2] / np.sqrt(2 + 2 * local[:, 2:]) / scale
    inside = np.linalg.norm(q, axis=1) < 1 - 2 / SIDE
    at = (q[inside, ::-1].T + 1) / 2 * SIDE - 0.5
    found = map_coordinates(disc.astype(float), at, order=1, mode="nearest")
    expected = intensity(lamp, w)
    assert disc.max() == 1
    np.testing.assert_allclose(found[:, None] * most, expected[inside], atol=4e-3 * most.max())
    assert not expected[np.linalg.norm(q, axis=1) > 1].any()


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    return bake(room(), tmp_path_factory.mktemp("lamps") / "s", quality=TINY, only=("lamps",))


@pytest.mark.parametrize("number", [0, 2])
def test_shadow_maps_have_the_distances_of_surfaces(store: Store, number: int) -> None:
    from lambent.core.light.colour import HALF_MAX
    from lambent.store.lamp_discs import SIDE, axes_of, directions, reach_deg

    place = [record.number for record in drawn_lamps(store)].index(number)
    lamp = room().lights[number]
    assert isinstance(lamp, PointLight)
    local, there = directions(reach_deg(lamp))
    w = local @ axes_of(lamp)
    corner = np.degrees(2 * np.arcsin(np.sqrt(2) * np.sin(np.radians(20))))
    widest = np.degrees(np.arccos(w @ axes_of(lamp)[2]))[there].max()
    assert widest == pytest.approx(180.0 if lamp is BULB else corner, abs=1.0)
    found = store.read(DISTANCES)[place].reshape(-1).astype(float)
    position = np.array(lamp.position)
    down = w[:, 1] < -0.1
    floor = position + w * (position[1] / -np.where(down, w[:, 1], -1))[:, None]
    hidden = is_behind_plate(floor, position)
    on_floor = down & (np.abs(floor[:, [0, 2]]).max(axis=1) < 1.9) & ~np.isnan(hidden) & there
    expected = np.where(hidden == 1, position[1] - 0.5, position[1]) / np.abs(w[:, 1])
    np.testing.assert_allclose(found[on_floor], expected[on_floor], rtol=1e-3)
    assert (found[w[:, 1] > 0] == HALF_MAX).all() and len(found) == SIDE**2
    assert 0 < (hidden[on_floor] == 1).mean() < 0.5


def test_the_light_map_has_their_light_and_says_where_it_and_shadows_fall(store: Store) -> None:
    light, of_map = store.read(LAMPS[0]).astype(float), store.read("light_map/irradiance").astype(float)
    geometry = {name: store.read(f"geometry/{name}") for name in ("positions", "normals", "uv2", "faces")}
    texels = texels_of(geometry, *of_map.shape[1::-1])
    floor = (texels.face[:, 0] < 2) & (texels.area_m2 > 0)
    p = texels.positions[floor].mean(axis=1).astype(float)
    records = drawn_lamps(store)
    bits = store.read(REACHED).reshape(-1, 4)[texels.index[floor]]
    total = np.zeros_like(p)
    clear = np.ones(len(p), bool)
    for place, record in enumerate(records):
        lamp, position = room().lights[record.number], np.array(record.position)
        assert isinstance(lamp, PointLight | IesLight)
        away = position - p
        distance = np.linalg.norm(away, axis=1)
        whole = intensity(lamp, -away / distance[:, None]) * (away[:, 1] / distance**3)[:, None]
        reached, shaded = (bits[:, word] >> place & 1 for word in (0, 2))
        hidden = is_behind_plate(p, position)
        deep = hidden == 1
        assert shaded[deep].all(), "what the plate hides may be in its shadow"
        assert (reached[whole.max(axis=1) * (hidden == 0) > 1e-3] == 1).all()
        if lamp is SPOT:
            assert not reached[-away / distance[:, None] @ SPOT.direction < np.cos(np.radians(55))].any()
        total += np.where(deep[:, None], 0, whole)
        clear &= shaded == 0
    assert 0.3 < clear.mean() < 1
    found = light.reshape(len(light), -1, 3)[:, texels.index[floor]].sum(axis=0)
    np.testing.assert_allclose(found[clear], total[clear], rtol=0.05, atol=0.02)
    whole_map = of_map.reshape(-1, 3)[texels.index[floor]]
    assert (whole_map >= 0.999 * found - 1e-3).all()
    np.testing.assert_allclose(whole_map[clear], found[clear], rtol=0.2, atol=0.05)  # little else lights it


def test_the_lamps_with_most_detail_are_drawn() -> None:
    from lambent.baking.light.lamps import drawn_of
    from lambent.store.lamps import MOST_LAMPS

    detail: Any = np.random.default_rng(3).permutation(np.arange(100.0))
    drawn = drawn_of(detail)
    assert len(drawn) == MOST_LAMPS and (detail[list(drawn)] == np.arange(99, 99 - MOST_LAMPS, -1)).all()
    assert drawn_of(np.array([0.0, 2.0, 0.0])) == (1,)
