"""A room whose light map and probes need everything that is sent to other processes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from lambent.baking.bake import bake
from lambent.baking.running.workers import Workers
from lambent.core.progress import Progress, silent
from lambent.scenes.geometry import patch, placed, sphere
from lambent.scenes.photometry.luminous_surfaces import with_luminous_surfaces
from lambent.scenes.scene import MaterialTextures, Scene, SceneObject, Texture
from lambent.store.store import Store
from tests.baking.light.test_openings import OPENINGS, luminaire
from tests.baking.light.test_point_lamps import BULB
from tests.baking.sky.test_sky_guide import pit, sunny
from tests.baking.sky.test_sun_panes import MATERIALS
from tests.baking.small_scenes import MIRROR, TINY

TILED = TINY.changed("tiled", light_map={"samples": (8, 8), "gather_samples": 8, "tile_texels": 16})


def lit_room(folder: Path) -> Scene:
    """Lit through a pane in its ceiling, by a sun in the sky, two lamps and a glowing plate, onto bumps and mirrors."""
    dark = pit(sunny(folder))
    bumps = np.zeros((4, 4, 3), np.float16) + np.float16([0.3, 0.1, 0.9])
    objects = (
        SceneObject("shell", dark.objects[0].mesh, "grey"),
        SceneObject("pane", patch((-0.25, 1.999, -0.25), (0.5, 0, 0), (0, 0, 0.5)), "clear"),
        SceneObject("bumpy", patch((-1, 0.1, 1), (2, 0, 0), (0, 0, -2)), "bumpy"),
        SceneObject("ball", placed(sphere(0.3, 16, 8), (-0.8, 0.6, 0)), "mirror"),
        SceneObject("other", placed(sphere(0.2, 16, 8), (0.9, 0.6, 0)), "mirror"),
        SceneObject("glow", patch((-1.9, 0.5, -0.5), (0, 0, 1), (0, 0.5, 0)), "black", emission=(5.0, 4.0, 3.0)),
    )
    materials = {**MATERIALS, "bumpy": MATERIALS["grey"], "mirror": MIRROR}
    scene = Scene(
        "lit", objects, materials, dark.environment, (BULB, luminaire(OPENINGS["disc"], at=(0.5, 1.6, 0.5))),
        textures={"bumpy": MaterialTextures(normal=Texture(bumps))},
    )  # fmt: skip
    return with_luminous_surfaces(scene)


def bake_lit(
    scene: Scene, folder: Path, workers: Workers | None = None, progress: Progress = silent, **options: Any
) -> Store:
    return bake(scene, folder, only={"probe"}, quality=TILED, workers=workers, progress=progress, **options)
