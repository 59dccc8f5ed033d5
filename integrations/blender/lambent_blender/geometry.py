"""The meshes and materials of a scene as .glb, by Blender's own exporter, and what the file then calls them."""

from __future__ import annotations

import json
import struct
from contextlib import contextmanager

import bpy

SOLID = {"MESH", "CURVE", "SURFACE", "FONT", "META"}
PLACES = {"translation", "rotation", "scale", "matrix"}  # of a node of glTF
LOST = {"VOLUME", "CURVES", "POINTCLOUD", "GREASEPENCIL", "GPENCIL"}


def renderable(scene, view_layer):
    """The objects of a scene that are rendered: neither hidden in renders, nor in collections that are."""
    found, stack = {}, [view_layer.layer_collection]
    while stack:
        layer = stack.pop()
        if not (layer.exclude or layer.collection.hide_render):
            found |= {o.name_full: o for o in layer.collection.objects if not o.hide_render}
            stack += layer.children
    return [o for o in scene.objects if o.name_full in found]


@contextmanager
def as_rendered(scene, view_layer, shown):
    """The scene with what renders show, and nothing else, evaluated and visible to the exporter."""
    names = {o.name_full for o in shown}
    wanted = [(o, "hide_render", o.name_full not in names) for o in scene.objects]
    wanted += [(block, "hide_viewport", False) for o in shown for block in (o, *o.users_collection)]
    changed = [(block, name, value) for block, name, value in wanted if getattr(block, name) != value]
    try:
        for block, name, value in changed:
            setattr(block, name, value)
        view_layer.update()
        yield
    finally:
        for block, name, value in changed:
            setattr(block, name, not value)


def write_glb(file):
    """Write the rendered meshes with their modifiers, y up, in Blender's units; lamps and cameras stay out."""
    if not hasattr(bpy.ops.export_scene, "gltf"):
        raise RuntimeError("the add-on glTF 2.0 is not enabled: enable it in the preferences")
    bpy.ops.export_scene.gltf(
        filepath=str(file), export_format="GLB", use_active_scene=True, use_renderable=True, export_apply=True,
        export_yup=True, export_gn_mesh=True, export_cameras=False, export_lights=False, export_animations=False,
        export_current_frame=True, export_skins=False, export_morph=False, export_image_format="AUTO",
    )  # fmt: skip
    data = file.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + length])
    _tidy(document)
    text, rest = json.dumps(document).encode(), data[20 + length :]
    text += b" " * (-len(text) % 4)
    file.write_bytes(b"glTF" + struct.pack("<4I", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest)
    return document


def _tidy(document):
    """Name instances of geometry nodes as their object; drop those that repeat it, as Blender 5.0 adds to curves."""
    nodes = document.get("nodes", [])
    for node in nodes:
        own, children = _shape(document, node), node.pop("children", [])
        instances = [i for i in children if nodes[i]["name"] == "GN Instance"]
        for i in instances:
            nodes[i]["name"] = node["name"]
        repeated = [i for i in instances if own and not PLACES & nodes[i].keys() and _shape(document, nodes[i]) == own]
        for i in repeated:
            del nodes[i]["mesh"]
        kept = [i for i in children if i not in repeated]
        node.update({"children": kept} if kept else {})


def _shape(document, node):
    """Number and bounds of a node's vertices; None without a mesh."""
    if "mesh" not in node:
        return None
    parts = document["meshes"][node["mesh"]]["primitives"]
    found = [document["accessors"][part["attributes"]["POSITION"]] for part in parts]
    return [(one["count"], one["min"], one["max"]) for one in found]


class Named:
    """Names in a .glb: the objects that each node becomes in Lambent, and the materials that it uses."""

    def __init__(self, document):
        self.objects = {}  # node's name -> [(object's name, material)]
        materials, meshes = document.get("materials", []), document.get("meshes", [])
        for node in document.get("nodes", []):
            parts = meshes[node["mesh"]]["primitives"] if "mesh" in node else []
            for part in parts:
                look = materials[part["material"]] if "material" in part else {}
                name = node["name"] if len(parts) == 1 else f"{node['name']}_{look.get('name', 'default')}"
                self.objects.setdefault(node["name"], []).append((name, look))
        self.materials = {one["name"]: one for one in materials}

    def patterns(self, name, emitting=False):
        """Patterns that match the objects of a node, or those that emit light, its copies of the same name included."""
        found = [
            (one, look)
            for one, look in self.objects.get(name, ())
            if not emitting or any(look.get("emissiveFactor", ()))
        ]
        once = {one for one, _ in found}
        several = {one for one in once if sum(other == one for other, _ in found) > 1}
        return [escaped(one) for one in sorted(once)] + [escaped(one) + "_[0-9]*" for one in sorted(several)]


def escaped(name):
    """A pattern that matches a name alone."""
    return "".join(f"[{c}]" if c in "*?[" else c for c in name)
