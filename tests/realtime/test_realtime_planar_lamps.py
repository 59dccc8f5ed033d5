"""Small lamps over planar reflectors: their shapes and maps are right, and the picture is that of rays, beadless."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.bench import planar_scene
from lambent.bench.planar_scene import floor_state
from lambent.bench.reference import Reference
from lambent.core.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.realtime.lamp_maps import PlaneFrame, lamp_map
from lambent.realtime.layouts import Layouts
from lambent.realtime.plane_lamps import MOST, POINTS, PlaneLamp, lamps_of, over
from lambent.realtime.renderer import Renderer
from lambent.realtime.resources import SceneResources
from lambent.realtime.unbaked import unbaked_scene
from lambent.scenes.geometry import cylinder, merge, patch, placed, sphere
from lambent.scenes.scene import Mesh
from tests.realtime.test_realtime_beads import second_highlight
from tests.realtime.test_realtime_planar import FLOOR, mirror, scene_of

# A globe, and one that the cylinder hides in part: 3 and 5 degrees wide as the floor mirrors them.
TWO = {
    "globe": (placed(sphere(0.06, 32, 16), (-0.25, 1.35, 0.2)), (40.0, 34.0, 26.0)),
    "behind": (placed(sphere(0.16, 32, 16), (0.3, 1.5, -1.2)), (9.0, 10.0, 14.0)),
}
ROUND = Lobe(mx=0.15, my=0.15, r0=0.9, alpha=0.5)
BRUSHED = Lobe(mx=0.3, my=0.1, r0=0.9, alpha=0.5)
GGX = Lobe(mx=0.15, my=0.15, r0=0.9, alpha=0.5, distribution="ggx")
PLANE = np.array([0.0, 1.0, 0.0, 0.0])
SQUARE = PlaneFrame.about(np.asarray(FLOOR.outline, float), PLANE[:3])
WIDTH, HEIGHT = 160, 120


def lamp_from(mesh: Mesh, name: str = "lamp") -> PlaneLamp:
    return PlaneLamp(name, mesh.positions[mesh.faces].astype(float), (1.0, 1.0, 1.0))


def below(*points: tuple[float, float]) -> np.ndarray:
    return np.array([(x, 0.0, z) for x, z in points])


def test_the_shape_of_a_ball_and_of_a_disc() -> None:
    """A ball of radius R spreads over R/2 along every axis, a disc over R/2 within its plane."""
    radius, at = 0.2, np.array([0.3, 1.5, -0.2])
    ball = lamp_from(placed(sphere(radius, 64, 32), tuple(at)))
    seen_from = below((0, 0), (2, 1), (-2, 2))
    away = np.linalg.norm(seen_from - at, axis=1)
    exact = 2 * np.pi * (1 - np.sqrt(1 - (radius / away) ** 2))
    np.testing.assert_allclose(ball.solid_angles(seen_from), exact, rtol=0.015)
    np.testing.assert_allclose(ball.spread_from(seen_from), np.eye(3) * radius**2 / 4, atol=0.02 * radius**2 / 4)
    np.testing.assert_allclose(ball.centre, at, atol=1e-3)

    lid = cylinder(radius, 0.01, 64)
    faces = lid.faces[(lid.positions[lid.faces][..., 1] < 1e-6).all(axis=1)]
    down = lamp_from(placed(replace(lid, faces=faces), tuple(at)))
    assert (down.areas[:, 1] < 0).all(), "the lid faces the floor"
    spread = down.spread_from(seen_from)
    np.testing.assert_allclose(spread, np.diag([1, 0, 1]) * radius**2 / 4, atol=0.03 * radius**2 / 4)
    facing = at[1] * np.pi * radius**2 / away**3
    np.testing.assert_allclose(down.solid_angles(seen_from), facing, rtol=0.02)
    assert (down.solid_angles(seen_from + np.array([0, 4, 0])) == 0).all(), "nothing shines on the other side"


def test_places_of_a_lamp_stand_for_its_area() -> None:
    """Their areas add up to that of all triangles which face the point."""
    ball = lamp_from(placed(sphere(0.2, 48, 24), (0.0, 1.0, 0.0)))
    towards = np.array([0.5, 0.0, 0.2])
    places, areas = ball.light_points(towards[None])
    facing = ((towards - ball.middles) * ball.areas).sum(axis=1) > 0
    assert 16 <= len(places) <= POINTS
    np.testing.assert_allclose(areas.sum(axis=0), ball.areas[facing].sum(axis=0), rtol=1e-9)
    assert np.linalg.norm(places - ball.centre, axis=1).max() < 0.2


def test_the_projection_of_a_place_has_the_reflector_for_its_picture() -> None:
    """What lies on the way from the place to a point of the plane is drawn on the texel of that point."""
    place, rng = np.array([0.4, 2.0, -0.3]), np.random.default_rng(3)
    columns, rows = rng.uniform(0, SQUARE.size[0], 50), rng.uniform(0, SQUARE.size[1], 50)
    on_plane = SQUARE.points(columns, rows)
    between = place + rng.uniform(0.05, 0.95, (50, 1)) * (on_plane - place)
    clip = np.column_stack([between, np.ones(50)]) @ SQUARE.clip_from_world(place, PLANE, 1e-3, np.zeros(2)).T
    assert (clip[:, 3] > 0).all() and (clip[:, 2] > 0).all() and (clip[:, 2] < clip[:, 3]).all()
    got = (clip[:, :2] / clip[:, 3:] * [1, -1] + 1) / 2 * SQUARE.size
    np.testing.assert_allclose(got, np.stack([columns, rows], axis=-1), atol=1e-6)
    texel = np.column_stack([on_plane, np.ones(50)]) @ SQUARE.texel_rows().T
    np.testing.assert_allclose(texel, np.stack([columns, rows], axis=-1), atol=1e-9)
    others = (
        np.array([[0.1, -0.2, 0.3, 1], [0.1, 2.2, 0.3, 1]]) @ SQUARE.clip_from_world(place, PLANE, 0, np.zeros(2)).T
    )
    assert ((others[:, 2] < 0) | (others[:, 3] < 0)).all(), "below the plane, and above the place"


def test_a_map_of_a_lamp_behind_an_edge(device: Any) -> None:
    """Half a plate hides a ball from part of the floor: the share that is seen is known by rays at the ball's disc."""
    radius, at, high = 0.2, np.array([0.0, 2.0, 0.0]), 1.0
    ball = placed(sphere(radius, 48, 24), tuple(at))
    plate = patch((0.0, high, 3.0), (3.0, 0, 0), (0, 0, -6.0))  # x > 0
    scene = scene_of(mirror(0.1))
    meshes = {"plate": plate, "ball": ball, "floor": patch((-3, 0, 3), (6, 0, 0), (0, 0, -6))}
    scene = planar_like(scene, meshes)
    layouts = Layouts(device)
    seen = lamp_map(layouts, SceneResources(layouts, scene), [lamp_from(ball, "ball")], SQUARE, PLANE, 1e-4)
    assert seen.shape == (*SQUARE.size[::-1], MOST) and (seen[..., 1:] == 0).all()
    x = np.linspace(-1.2, 1.2, 25)
    texel = np.column_stack([x, np.zeros(25), np.zeros(25), np.ones(25)]) @ SQUARE.texel_rows().T
    got = seen[texel[:, 1].astype(int), texel[:, 0].astype(int), 0].astype(float)
    away = np.hypot(x, 2.0)
    offset = [distance_of_edge(one, at, high) / radius for one in x]
    share = np.array([segment(np.clip(one, -1, 1)) for one in offset])
    whole = 2 * np.pi * (1 - np.sqrt(1 - (radius / away) ** 2))
    assert 3 < ((share > 0) & (share < 1)).sum() < 20
    np.testing.assert_allclose(got, share * whole, atol=0.08 * whole.max())
    assert np.abs(got - share * whole).mean() < 0.012 * whole.max()


def distance_of_edge(x: float, at: np.ndarray, high: float) -> float:
    """Signed distance (m) of a ball's centre `at` from the plane through (x, 0, z) and the edge (0, high, z)."""
    point, edge = np.array([x, 0.0]), np.array([0.0, high])
    along = (edge - point) / np.linalg.norm(edge - point)
    normal = np.array([-along[1], along[0]])  # towards x < 0
    return float((at[:2] - point) @ normal)


def segment(offset: float) -> float:
    """Share of a unit disc on the seen side of a line at the signed distance `offset` of its centre."""
    return float(0.5 + (offset * np.sqrt(1 - offset * offset) + np.arcsin(offset)) / np.pi)


def planar_like(scene: Any, meshes: dict[str, Mesh]) -> Any:
    """A scene of `meshes` with the materials and the reflector of `scene_of`."""
    made = unbaked_scene(meshes, Material(name="paint", kd=0.5), np.full((6, 4, 4, 3), 0.1, np.float32))
    materials = {"paint": made.record.materials["paint"], "floor": scene.record.materials["floor"]}
    objects = tuple(o.model_copy(update={"material": "floor"}) if o.name == "floor" else o for o in made.record.objects)
    update = {"objects": objects, "materials": materials, "reflectors": (FLOOR,)}
    return replace(made, record=made.record.model_copy(update=update))


def test_lamps_are_connected_parts_of_emitting_objects() -> None:
    """The brightest objects, all parts of each or none; what the reflector holds, or is below it, is no lamp of it."""
    bulbs = merge([placed(sphere(0.05, 16, 8), (x, 1.0, 0.0)) for x in (-1.0, 0.0, 1.0)])
    lamps = {
        "bulbs": (bulbs, (5.0, 5.0, 5.0)),
        "bright": (placed(sphere(0.05, 16, 8), (0.5, 1.0, 0.5)), (90.0, 90.0, 90.0)),
        "dim": (placed(sphere(0.05, 16, 8), (0.5, 1.0, -0.5)), (0.1, 0.1, 0.1)),
        "low": (placed(sphere(0.05, 16, 8), (0.0, -1.0, 0.0)), (500.0, 500.0, 500.0)),
        "wall of light": (patch((-3, 0.5, -2), (6, 0, 0), (0, 3, 0)), (9.0, 9.0, 9.0)),
    }
    scene = planar_scene.planar_scene(ROUND, lamps)
    found = lamps_of(scene)
    assert [lamp.object for lamp in found] == ["bulbs"] * 3 + ["bright", "dim", "low", "wall of light"]
    (reflector,) = scene.record.reflectors
    assert [lamp.object for lamp in over(found, reflector, PLANE, 1e-4)] == ["bright", "bulbs", "bulbs", "bulbs"]
    assert [lamp.object for lamp in over(found, reflector, -PLANE, 1e-4)] == ["low"]


@pytest.mark.parametrize("lobe", [ROUND, BRUSHED, GGX], ids=["round", "brushed", "ggx"])
def test_two_lamps_are_those_of_rays(device: Any, lobe: Lobe) -> None:
    """At three samples the picture is nearer to ray casting than seven samples of the buffer with its lamps."""
    exact, floor = planar_scene.exact_reflection(lobe, planar_scene.CAMERA, WIDTH, HEIGHT, 256, lamps=TWO)
    reference, state = Reference.of(exact, floor), floor_state(lobe, WIDTH, HEIGHT)
    renderer = Renderer(device, planar_scene.planar_scene(lobe, TWO))

    def psnr(integrator: str, n: int) -> float:
        return reference.errors(renderer.image(replace(state, integrator=integrator, n=n)))["psnr"]

    for n in (1, 3, 7):
        assert psnr("lamps", n) > psnr("rings", n) + 2, n
    assert psnr("lamps", 3) > psnr("rings", 7)


def dark(lamps: planar_scene.Lamps, lobe: Lobe) -> Any:
    """The scene of the bench with nothing but its lamps to see."""
    scene = planar_scene.planar_scene(lobe, lamps)
    probes = {name: replace(probe, radiance=probe.radiance * 0) for name, probe in scene.probes.items()}
    light = np.zeros_like(scene.irradiance)
    return replace(scene, irradiance=light, environment=scene.environment * 0, probes=probes)


@pytest.mark.parametrize("lobe", [ROUND, BRUSHED, GGX], ids=["round", "brushed", "ggx"])
def test_a_lamp_has_one_highlight_at_any_n(device: Any, lobe: Lobe) -> None:
    one = {"globe": TWO["globe"]}
    renderer = Renderer(device, dark(one, lobe))
    camera = Camera(name="c", position=(-0.25, 1.4, 3.4), target=(-0.25, 0.0, 1.6), fov_y_deg=30.0)
    state = replace(floor_state(lobe, 128, 96), camera=camera)
    for n in (1, 2, 3, 5, 7):
        found = {name: renderer.image(replace(state, integrator=name, n=n))[..., 1] for name in ("lamps", "rings")}
        assert second_highlight(found["lamps"]) < 0.02, n
        assert n > 3 or second_highlight(found["rings"]) > 0.04, "the measure sees beads"


def test_light_is_kept_and_nothing_pops_from_mirror_to_matte(device: Any) -> None:
    """Steps of 4 % in roughness: the floor's light changes by little."""
    lamps = {"globe": (TWO["globe"][0], (1.0, 1.0, 1.0))}
    renderer = Renderer(device, dark(lamps, ROUND))
    camera = Camera(name="c", position=(-0.25, 1.4, 3.4), target=(-0.25, 0.0, 1.6), fov_y_deg=40.0)
    steps = np.geomspace(0.01, 0.5, 100)

    def image(m: float, **more: Any) -> np.ndarray:
        state = replace(floor_state(Lobe(mx=m, my=m, r0=0.9, alpha=0.5), 64, 48), camera=camera, n=7)
        return renderer.image(replace(state, **more)).astype(float)

    shown = [image(m, integrator="lamps") for m in steps]
    total = np.array([one.mean() for one in shown])
    assert (np.abs(np.diff(np.log(total))) < 0.06).all(), np.abs(np.diff(np.log(total))).max()
    encoded = [np.clip(one / 0.05, 0, 1) ** (1 / 2.2) for one in shown]
    change = np.array([np.abs(b - a).mean() for a, b in itertools.pairwise(encoded)])
    usual = np.array([np.median(change[max(i - 8, 0) : i + 9]) for i in range(len(change))])
    assert (change < 3 * usual + 0.002).all(), (change / usual).max()


def test_a_lamp_is_as_bright_as_its_object(device: Any) -> None:
    """Switched off and on again, as a mix of light does."""
    renderer = Renderer(device, dark({"globe": TWO["globe"]}, ROUND))
    state = replace(floor_state(ROUND, 64, 48), n=3, integrator="lamps")
    (item,) = (one for one in renderer.resources.objects if one.record.name == "globe")
    lit, emission = renderer.image(state), item.emission
    item.relight(item.light, (0.0, 0.0, 0.0))
    assert lit.max() > 0 and not renderer.image(replace(state, mixed=1)).any()
    item.relight(item.light, emission)
    np.testing.assert_array_equal(renderer.image(replace(state, mixed=2)), lit)


def test_mirrors_and_other_integrators_keep_the_buffer(device: Any) -> None:
    """A lobe narrower than all lamps is drawn as without them, to the bit."""
    narrow = Lobe(mx=0.004, my=0.004, r0=0.9)
    renderer = Renderer(device, planar_scene.planar_scene(narrow, TWO))
    state = floor_state(narrow, 64, 48)
    lamps, rings = (renderer.image(replace(state, integrator=name, n=3)) for name in ("lamps", "rings"))
    np.testing.assert_array_equal(lamps, rings)


def test_frames_that_do_not_wait_show_lamps_as_mirrored_until_their_map_is_there(device: Any) -> None:
    state = replace(floor_state(ROUND, 64, 48), n=3, integrator="lamps")
    scene = planar_scene.planar_scene(ROUND, TWO)
    expected = Renderer(device, scene).image(state)
    renderer = Renderer(device, scene)
    renderer.waits, before = False, renderer.light_version
    first = renderer.image(state)
    np.testing.assert_array_equal(first, renderer.image(replace(state, integrator="rings")))
    assert np.abs(first - expected).max() > 0.01 * expected.max()
    for _ in range(1000):
        renderer.image(replace(state, integrator="diffuse"))  # frames of any kind go on with the map
        if renderer.light_version > before:
            break
    np.testing.assert_array_equal(renderer.image(state), expected)


def test_a_lamp_that_leaves_the_view_does_not_go_out(device: Any) -> None:
    """While a camera turns, the mirrored view loses the lamp: the floor's light goes on in small steps."""
    renderer = Renderer(device, planar_scene.planar_scene(ROUND, TWO))
    totals = []
    for turn in np.linspace(0.0, 1.4, 29):
        target = (0.5 + 3 * np.sin(turn), 0.2, 4.2 - 3 * np.cos(turn))
        camera = replace(planar_scene.CAMERA, target=target)
        state = replace(floor_state(ROUND, 64, 48), camera=camera, n=7, integrator="lamps")
        totals.append(float(renderer.image(state).mean()))
    steps = np.abs(np.diff(totals))
    assert steps.max() < 4 * np.median(steps) + 0.01 * max(totals), totals
