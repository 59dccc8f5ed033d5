"""Outdoors, in inches: a picture as world, an animated camera, a light field, names of other scripts."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import bpy
from building import box, camera, empty_scene, look, plane, put, truth

INCH = 0.0254
WIDTH, HEIGHT, COLUMN, ROW = 64, 32, 40, 20  # of the picture; the lit texel, rows from below as Blender has them
TURN_DEG, STRENGTH, FRAMES, FPS = 25.0, 2.0, 49, 24


def build(folder: Path) -> dict:
    scene = empty_scene(INCH)
    scene.unit_settings.system = "IMPERIAL"
    put(scene.collection, "Boden", plane("Boden", 400, 400)).data.materials.append(look("石"))
    vase = put(scene.collection, "花瓶 [1]*", box("vase", (10, 10, 30)), (0, 0, 15))
    vase.data.materials.append(look("釉薬", roughness=0.1))
    vase["lambent_light_field"] = True
    _world(scene)
    _walk(scene)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "テラス.blend"))
    found = truth(scene)
    found["frames"] = {str(frame): _at(scene, frame) for frame in range(1, FRAMES + 1, 6)}
    return found


def _world(scene):
    """A black picture with one bright texel, packed, and turned about z."""
    image = bpy.data.images.new("himmel", WIDTH, HEIGHT, float_buffer=True)
    pixels = [0.0, 0.0, 0.0, 1.0] * (WIDTH * HEIGHT)
    start = 4 * (ROW * WIDTH + COLUMN)
    pixels[start : start + 3] = [5.0, 4.0, 3.0]
    image.pixels = pixels
    image.pack()
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    nodes, links = scene.world.node_tree.nodes, scene.world.node_tree.links
    picture, mapping, place = (nodes.new(f"ShaderNode{kind}") for kind in ("TexEnvironment", "Mapping", "TexCoord"))
    picture.image = image
    mapping.inputs["Rotation"].default_value[2] = math.radians(TURN_DEG)
    nodes["Background"].inputs["Strength"].default_value = STRENGTH
    links.new(place.outputs["Generated"], mapping.inputs["Vector"])
    links.new(mapping.outputs["Vector"], picture.inputs["Vector"])
    links.new(picture.outputs["Color"], nodes["Background"].inputs["Color"])


def _walk(scene):
    """A camera that slows down on its way, and one that stands still."""
    scene.frame_start, scene.frame_end, scene.render.fps = 1, FRAMES, FPS
    walker = camera(scene, "Spaziergang", (0, 0, 0), (0, 0, 0))
    for frame, at, turn in ((1, (-80, -120, 60), -20), (25, (0, -100, 60), 0), (FRAMES, (20, -90, 70), 30)):
        walker.location, walker.rotation_euler = at, (math.radians(80), 0, math.radians(turn))
        walker.keyframe_insert("location", frame=frame)
        walker.keyframe_insert("rotation_euler", frame=frame)
    camera(scene, "fest", (0, -150, 60), (80, 0, 0))
    scene.camera = walker
    scene.frame_set(13)


def _at(scene, frame):
    scene.frame_set(frame)
    matrix = scene.camera.matrix_world
    return [list(matrix.translation), list(-matrix.col[2].xyz)]


if __name__ == "__main__":
    sys.stdout.write(f"\ntruth: {json.dumps(build(Path(sys.argv[1])))}\n")
