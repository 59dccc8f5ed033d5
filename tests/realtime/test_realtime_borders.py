"""Near a cut through an object, the mixed light of both probes is nearer to path tracing than either part's alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from lambent.bake.bake import bake
from lambent.core.pictures.metrics import display_pair, flip_error
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import BakedScene, read_baked
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import box, merge, patch, placed, sphere
from lambent.scenes.scene import Mesh, ReflectorRule, Scene, SceneObject
from tests.bake.small_scenes import GREY, TINY, turned_inwards

SIZE = 160, 120
LIT = ("light_map", "probe", "probe_share")
QUALITY = TINY.changed("bordered", probe={"texels": 64, "samples": 16})
METAL = Material(name="metal", lobes=(Lobe(mx=0.1, my=0.1, r0=0.9),))
SIDES = ((-3, (1.0, 0.3, 0.1)), (3, (0.1, 0.4, 1.0)))


def room(*objects: SceneObject, camera: Camera) -> Scene:
    """A grey room of 6 x 3 x 6 m, its left wall shines red, its right one blue; a lamp over all."""
    walls = [
        SceneObject(f"wall{x}", patch((x * 0.99, 0, -x), (0, 0, 2 * x), (0, 3, 0)), "grey", emission=colour)
        for x, colour in SIDES
    ]
    shell = SceneObject("shell", placed(turned_inwards(box((6, 3, 6))), (0, 1.5, 0)), "grey")
    lamp = SceneObject("lamp", patch((-1.0, 2.98, -1.0), (2, 0, 0), (0, 0, 2)), "grey", emission=(5.0, 5.0, 5.0))
    materials = {"grey": GREY, "metal": METAL}
    probes_alone = (ReflectorRule("*", use=False),)
    return Scene("room", (shell, lamp, *walls, *objects), materials, cameras=(camera,), reflector_rules=probes_alone)


def cabinet() -> Scene:
    """A cabinet around the outer corner of a wall, one wing on each side of it."""
    long = placed(box((0.3, 0.9, 2.0)), (-0.35, 1.2, 0.6))
    short = placed(box((1.7, 0.9, 0.3)), (0.65, 1.2, 1.45))
    wall = placed(box((2.6, 3, 2.6)), (1.1, 1.5, -0.0))
    both: Mesh = merge([long, short])
    camera = Camera(name="corner", position=(-1.6, 1.8, 2.7), target=(0.0, 1.2, 1.0), fov_y_deg=50.0)
    globe = SceneObject("globe", placed(sphere(0.12, 24, 12), (-1.1, 0.9, -0.5)), "grey", emission=(6.0, 5.0, 3.0))
    return room(SceneObject("cabinet", both, "metal"), SceneObject("inner", wall, "grey"), globe, camera=camera)


def hard(scene: BakedScene) -> BakedScene:
    """Each part in the light of its own probe alone."""
    objects = tuple(o.model_copy(update={"borders": ()}) for o in scene.record.objects)
    return replace(scene, record=scene.record.model_copy(update={"objects": objects}))


def pictures(scene: Scene, baked: BakedScene, camera: Camera, device: Any, spp: int = 64) -> tuple[np.ndarray, ...]:
    """Path traced, with parts mixed, and with a hard border."""
    from lambent.bake.reference.path_traced import render_reference

    state = FrameState(camera, *SIZE, antialias=False)
    mixed, cut = (Renderer(device, one).image(state) for one in (baked, hard(baked)))
    return render_reference(scene, camera, *SIZE, spp)[0], mixed, cut


def test_light_near_a_border_is_nearer_to_path_tracing(tmp_path: Path, device: Any) -> None:
    scene = cabinet()
    baked = read_baked(bake(scene, tmp_path / "s", quality=QUALITY, only=LIT))
    truth, mixed, cut = pictures(scene, baked, scene.cameras[0], device)
    seam = np.abs(mixed - cut).max(axis=-1) > 0.05 * truth.mean()
    assert 0.004 < seam.mean() < 0.2
    errors = [flip_error(*display_pair(truth, image))[seam].mean() for image in (mixed, cut)]
    assert errors[0] < 0.95 * errors[1], errors
