"""A room with plastic, metal and two lamps, in centimetres, and its picture by Cycles: `seen.exr` of 120 x 90."""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import bpy
from building import CM, box, camera, empty_scene, lamp, look, plane, put, truth


def build(folder: Path) -> dict:
    scene = empty_scene(CM)
    top = scene.collection
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.02, 0.03, 0.05, 1)
    wall, floor, red = (
        look("wall", (0.7, 0.68, 0.65), 0.9),
        look("floor", (0.35, 0.22, 0.12), 0.25),
        look("red", (0.6, 0.08, 0.05), 0.4),
    )
    metal = look("metal", (0.9, 0.75, 0.4), 0.3)
    metal.node_tree.nodes["Principled BSDF"].inputs["Metallic"].default_value = 1
    put(top, "floor", plane("floor", 400, 400)).data.materials.append(floor)
    for name, at, turn in (
        ("back", (0, 200, 150), (90, 0, 0)), ("left", (-200, 0, 150), (90, 0, 90)),
        ("right", (200, 0, 150), (90, 0, -90)), ("ceiling", (0, 0, 300), (180, 0, 0)),
    ):  # fmt: skip
        put(top, name, plane(name, 400, 300 if turn[0] == 90 else 400), at, turn).data.materials.append(wall)
    block = box("block", (80, 80, 120))
    block.materials.append(red)
    put(top, "tall", block, (-80, 60, 60), (0, 0, 20))
    put(top, "metal", box("metal", (70, 70, 70)), (40, -20, 35), (0, 0, 40)).data.materials.append(metal)
    lamp(top, "panel", "AREA", 1e6, (40, 20, 295), shape="RECTANGLE", size=120, size_y=60)
    spot = {"spot_size": 0.9, "spot_blend": 0.3, "shadow_soft_size": 0, "color": (1, 0.8, 0.6)}
    lamp(top, "spot", "SPOT", 1.5e6, (-150, -120, 280), (35, 0, -40), **spot)
    scene.camera = camera(scene, "eye", (0, -380, 110), (85, 0, 0), lens=40)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "cornell.blend"))
    scene.render.engine, scene.cycles.samples, scene.cycles.device = "CYCLES", 128, "CPU"
    scene.cycles.use_denoising = False
    scene.render.resolution_x, scene.render.resolution_y = 120, 90
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(folder / "seen.exr")
    bpy.ops.render.render(write_still=True)
    return truth(scene)


if __name__ == "__main__":
    sys.stdout.write(f"\ntruth: {json.dumps(build(Path(sys.argv[1])))}\n")
