"""A lamp over a floor, half black and half white, in centimetres."""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import bpy
from building import CM, camera, empty_scene, lamp, look, plane, put, truth

WATTS, HEIGHT_M = 100.0, 2.0


def build(folder: Path) -> dict:
    scene = empty_scene(CM)
    scene.world = None
    for name, x, white in (("black floor", -100, 0.0), ("white floor", 100, 0.8)):
        surface = look(name, (white, white, white))
        surface.node_tree.nodes["Principled BSDF"].inputs["Specular IOR Level"].default_value = 0
        put(scene.collection, name, plane(name, 200, 400), (x, 0, 0)).data.materials.append(surface)
    lamp(scene.collection, "bulb", "POINT", WATTS / CM**2, (60, 50, 100 * HEIGHT_M), shadow_soft_size=0)
    scene.camera = camera(scene, "above", (0, -400, 300), (55, 0, 0))
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "pool.blend"))
    return truth(scene)


if __name__ == "__main__":
    sys.stdout.write(f"\ntruth: {json.dumps(build(Path(sys.argv[1])))}\n")
