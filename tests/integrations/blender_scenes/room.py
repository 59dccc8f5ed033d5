"""A room in centimetres: instances, modifiers, all lamps, a linked collection, a packed image, hidden things."""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import bpy
from building import CM, box, camera, empty_scene, ies_node, lamp, look, plane, put, truth


def build(folder: Path) -> dict:
    _library(folder / "kit.blend")
    scene = empty_scene(CM)
    scene.world = None
    scene.view_settings.exposure = 1.5
    top = scene.collection
    oak, wall, tile, sign = look("oak", (0.4, 0.3, 0.2)), look("Wand ä/1"), look("tile"), look("sign", emission=3.0)
    oak["lambent_material"] = "//measured/oak.json"
    wall["lambent_material"] = "//measured/missing.json"
    tile["lambent_material"] = "//measured/tile.txt"
    floor = put(top, "floor", plane("floor", 400, 300))
    floor.data.materials.append(oak)
    back = put(top, "back", plane("back", 400, 250, uv=True), (0, 150, 125), (90, 0, 0))
    back.data.materials.append(_packed())
    stool = box("stool", (40, 40, 50))
    for i, turn in enumerate((0, 30, 75)):
        put(top, f"Stuhl/{i}", stool, (-120 + 90 * i, -60, 25), (0, 0, turn), (1, 1, 1 + i / 2))
    stool.materials.append(wall)
    row = put(top, "row", box("row", (10, 10, 10)), (100, 50, 5))
    row.data.materials.append(tile)
    array = row.modifiers.new("array", "ARRAY")
    array.count, array.relative_offset_displace = 4, (1.5, 0, 0)
    two = put(top, "two", box("two", (20, 20, 20)), (-150, 100, 10))
    two.data.materials.append(wall)
    two.data.materials.append(tile)
    two.data.polygons[0].material_index = 1
    put(top, "hidden", box("hidden"), (0, 0, 100)).hide_render = True
    outer, inner, excluded = (bpy.data.collections.new(name) for name in ("outer", "inner", "excluded"))
    top.children.link(outer)
    outer.children.link(inner)
    top.children.link(excluded)
    outer.hide_render = True
    put(inner, "in hidden collection", box("b"))
    put(excluded, "in excluded collection", box("c"))
    bpy.context.view_layer.layer_collection.children["excluded"].exclude = True
    _lamps(top, sign)
    with bpy.data.libraries.load(str(folder / "kit.blend"), link=True) as (_, linked):
        linked.collections = ["kit"]
    for i, (x, turn) in enumerate(((-50, 0), (70, 90))):
        holder = put(top, f"kit {i}", None, (x, 0, 150), (0, 0, turn))
        holder.instance_type, holder.instance_collection = "COLLECTION", linked.collections[0]
    scene.camera = camera(scene, "door", (-150, -130, 160), (80, 0, -40), lens=28)
    camera(scene, "upright", (0, -100, 120), (90, 10, 5), lens=35, sensor_fit="VERTICAL", sensor_height=24)
    camera(scene, "shifted", (0, -100, 120), (90, 0, 0), shift_y=0.2)
    camera(scene, "plan", (0, 0, 400), (0, 0, 0), type="ORTHO")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "room.blend"))
    return truth(scene)


def _lamps(top, sign):
    evening = bpy.data.collections.new("evening")
    evening["lambent_light_group"] = True
    top.children.link(evening)
    lamp(top, "bulb", "POINT", 4e5, (0, 0, 200), color=(1, 0.5, 0.25), shadow_soft_size=0)
    lamp(evening, "spot", "SPOT", 6e5, (50, 20, 240), (20, 10, 0), spot_size=1.0, spot_blend=0.4, shadow_soft_size=5)
    lamp(top, "sun", "SUN", 3.0, turn_deg=(40, 0, 30), angle=0.2)
    lamp(top, "sharp sun", "SUN", 2.0, turn_deg=(10, 0, 60), angle=0.0)
    lamp(top, "panel", "AREA", 2e5, (0, 0, 245), (0, 15, 20), (1, 2, 1), shape="RECTANGLE", size=60, size_y=30)
    lamp(top, "disc #1", "AREA", 1e5, (100, 0, 245), shape="DISK", size=40, spread=1.0)
    bare = lamp(top, "bare", "AREA", 2.0, (-100, 0, 245), shape="SQUARE", size=50)
    bare.data.normalize, bare.data.exposure = False, 1.0
    down = lamp(top, "downlight", "SPOT", 1.0, (-60, 40, 240), (0, 0, 25), shadow_soft_size=0)
    down.data["lambent_luminaire"] = "//lamp.ies"
    ies_node(lamp(top, "washer", "POINT", 1e4, (60, 40, 240), (30, 0, 50), color=(1, 0.9, 0.8)).data, "//lamp.ies", 0.5)
    put(evening, "sign", plane("sign", 50, 20), (0, 149, 150), (90, 0, 0)).data.materials.append(sign)


def _library(file: Path) -> None:
    """A second .blend in the same units: a collection of a shade and a bulb."""
    scene = empty_scene(CM)
    kit = bpy.data.collections.new("kit")
    scene.collection.children.link(kit)
    put(kit, "floor", box("shade", (30, 10, 4)), (20, 0, 0)).data.materials.append(look("shade"))
    lamp(kit, "kit bulb", "POINT", 1e5, (20, 0, -5), shadow_soft_size=0)
    bpy.ops.wm.save_as_mainfile(filepath=str(file))


def _packed():
    """A material whose colour is a red and blue image that exists only in the .blend."""
    image = bpy.data.images.new("paint", 4, 4)
    image.pixels = [v for i in range(16) for v in ((1, 0, 0, 1) if i % 4 < 2 else (0, 0, 1, 1))]
    image.pack()
    painted = look("painted")
    nodes, links = painted.node_tree.nodes, painted.node_tree.links
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    links.new(texture.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    return painted


if __name__ == "__main__":
    sys.stdout.write(f"\ntruth: {json.dumps(build(Path(sys.argv[1])))}\n")
