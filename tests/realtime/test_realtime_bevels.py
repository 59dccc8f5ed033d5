"""The bevel of a mirror shows what stands before the mirror, as rays from it meet it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.core.arrays import Floats
from lambent.core.camera import Camera, image_plane
from lambent.core.directions import normalize, reflect
from lambent.core.geometry import triangle_normals
from lambent.materials.document import Lobe, Material
from lambent.realtime.baked import BakedScene, Probe
from lambent.realtime.bevels import FLAT, Bevels
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.realtime.unbaked import unbaked_scene
from lambent.scenes.geometry import box, merge, patch, placed
from lambent.store.contract import ReflectorPart, ReflectorRecord

CAMERA = Camera(name="c", position=(1.2, 0.5, 1.6), target=(0.5, 0.5, 0.0), fov_y_deg=24)
WIDTH, HEIGHT = 240, 160
GLOW = {"wall": (0.2, 0.6, 0.9), "post": (2.0, 0.3, 0.1), "frame": (0.1, 0.8, 0.2), "mirror": (0.0, 0.0, 0.0)}
MIRROR = ReflectorRecord(
    plane=(0, 0, 1, 0),
    outline=((-0.5, 0, 0), (0.5, 0, 0), (0.5, 1, 0), (-0.5, 1, 0)),
    parts=(ReflectorPart(object="mirror", faces=(0, 1), area_m2=1),),
)


def bevelled_mirror(drop_m: float = 0.008, framed: bool = True) -> BakedScene:
    """A mirror whose right edge is cut, a frame beside it, a post before it, and a wall, all that its probe sees."""
    meshes = {
        "mirror": merge([patch((-0.5, 0, 0), (1, 0, 0), (0, 1, 0)), patch((0.5, 0, 0), (0.08, 0, -drop_m), (0, 1, 0))]),
        **({"frame": placed(box((0.04, 1.0, 0.06)), (0.6, 0.5, 0.01))} if framed else {}),
        "post": placed(box((0.06, 0.5, 0.06)), (0.48, 0.4, 0.25)),
        "wall": patch((3, -2, 3), (-9, 0, 0), (0, 5, 0)),
    }
    scene = unbaked_scene(meshes, Material(name="paint", kd=0.5), np.zeros((6, 4, 4, 3), np.float32))
    glass = Material(name="glass", lobes=(Lobe(mx=0.002, my=0.002, r0=1.0, alpha=0.5),))
    objects = tuple(
        o.model_copy(update={"emission": GLOW[o.name], "material": "glass" if o.name == "mirror" else "paint"})
        for o in scene.record.objects
    )
    materials = {"paint": scene.record.materials["paint"], "glass": glass}
    record = scene.record.model_copy(update={"objects": objects, "materials": materials, "reflectors": (MIRROR,)})
    far = Probe((0.0, 0.0, 0.5), np.full((6, 4, 4, 3), GLOW["wall"], np.float32))  # sees the wall alone
    return replace(scene, record=record, probes=dict.fromkeys(meshes, far))


def met(scene: BakedScene, origins: Floats, ways: Floats) -> tuple[Floats, Floats]:
    """Numbers of the first faces (n,) along rays, -1 for none, and the distances (n,)."""
    number, nearest = np.full(len(origins), -1), np.full(len(origins), np.inf)
    for i, (a, b, c) in enumerate(scene.positions[scene.faces].astype(float)):
        n = np.cross(b - a, c - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = ((a - origins) @ n) / (ways @ n)
        at = origins + t[:, None] * ways
        inside = np.all([np.cross(q - p, at - p) @ n >= -1e-9 for p, q in ((a, b), (b, c), (c, a))], axis=0)
        closer = inside & (t > 1e-6) & (t < nearest)
        number[closer], nearest[closer] = i, t[closer]
    return number, nearest


def glow(scene: BakedScene, faces: Floats) -> Floats:
    """Emission (n, 3) of faces."""
    table = np.concatenate([np.tile(GLOW[o.name], (o.face_count, 1)) for o in scene.record.objects])
    return np.where((faces >= 0)[:, None], table[faces], 0.0)


@pytest.mark.parametrize(("framed", "least"), [(False, 0.9), (True, 0.45)])
def test_a_bevel_shows_the_post_before_it(device: Any, framed: bool, least: float) -> None:
    """A frame hides part of the post from the mirrored eye, not from the bevel."""
    scene = bevelled_mirror(framed=framed)
    asked = FrameState(CAMERA, WIDTH, HEIGHT, antialias=False, show="specular")
    image = Renderer(device, scene).image(asked).reshape(-1, 3)
    across, up, forward = image_plane(CAMERA, WIDTH, HEIGHT)
    x, y = np.meshgrid((np.arange(WIDTH) + 0.5) / WIDTH * 2 - 1, 1 - (np.arange(HEIGHT) + 0.5) / HEIGHT * 2)
    ways = normalize(forward + x.reshape(-1, 1) * across + y.reshape(-1, 1) * up)
    eye = np.tile(CAMERA.position, (len(ways), 1))
    seen, t = met(scene, eye, ways)
    bevel = np.isin(seen, (2, 3))
    normals = triangle_normals(scene.positions[scene.faces].astype(float))[seen[bevel]]
    behind, _ = met(scene, (eye + t[:, None] * ways)[bevel], reflect(-ways[bevel], normals))
    expected = glow(scene, behind)
    posts = expected[:, 0] == GLOW["post"][0]
    assert bevel.sum() > 500 and 50 < posts.sum() < 0.9 * bevel.sum()
    right = np.abs(image[bevel] - expected).max(axis=1) < 0.15
    assert right[~posts].mean() > 0.9 and right[posts].mean() > least


def test_only_what_falls_off_a_little_is_a_bevel() -> None:
    for drop_m in (0.004, 0.012):
        found = Bevels(bevelled_mirror(drop_m)).of(MIRROR)
        assert found.depth_m == pytest.approx(drop_m, rel=1e-3)
        assert found.least_cos == pytest.approx(np.cos(np.arctan(drop_m / 0.08)), abs=2e-3)
    for drop_m in (-0.008, 0.03):  # rises, and falls off by 20 degrees
        assert Bevels(bevelled_mirror(drop_m)).of(MIRROR) == FLAT
