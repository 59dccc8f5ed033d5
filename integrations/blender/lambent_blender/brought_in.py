"""What Lambent's command gives back to Blender: a likeness of a material document, and a baked light map."""

from __future__ import annotations

import tempfile
from pathlib import Path

import bpy

from .running import call


def show_likeness(material, document, command):
    """Give a material's Principled BSDF the values that come closest to a document, as `lambent convert` finds them."""
    with tempfile.TemporaryDirectory() as folder:
        glb = Path(folder) / "likeness.glb"
        call([*command, "convert", document, str(glb)])
        (ball,) = imported(glb)
    mesh, likeness = ball.data, ball.active_material
    found, links = _principled(likeness), material.node_tree.links
    for socket in _principled(material).inputs:
        given = found.inputs.get(socket.name)
        if given is not None and not given.is_linked and hasattr(given, "default_value"):
            for link in socket.links if socket.name != "Normal" else ():
                links.remove(link)
            socket.default_value = given.default_value
    bpy.data.objects.remove(ball)
    bpy.data.meshes.remove(mesh)
    bpy.data.materials.remove(likeness)


def _principled(material):
    found = (n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeBsdfPrincipled")
    try:
        return next(found)
    except StopIteration:
        raise RuntimeError(f"material {material.name} has no Principled BSDF to show it in") from None


def import_light_map(store, command, scene):
    """The objects of a store in a collection of their own, shown in their baked light."""
    file = store / "images" / "light_map.exr"
    call([*command, "lightmap", str(store), "-o", str(file), "--force"])
    collection = bpy.data.collections.new(f"{store.stem} light map")
    scene.collection.children.link(collection)
    look = _baked_look(collection.name, bpy.data.images.load(str(file)))
    for o in imported(file.with_suffix(".glb")):
        for other in o.users_collection:
            other.objects.unlink(o)
        collection.objects.link(o)
        o.data.uv_layers.active_index = 1
        o.data.materials.clear()
        o.data.materials.append(look)


def imported(file):
    """The objects that a .glb adds to the scene."""
    before = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=str(file))
    return [o for o in bpy.data.objects if o not in before]


def _baked_look(name, image):
    """A material that emits irradiance over pi, as a white surface would, read at the second uv set."""
    look = bpy.data.materials.new(name)
    if look.node_tree is None:  # of Blender 4
        look.use_nodes = True
    nodes, links = look.node_tree.nodes, look.node_tree.links
    nodes.clear()
    kinds = ("UVMap", "TexImage", "Emission", "OutputMaterial")
    place, texture, emission, output = (nodes.new(f"ShaderNode{kind}") for kind in kinds)
    place.uv_map, texture.image, texture.extension = "UVMap.001", image, "EXTEND"
    emission.inputs["Strength"].default_value = 0.31831
    links.new(place.outputs["UV"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], emission.inputs["Color"])
    links.new(emission.outputs["Emission"], output.inputs["Surface"])
    return look
