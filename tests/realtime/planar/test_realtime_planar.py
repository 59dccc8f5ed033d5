"""Planar reflectors: the buffer holds the scene from the mirrored camera, and its light is right."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.views.camera import Camera, clip_from_world, image_plane
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.structs import FRAME_DTYPE
from lambent.realtime.integrators.albedo import gains
from lambent.realtime.integrators.patterns import lobe_points
from lambent.realtime.light.baked import BakedScene, Probe
from lambent.realtime.objects.unbaked import unbaked_scene
from lambent.realtime.planar.planar_integrators import interleaved_table
from lambent.realtime.planar.planar_view import (
    covered_share,
    on_screen,
    planar_views,
)
from lambent.realtime.renderer import Renderer
from lambent.scenes.floor_plan import floor_plan
from lambent.scenes.geometry import box, patch, placed, sphere
from lambent.scenes.scene import MaterialTextures, Texture
from lambent.store.contract import PlanRecord, ReflectorPart, ReflectorRecord
from lambent.store.plans import plan_record

CAMERA = Camera(name="c", position=(0.4, 1.3, 3.0), target=(0.1, 0.4, 0.0), fov_y_deg=50)


FLOOR = ReflectorRecord(
    plane=(0, 1, 0, 0),
    outline=((-3, 0, -3), (-3, 0, 3), (3, 0, 3), (3, 0, -3)),
    parts=(ReflectorPart(object="floor", faces=(0, 1), area_m2=36),),
)


WIDTH, HEIGHT = 96, 64


def mirror(m: float, **more: Any) -> Material:
    return Material(name="floor", lobes=(Lobe(mx=m, my=m, r0=1.0, alpha=0.5, **more),))


def scene_of(material: Material, floor: bool = True) -> BakedScene:
    """A wall, a box and a ball, each with light of its own, on a floor; a sky of one colour and a dark probe."""
    meshes = {
        "wall": patch((-3, 0, -2), (6, 0, 0), (0, 3, 0)),
        "box": placed(box((0.6, 0.8, 0.6)), (-0.7, 0.4, 0.2)),
        "ball": placed(sphere(0.3, 24, 12), (0.8, 0.5, 0.6)),
        **({"floor": patch((-3, 0, 3), (6, 0, 0), (0, 0, -6))} if floor else {}),
    }
    scene = unbaked_scene(meshes, Material(name="paint", kd=0.5), np.full((6, 4, 4, 3), (0.2, 0.4, 0.8), np.float32))
    glow = {"wall": (0.9, 0.7, 0.2), "box": (2.0, 0.3, 0.3), "ball": (0.2, 1.5, 0.4)}
    objects = tuple(
        o.model_copy(
            update={"emission": glow.get(o.name, (0, 0, 0)), "material": "floor" if o.name == "floor" else "paint"}
        )
        for o in scene.record.objects
    )
    dark = Probe((0.0, 0.0, 0.0), np.zeros((6, 4, 4, 3), np.float32))
    update = {
        "objects": objects,
        "materials": {"paint": scene.record.materials["paint"], "floor": material},
        "reflectors": (FLOOR,) if floor else (),
    }
    record = scene.record.model_copy(update=update)
    return replace(scene, record=record, probes=dict.fromkeys(meshes, dark))


def state(**more: Any) -> FrameState:
    return FrameState(CAMERA, WIDTH, HEIGHT, antialias=False, **more)


def frame_of(camera: Camera, width: int = WIDTH, height: int = HEIGHT) -> np.void:
    data = np.zeros((), FRAME_DTYPE)
    data["clip_from_world"] = clip_from_world(camera, width, height, 0.01).T
    data["eye"][:3] = camera.position
    for name, axis in zip(("across", "up", "forward"), image_plane(camera, width, height), strict=True):
        data[name][:3] = axis
    return data


@pytest.fixture(scope="module")
def seen_below(device: Any) -> np.ndarray:
    """The scene without its floor from the mirrored camera, turned to lie on the frame; and what the frame sees."""
    (x, y, z), (u, v, w) = CAMERA.position, CAMERA.target
    below = replace(CAMERA, position=(x, -y, z), target=(u, -v, w), up=(0, -1, 0))
    return Renderer(device, scene_of(mirror(0.001), floor=False)).image(replace(state(), camera=below))[:, ::-1]


def test_a_sharp_mirror_shows_the_scene_from_the_mirrored_camera(device: Any, seen_below: np.ndarray) -> None:
    renderer = Renderer(device, scene_of(mirror(0.001)))
    image = renderer.image(state(n=3))
    floor = renderer.image(state(planar="off"))[..., 2] == 0  # the dark probe
    assert 0.2 < floor.mean() < 0.9
    difference = np.abs(image - seen_below).max(axis=-1)[floor]
    assert np.median(difference) < 0.01
    assert (difference < 0.1).mean() > 0.93  # edges are filtered
    wrong_hand = np.abs(image - seen_below[:, ::-1]).max(axis=-1)[floor]
    assert (wrong_hand < 0.1).mean() < 0.8


@pytest.mark.long
def test_a_retro_lobe_takes_nothing_from_the_mirrored_view(device: Any) -> None:
    """Its light is the probe's, here dark: beside a mirroring lobe nothing changes, alone the floor is dark."""
    both = mirror(0.02)
    back = Lobe(retro=True, mx=0.05, my=0.05, r0=1.0)
    asked = state(n=5)
    plain, with_it, alone = (
        Renderer(device, scene_of(both.model_copy(update={"lobes": lobes}))).image(asked)
        for lobes in (both.lobes, (*both.lobes, back), (back,))
    )
    np.testing.assert_allclose(with_it, plain, atol=0.02)
    floor = Renderer(device, scene_of(both)).image(state(planar="off"))[..., 2] == 0
    assert plain[floor].max() > 0.5 and alone[floor].max() < 0.01


def test_uniform_light_stays_uniform(device: Any) -> None:
    """White furnace: under one radiance everywhere, a floor with albedo 1 shows it."""
    scene = scene_of(mirror(0.05))
    record = scene.record.model_copy(update={"objects": scene.record.objects[-1:]})
    sky = np.ones((6, 4, 4, 3), np.float32)
    scene = replace(scene, record=record, environment=sky, probes={"floor": Probe((0, 0, 0), sky)})
    renderer = Renderer(device, scene)
    np.testing.assert_allclose(renderer.image(state(n=7))[HEIGHT // 2 :], 1.0, rtol=0.03)


@pytest.mark.long
def test_no_light_comes_in_below_the_walls(device: Any) -> None:
    """A closed room of radiance 1 under a sky of 1000: its floor of albedo 1 shows 1, up to the foot of every wall."""
    walls = {
        "back": patch((-2, 0, -2), (4, 0, 0), (0, 2, 0)),
        "front": patch((2, 0, 2), (-4, 0, 0), (0, 2, 0)),
        "left": patch((-2, 0, 2), (0, 0, -4), (0, 2, 0)),
        "right": patch((2, 0, -2), (0, 0, 4), (0, 2, 0)),
        "ceiling": patch((-2, 2, -2), (4, 0, 0), (0, 0, 4)),
    }
    scene = unbaked_scene(
        walls | {"floor": patch((-2, 0, 2), (4, 0, 0), (0, 0, -4))},
        Material(name="paint", kd=0.0),
        np.full((6, 4, 4, 3), 1000.0, np.float32),
    )
    floor = scene.record.objects[-1].model_copy(update={"material": "floor"})
    lit = tuple(o.model_copy(update={"emission": (1, 1, 1)}) for o in scene.record.objects[:-1])
    outline = ((-2, 0, -2), (-2, 0, 2), (2, 0, 2), (2, 0, -2))
    corners = scene.positions[scene.faces].astype(float)
    plan = floor_plan(corners[-2:], np.array((0.0, 1.0, 0.0)), corners[:-2])
    assert plan is not None
    one = Probe((0.0, 1.0, 0.0), np.ones((6, 4, 4, 3), np.float32))
    camera = Camera(name="low", position=(0.5, 0.6, 1.6), target=(-0.2, 0.2, -2.0), fov_y_deg=50)

    def seen(plan: PlanRecord | None) -> np.ndarray:
        reflector = FLOOR.model_copy(update={"outline": outline, "plan": plan})
        materials = scene.record.materials | {"floor": mirror(0.15)}
        update = {"objects": (*lit, floor), "materials": materials, "reflectors": (reflector,)}
        made = replace(scene, record=scene.record.model_copy(update=update), probes={"floor": one})
        return Renderer(device, made).image(replace(state(), camera=camera))[HEIGHT // 2 :]

    closed = seen(plan_record(plan))
    assert closed.max() < 1.1
    assert closed.min() > 0.6  # towards grazing a single lobe returns less
    assert seen(None).max() > 10


def test_only_reflectors_in_view_cost_a_mirror(device: Any) -> None:
    renderer = Renderer(device, scene_of(mirror(0.05)))
    for target, mirrors in (((0.1, 0.4, 0.0), 1), ((0.4, 2.9, 3.05), 0)):
        renderer.draw(replace(state(), camera=replace(CAMERA, target=target)))
        assert renderer.statistics["mirrors"] == mirrors
    renderer.draw(replace(state(), camera=replace(CAMERA, position=(0.4, -1.3, 3.0))))
    assert renderer.statistics["mirrors"] == 0  # seen from behind
    renderer.draw(state(planar="off"))
    assert renderer.statistics["mirrors"] == 0
    with pytest.raises(UserError, match="auto"):
        renderer.draw(state(planar="aut"))


def test_mirror_view_projects_and_clips() -> None:
    (view,) = planar_views(frame_of(CAMERA), [FLOOR], WIDTH, HEIGHT, 4)
    clip = view.frame["clip_from_world"].T.astype(float)
    eye = view.frame["eye"][:3].astype(float)
    np.testing.assert_allclose(eye, (0.4, -1.3, 3.0), atol=1e-6)
    rng = np.random.default_rng(1)
    for x, y in rng.uniform(-1, 1, (20, 2)):
        ray = view.frame["forward"] + x * view.frame["across"] + y * view.frame["up"]
        ray = ray[:3].astype(float)
        if ray[1] <= 0:
            continue
        to_floor = 1.3 / ray[1]
        depths = []
        for t in (to_floor * 1.0005, 2 * to_floor, 50 * to_floor, 1e6):
            p = clip @ [*(eye + t * ray), 1]
            np.testing.assert_allclose(p[:2] / p[3], (x, y), atol=1e-4)
            depths.append(p[2] / p[3])
        assert all(near > far for near, far in pairwise(depths))
        assert depths[-1] >= 0
        assert depths[0] <= 1.001
        below = clip @ [*(eye + 0.9 * to_floor * ray), 1]
        assert below[2] > below[3]  # before the near plane


def test_covered_share_of_a_square_that_fills_half_the_frame() -> None:
    camera = Camera(name="c", position=(0, 0, 1), target=(0, 0, 0), fov_y_deg=90)
    aspect = WIDTH / HEIGHT
    square = np.array([(-9, -9, 0), (0, -9, 0), (0, 9, 0), (-9, 9, 0)], float)
    assert covered_share(on_screen(frame_of(camera), square)) == pytest.approx(0.5, abs=1e-6)
    inner = np.array([(-aspect / 2, -0.5, 0), (aspect / 2, -0.5, 0), (aspect / 2, 0.5, 0), (-aspect / 2, 0.5, 0)])
    assert covered_share(on_screen(frame_of(camera), inner)) == pytest.approx(0.25, abs=1e-6)
    assert covered_share(on_screen(frame_of(camera), inner + np.array([0, 0, 2]))) == 0


def test_spirals_of_a_tile_share_the_lobe_evenly() -> None:
    lobe = Lobe(mx=0.1, my=0.05)
    rows = interleaved_table(lobe, 7)
    assert rows.shape == (7 * 65, 4)
    slopes = (rows[7:, :2] / [0.1, 0.05]).reshape(64, 7, 2)
    mass = np.sort(1 - np.exp(-(slopes**2).sum(axis=-1)), axis=None)
    np.testing.assert_allclose(mass, (np.arange(448) + 0.5) / 448, atol=1e-5)
    assert np.abs(slopes.mean(axis=(0, 1))).max() < 0.02
    for first in range(4):  # what four rows of four pixels have between them
        assert np.abs(slopes[first::4].mean(axis=(0, 1))).max() < 0.05


def test_the_eye_lies_as_far_under_a_raised_floor_as_it_stands_over_it() -> None:
    plan = PlanRecord(
        corner=(-3, 0.5, -3), across=(1, 0, 0), along=(0, 0, -1), cell_m=0.1, rows=2, columns=2, packed=""
    )
    raised = FLOOR.model_copy(update={"plane": (0, 1, 0, -0.5), "plan": plan})
    (view,) = planar_views(frame_of(CAMERA), [raised], WIDTH, HEIGHT, 4)
    assert view.plan is not None
    assert float(view.plan["below"]) == pytest.approx(1.3 - 0.5)
    np.testing.assert_allclose(view.frame["eye"][:3], (0.4, 2 * 0.5 - 1.3, 3.0), atol=1e-6)


@pytest.mark.long
def test_the_light_map_scales_what_the_mirrored_view_does_not_hold(device: Any) -> None:
    """A floor that the probe's light does not reach looks as with a dark probe, beside its mirrored view as well."""
    scene = scene_of(mirror(0.2))
    white = Probe((0.0, 0.5, 0.0), np.ones((6, 4, 4, 3), np.float32))
    asked = state(n=7, show="specular")

    def shown(probe: Probe, share: float | None) -> np.ndarray:
        probes = {**scene.probes, "floor": probe}
        more: dict[str, Any] = {}
        if share is not None:
            values = np.tile(np.array([share, 0, 0, 0], np.float32), (*scene.irradiance.shape[:2], 1))
            more = {"probe_share": values, "share_objects": frozenset(["floor"])}
        return Renderer(device, replace(scene, probes=probes, **more)).image(asked)

    dark, bright = shown(scene.probes["floor"], None), shown(white, None)
    assert (bright - dark).max() > 0.05, "some of the lobe is not in the mirrored view"
    np.testing.assert_allclose(shown(white, 0.0), dark, atol=5e-3)
    np.testing.assert_allclose(shown(white, 1.0), bright, atol=5e-3)


def constant(*values: float) -> Texture:
    return Texture(np.array(values, np.float16)[None, None])


@pytest.mark.long
def test_masked_reflectors_are_drawn_in_motion(device: Any) -> None:
    """Pixels that a masked planar reflector covers in part are blended as those of other masked surfaces."""
    opaque = np.random.default_rng(5).random((8, 8, 1)).astype(np.float16)
    scene = scene_of(mirror(0.05))
    masked = replace(scene, textures={"floor": MaterialTextures(opacity=Texture(opaque))})
    frame = FrameState(state().camera, 96, 64)
    drawn, whole = (Renderer(device, one).display_image(frame).astype(int) for one in (masked, scene))
    assert np.abs(drawn - whole).max() > 30
    solid = replace(scene, textures={"floor": MaterialTextures(opacity=constant(1.0))})
    np.testing.assert_array_equal(Renderer(device, solid).display_image(frame), whole)


def test_a_floor_at_a_grazing_angle_shows_its_whole_lobe(device: Any) -> None:
    """Under one radiance, viewers at cosines of .04 to .07 see its albedo there; not less of it.

    Reference: the mean of f cos_i/pdf over half vectors of the lobe (`realtime.integrators.albedo`).
    """
    scene = scene_of(mirror(0.05))
    sky = np.ones((6, 4, 4, 3), np.float32)
    record = scene.record.model_copy(update={"objects": scene.record.objects[-1:]})
    renderer = Renderer(device, replace(scene, record=record, environment=sky, probes={"floor": Probe((0, 0, 0), sky)}))
    low = Camera(name="low", position=(0.0, 0.2, 2.9), target=(0.0, 0.1, 0.0), fov_y_deg=20)
    asked = FrameState(low, WIDTH, HEIGHT, antialias=False, integrator="rings", show="specular")
    image = renderer.image(asked)
    across, up, forward = image_plane(low, WIDTH, HEIGHT)
    x, y = np.meshgrid((np.arange(WIDTH) + 0.5) / WIDTH * 2 - 1, 1 - (np.arange(HEIGHT) + 0.5) / HEIGHT * 2)
    rays = forward + x[..., None] * across + y[..., None] * up
    cos_o = -rays[..., 1] / np.linalg.norm(rays, axis=-1)
    lobe = mirror(0.05).lobes[0]
    seen = (cos_o > 0.04) & (cos_o < 0.07)
    slopes = lobe_points(4096, lobe) * lobe.mx
    albedo = gains(lobe, slopes, np.linspace(0.04, 0.07, 31))[1].mean(axis=1)
    expected = np.interp(cos_o[seen], np.linspace(0.04, 0.07, 31), albedo)
    assert seen.sum() > 500
    np.testing.assert_allclose(image[seen].mean(), expected.mean(), rtol=0.03)
