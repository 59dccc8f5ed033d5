"""The meshes and materials of a scene as .glb, by Blender's own exporter, and what the file then calls them."""

from __future__ import annotations

import json
import struct
from contextlib import contextmanager

import bpy

SOLID = {"MESH", "CURVE", "SURFACE", "FONT", "META"}
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


def write_glb(file, scene, view_layer):
    """Write the rendered meshes with their modifiers, y up, in Blender's units; lamps and cameras stay out."""
    if not hasattr(bpy.ops.export_scene, "gltf"):
        raise RuntimeError("the add-on glTF 2.0 is not enabled: enable it in the preferences")
    with _hidden_left_out(scene, renderable(scene, view_layer)):
        bpy.ops.export_scene.gltf(
            filepath=str(file), export_format="GLB", use_active_scene=True, use_renderable=True, export_apply=True,
            export_yup=True, export_gn_mesh=True, export_cameras=False, export_lights=False, export_animations=False,
            export_current_frame=True, export_skins=False, export_morph=False, export_image_format="AUTO",
        )  # fmt: skip


@contextmanager
def _hidden_left_out(scene, shown):
    """Hide what collections hide: the exporter looks only at an object and its nearest collections."""
    names = {o.name_full for o in shown}
    hidden = [o for o in scene.objects if o.name_full not in names and not o.hide_render]
    try:
        for o in hidden:
            o.hide_render = True
        yield
    finally:
        for o in hidden:
            o.hide_render = False


class Named:
    """Names in a .glb: the objects that each node becomes in Lambent, and the materials that it uses."""

    def __init__(self, file):
        self.document = read_json(file)
        self.objects = {}  # node's name -> [(object's name, material)]
        materials, meshes = self.document.get("materials", []), self.document.get("meshes", [])
        for node in self.document.get("nodes", []):
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


def read_json(file):
    """The JSON of a .glb."""
    data = file.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length])
