"""Irradiance of a small plate below lamps of every kind, as Cycles renders it; and the same lamps for export.

`measured.py FOLDER`: each lamp is in a .blend of its name.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import bpy
from building import camera, empty_scene, ies_node, lamp, look, plane, put

HIGH = 3.0  # of the lamps above the plate
LAMPS = {
    "point": ("POINT", {"shadow_soft_size": 0.0, "color": (1, 0.5, 0.2)}),
    "warm": ("POINT", {"shadow_soft_size": 0.0, "use_temperature": True, "temperature": 3000}),
    "bulb": ("POINT", {"shadow_soft_size": 0.05, "normalize": False, "exposure": 2.0}),
    "spot": ("SPOT", {"shadow_soft_size": 0.0, "spot_size": 0.8, "spot_blend": 0.3}),
    "sun": ("SUN", {"angle": 0.0}),
    "wide sun": ("SUN", {"angle": 0.009, "normalize": False, "exposure": 12.0}),
    "square": ("AREA", {"shape": "SQUARE", "size": 0.1}),
    "rectangle": ("AREA", {"shape": "RECTANGLE", "size": 0.1, "size_y": 0.05}),
    "disc": ("AREA", {"shape": "DISK", "size": 0.1}),
    "ellipse": ("AREA", {"shape": "ELLIPSE", "size": 0.1, "size_y": 0.05, "normalize": False, "exposure": 8.0}),
    "luminaire": ("POINT", {"shadow_soft_size": 0.0}),
}


def build(folder: Path) -> dict:
    return {name: _measured(folder, name, *LAMPS[name]) for name in LAMPS}


def _measured(folder: Path, name: str, kind: str, settings: dict) -> list:
    """Irradiance (3,) of the plate."""
    scene = empty_scene()
    scene.world = None
    plate = look("white", (1, 1, 1))
    nodes = plate.node_tree.nodes
    nodes.remove(nodes["Principled BSDF"])
    diffuse = nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
    plate.node_tree.links.new(diffuse.outputs[0], nodes["Material Output"].inputs["Surface"])
    put(scene.collection, "plate", plane("plate", 0.1, 0.1)).data.materials.append(plate)
    o = lamp(scene.collection, name, kind, 40.0, (0, 0, HIGH), scale=(1, 2, 1), **settings)
    if name == "luminaire":
        ies_node(o.data, str(folder / "lamp.ies"), 0.25)
    scene.camera = camera(scene, "eye", (0, -0.5, 0.5), (45, 0, 0), angle=math.radians(1))
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{name}.blend"))
    scene.render.engine, scene.cycles.samples, scene.cycles.max_bounces = "CYCLES", 64, 1
    scene.cycles.use_denoising, scene.cycles.device = False, "CPU"
    scene.render.resolution_x = scene.render.resolution_y = 8
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(folder / "seen.exr")
    bpy.ops.render.render(write_still=True)
    values = bpy.data.images.load(scene.render.filepath).pixels[:]
    return [math.pi * sum(values[c::4]) / (len(values) // 4) for c in range(3)]


if __name__ == "__main__":
    sys.stdout.write(f"\ntruth: {json.dumps(build(Path(sys.argv[1])))}\n")
