"""Things that exporters trip over: texts, curves, geometry nodes, mirrored and hidden things, wild names."""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import bpy
from building import box, empty_scene, ies_node, lamp, look, plane, put, truth


def build(folder: Path) -> dict:
    scene = empty_scene()
    top = scene.collection
    text = bpy.data.curves.new("text", "FONT")
    text.body, text.extrude = "Ä", 0.1
    put(top, "text", text, (0, 0, 1))["lambent_light_field"] = True
    bent = bpy.data.curves.new("bent", "CURVE")
    bent.dimensions, bent.bevel_depth = "3D", 0.1
    spline = bent.splines.new("POLY")
    spline.points.add(2)
    for i, point in enumerate(spline.points):
        point.co = (i, i * i, 0, 1)
    put(top, "bent", bent, (3, 0, 0))
    put(top, "wires", bpy.data.meshes.new("nothing"))
    put(top, "mirrored", box("mirrored"), (0, 3, 0), scale=(-1, 1, 2))
    scatter = put(top, "scatter", plane("scatter", 2, 2), (0, -3, 0))
    scatter.modifiers.new("nodes", "NODES").node_group = _boxes_on_points()
    parent = put(top, "parent", None, (0, 0, 5))
    hidden = put(top, "hidden in the viewport", box("h"), (14, 0, 0))
    shy = lamp(top, 'sh#y "lamp"\\', "AREA", 10.0, (0, 0, 4), size=0.5)
    shy.parent = parent
    hidden.hide_viewport = shy.hide_viewport = True
    for name, at in (("q\"uo\nte' [x]?", 20), ("#hash", 22), ("a" * 60, 24)):
        put(top, name, box("named"), (at, 0, 0))["lambent_light_field"] = "SURFACE"
    noisy = look("noisy")
    nodes, links = noisy.node_tree.nodes, noisy.node_tree.links
    links.new(nodes.new("ShaderNodeTexNoise").outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    put(top, "noisy", box("noisy"), (0, 6, 0)).data.materials.append(noisy)
    glow = look("glow")
    nodes, links = glow.node_tree.nodes, glow.node_tree.links
    emission = nodes.new("ShaderNodeEmission")
    emission.inputs["Strength"].default_value = 7
    links.new(emission.outputs[0], nodes["Material Output"].inputs["Surface"])
    group = bpy.data.collections.new("all that glows")
    group["lambent_light_group"] = True
    top.children.link(group)
    put(group, "glow", box("glow"), (0, 9, 0)).data.materials.append(glow)
    group.objects.link(shy)
    lamp(top, "thief", "POINT", -5.0)
    lamp(top, "off", "AREA", 0.0)
    inside = lamp(top, "inside", "POINT", 1.0, (0, 0, 2), shadow_soft_size=0)
    _ies_text(inside.data)
    put(top, "smoke", bpy.data.volumes.new("smoke"))
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "odds.blend"))
    hidden.hide_viewport = False
    return truth(scene)


def _ies_text(light):
    """Photometry in a text of the .blend, with a name that leads out of the folder."""
    text = bpy.data.texts.new("../../out.ies")
    text.from_string("IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 3 1 1 2 0 0 0\n1 1 10\n0 90 180\n0\n50 50 50\n")
    ies_node(light, "")
    texture = next(n for n in light.node_tree.nodes if n.bl_idname == "ShaderNodeTexIES")
    texture.mode, texture.ies = "INTERNAL", text


def _boxes_on_points():
    """A group of geometry nodes that puts a small box on each point."""
    group = bpy.data.node_groups.new("boxes", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, end, on_points, small = (
        group.nodes.new(kind)
        for kind in ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeInstanceOnPoints", "GeometryNodeMeshCube")
    )
    small.inputs["Size"].default_value = (0.1, 0.1, 0.1)
    group.links.new(start.outputs[0], on_points.inputs["Points"])
    group.links.new(small.outputs[0], on_points.inputs["Instance"])
    group.links.new(on_points.outputs[0], end.inputs[0])
    return group


if __name__ == "__main__":
    sys.stdout.write(f"\ntruth: {json.dumps(build(Path(sys.argv[1])))}\n")
