"""Parts of one object: near their borders the light of their probes is mixed, and adds up to one whole."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.core.views.camera import Camera, pixel_rays
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import BakedScene, Probe
from lambent.realtime.objects.parts import neighbouring_faces, reaches
from lambent.realtime.objects.unbaked import unbaked_scene
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import patch
from lambent.store.contract import ReflectorPart, ReflectorRecord

CAMERA = Camera(name="front", position=(0.1, 0.2, 3.0), target=(0.1, 0.2, 0.0), fov_y_deg=40.0)
SIZE = 96, 80
ACROSS = (1 / 0.6, 0.0, 0.0, -0.1 / 0.6)  # x = .1, mixed over .6 m
LOW, HIGH = (0.0, 2.5, 0.0, 0.0), (0.0, 4.0, 0.0, -0.8)  # left of it y = 0, right of it y = .2
LIGHTS = {"wall.part1": 1.0, "wall.part2": 5.0, "wall.part3": 2.0, "wall.part4": 9.0}


def turned(border: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(-x for x in border)


BORDERS = {
    "wall.part1": (turned(ACROSS), turned(LOW)),
    "wall.part2": (turned(ACROSS), LOW),
    "wall.part3": (ACROSS, turned(HIGH)),
    "wall.part4": (ACROSS, HIGH),
}


def wall_in_parts(material: Material, *, mixed: bool = True, lights: dict[str, float] | None = None) -> BakedScene:
    """A wall of four parts in the light of four probes, each of one colour."""
    meshes = {
        "wall.part1": patch((-4, -4, 0), (4.1, 0, 0), (0, 4, 0)),
        "wall.part2": patch((-4, 0, 0), (4.1, 0, 0), (0, 4, 0)),
        "wall.part3": patch((0.1, -4, 0), (4, 0, 0), (0, 4.2, 0)),
        "wall.part4": patch((0.1, 0.2, 0), (4, 0, 0), (0, 4, 0)),
    }
    scene = unbaked_scene(meshes, material, np.ones((6, 4, 4, 3), np.float32), irradiance=(1.0, 1.0, 1.0))
    given = {
        name: Probe((0, 0, 1), np.full((6, 4, 4, 3), light, np.float32)) for name, light in (lights or LIGHTS).items()
    }
    borders = BORDERS if mixed else dict.fromkeys(meshes, ())
    objects = tuple(o.model_copy(update={"part_of": "wall", "borders": borders[o.name]}) for o in scene.record.objects)
    return replace(scene, record=scene.record.model_copy(update={"objects": objects}), probes=given)


def places(camera: Camera = CAMERA) -> np.ndarray:
    """Points (H, W, 3) of the plane z = 0 that pixels show."""
    w = pixel_rays(camera, *SIZE)
    return np.asarray(camera.position) - w * (camera.position[2] / w[..., 2:])


def smoothstep(x: np.ndarray) -> np.ndarray:
    x = np.clip(x, 0, 1)
    return np.asarray(x * x * (3 - 2 * x))


def expected(p: np.ndarray) -> np.ndarray:
    """Radiance of the probes at points, mixed."""
    right, above = smoothstep(0.5 + (p[..., 0] - 0.1) / 0.6), [smoothstep(0.5 + p[..., 1] / 0.4)]
    above.append(smoothstep(0.5 + (p[..., 1] - 0.2) / 0.25))
    low, high, low_right, high_right = LIGHTS.values()
    return np.asarray(
        (1 - right) * ((1 - above[0]) * low + above[0] * high)
        + right * ((1 - above[1]) * low_right + above[1] * high_right)
    )


MIRROR = Material(name="m", lobes=(Lobe(mx=0.1, my=0.1, r0=1.0),))


@pytest.mark.parametrize("integrator", ["lamps", "split-sum"])
def test_light_of_parts_is_mixed_by_their_shares(device: Any, integrator: str) -> None:
    state = FrameState(CAMERA, *SIZE, integrator=integrator, show="specular", antialias=False)
    alone = Renderer(device, wall_in_parts(MIRROR, lights=dict.fromkeys(LIGHTS, 1.0))).image(state)
    image = Renderer(device, wall_in_parts(MIRROR)).image(state)
    hard = Renderer(device, wall_in_parts(MIRROR, mixed=False)).image(state)
    wanted = expected(places())[..., None] * alone
    np.testing.assert_allclose(image, wanted, rtol=0.01)
    assert np.abs(hard / wanted - 1).max() > 0.4
    lighter = np.abs(np.diff(image[..., 0] / alone[..., 0], axis=1)).max()
    assert lighter < 0.5 < np.abs(np.diff(hard[..., 0] / alone[..., 0], axis=1)).max()


def test_all_but_the_probes_is_shown_once(device: Any) -> None:
    """Emission and diffuse light are those of a wall that is not in parts, in a band of rows as well."""
    for material in (Material(name="m", kd=0.6), replace_kd(MIRROR)):
        even = dict.fromkeys(LIGHTS, 1.0)
        state = FrameState(CAMERA, *SIZE, antialias=False)
        whole, parts = (
            Renderer(device, wall_in_parts(material, mixed=mixed, lights=even)).image(state) for mixed in (False, True)
        )
        np.testing.assert_allclose(parts, whole, rtol=3e-3)


def replace_kd(material: Material) -> Material:
    return material.model_copy(update={"kd": (0.3, 0.2, 0.1)})


@pytest.mark.long
def test_parts_are_mixed_in_a_planar_mirror(device: Any) -> None:
    """A mirror on the floor shows the shares that the wall has where its rays end."""
    scene = wall_in_parts(MIRROR)
    floor = patch((-4, -1.0, 4.0), (8, 0, 0), (0, 0, -8))
    meshes = unbaked_scene({"floor": floor}, MIRROR, np.ones((6, 4, 4, 3), np.float32))
    count = len(scene.positions)
    record = meshes.record.objects[0].model_copy(
        update={"material": "floor", "first_face": len(scene.faces), "face_count": len(floor.faces)}
    )
    reflector = ReflectorRecord(
        plane=(0, 1, 0, 1.0),
        outline=((-4, -1, -4), (-4, -1, 4), (4, -1, 4), (4, -1, -4)),
        parts=(ReflectorPart(object="floor", faces=(0, 1), area_m2=64),),
    )
    sharp = Material(name="floor", lobes=(Lobe(mx=0.003, my=0.003, r0=1.0),))
    both = replace(
        scene,
        record=scene.record.model_copy(
            update={
                "objects": (*scene.record.objects, record),
                "materials": {**scene.record.materials, "floor": sharp},
                "reflectors": (reflector,),
            }
        ),
        **{
            name: np.concatenate([getattr(scene, name), getattr(meshes, name)])
            for name in ("positions", "normals", "tangents", "uv2", "uv")
        },
        faces=np.concatenate([scene.faces, meshes.faces + count]).astype(np.uint32),
        probes={**scene.probes, "floor": Probe((0, 0, 1), np.zeros((6, 4, 4, 3), np.float32))},
    )
    camera = Camera(name="down", position=(0.1, 0.3, 3.0), target=(0.1, -0.8, 0.0), fov_y_deg=40.0)
    state = FrameState(camera, *SIZE, antialias=False, show="specular")
    image = Renderer(device, both).image(state)
    even = replace(
        both, probes={**wall_in_parts(MIRROR, lights=dict.fromkeys(LIGHTS, 1.0)).probes, "floor": both.probes["floor"]}
    )
    alone = Renderer(device, even).image(state)
    w = pixel_rays(camera, *SIZE)
    eye = np.asarray(camera.position)
    t = -(eye[1] + 1) / w[..., 1]
    on_floor = eye + t[..., None] * w
    mirrored = w * (1, -1, 1)
    on_wall = on_floor - mirrored * (on_floor[..., 2:] / mirrored[..., 2:])
    shown = (t > 0) & (on_floor[..., 2] > 0.1) & (alone[..., 0] > 0.3)
    assert shown.mean() > 0.1
    ratio = image[shown][:, 0] / alone[shown][:, 0]
    wanted = expected(on_wall)[shown]
    assert np.ptp(wanted) > 1
    assert np.quantile(np.abs(ratio / wanted - 1), 0.95) < 0.05


def test_faces_out_of_reach_are_left_out() -> None:
    scene = wall_in_parts(MIRROR)
    found = neighbouring_faces(scene)
    assert set(found) == set(LIGHTS)
    assert found["wall.part1"] == [(2, 2), (4, 2)], "part 4 begins where its light ends"
    corners = scene.positions[scene.faces]
    assert not reaches(BORDERS["wall.part1"], corners[:, :1] * 0 + [[2.0, 0.0, 0.0]] * 3).any()
    far = [o.model_copy(update={"borders": ((0.0, 0.0, 1.0, -5.0),)}) for o in scene.record.objects]
    none = replace(scene, record=scene.record.model_copy(update={"objects": tuple(far)}))
    assert not any(neighbouring_faces(none).values())
