"""Materials that a document or a measured table replaces, and what Blender's own materials lose."""

from __future__ import annotations

from pathlib import PurePath

import bpy

from .lamps import source
from .properties import setting

SHOWN = {"ShaderNodeBsdfPrincipled", "ShaderNodeEmission"}


def materials_of(named, copies):
    """[materials] and [measured] of a scene.toml: copies of the files that materials of the .glb are assigned."""
    materials, measured = {}, {}
    for material in bpy.data.materials:
        file = setting(material, "lambent_material")
        if not file or material.name not in named.materials or material.name in {**materials, **measured}:
            continue
        is_document = PurePath(file).suffix.lower() == ".json"
        copy = copies.take(
            file,
            material,
            "materials" if is_document else "measured",
            f"material {material.name}",
            "it stays as Blender has it",
        )
        if copy is None:
            continue
        if is_document:
            materials[material.name] = {"file": copy}
        else:
            measured[material.name] = copy
            copies.note(
                f"material {material.name}: light follows the table {PurePath(file).name}, but pictures show Blender's "
                "material: fit the table and assign the document"
            )
    return materials, measured


def material_notes(named, materials, note):
    """Note what glTF does not carry of materials without a document."""
    for material in bpy.data.materials:
        look = named.materials.get(material.name)
        if look is None or material.name in materials or material.node_tree is None:
            continue
        output = next(
            (n for n in material.node_tree.nodes if n.bl_idname == "ShaderNodeOutputMaterial" and n.is_active_output),
            None,
        )
        surface = source(output.inputs["Surface"]) if output else None
        if surface is None or surface.bl_idname not in SHOWN:
            note(f"material {material.name}: it is no Principled BSDF, and carried only in part")
        elif surface.bl_idname in SHOWN and _lacks_colour(surface, look):
            note(f"material {material.name}: the nodes of its colour are not carried: bake them into an image")


def _lacks_colour(surface, look):
    colour = surface.inputs.get("Base Color")
    return colour is not None and colour.is_linked and "baseColorTexture" not in look.get("pbrMetallicRoughness", {})
