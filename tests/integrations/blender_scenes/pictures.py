"""Pictures of a world in every state that Blender has them in: on disk, packed, made there, in floats and bytes."""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import bpy
from building import empty_scene

SIZE, VALUE = (4, 2), (0.5, 0.25, 1.0, 1.0)


def build(folder: Path) -> dict:
    from lambent_blender.files import Copies
    from lambent_blender.surroundings import environment_of, image_file

    empty_scene()
    notes: list[str] = []
    copies = Copies(folder, notes.append)
    found = {name: image_file(image, copies, "world") for name, image in _images(folder).items()}
    worlds = {name: environment_of(world, copies, notes.append) for name, world in _worlds().items()}
    return {"files": found, "notes": notes, "worlds": worlds}


def _images(folder: Path) -> dict:
    made = {"floats": _filled("floats", float_buffer=True), "bytes": _filled("bytes"), "packed": _filled("packed.png")}
    made["packed"].pack()
    for name, ending, kind in (("targa", "tga", "TARGA"), ("on disk", "png", "PNG"), ("packed later", "png", "PNG")):
        image = _filled(name)
        image.file_format, image.filepath_raw = kind, str(folder / f"{name}.{ending}")
        image.save()
        made[name] = bpy.data.images.load(image.filepath_raw)
    made["packed later"].pack()
    (folder / "packed later.png").unlink()
    made["missing"] = bpy.data.images.new("missing", *SIZE)
    made["missing"].source, made["missing"].filepath = "FILE", str(folder / "missing.tga")
    return made


def _worlds() -> dict:
    """Worlds of one node before their Background, which has a strength of 2."""
    made = {}
    for name, kind in (("sky", "TexSky"), ("night", "TexSky"), ("noise", "TexNoise"), ("tilted", "TexEnvironment")):
        made[name] = bpy.data.worlds.new(name)
        made[name].use_nodes = True
        nodes, links = made[name].node_tree.nodes, made[name].node_tree.links
        node = nodes.new(f"ShaderNode{kind}")
        nodes["Background"].inputs["Strength"].default_value = 2
        links.new(node.outputs["Color"], nodes["Background"].inputs["Color"])
        if kind == "TexSky":
            node.sun_elevation, node.sun_rotation, node.sun_size = (0.5 if name == "sky" else -0.1), 2.0, 0.02
        if name == "tilted":
            node.image, mapping = _filled("tilted", float_buffer=True), nodes.new("ShaderNodeMapping")
            mapping.inputs["Rotation"].default_value[0] = 0.3
            links.new(nodes.new("ShaderNodeTexCoord").outputs["Generated"], mapping.inputs["Vector"])
            links.new(mapping.outputs["Vector"], node.inputs["Vector"])
    made["grey"], made["negative"] = bpy.data.worlds.new("grey"), bpy.data.worlds.new("negative")
    for name, strength in (("grey", 3), ("negative", -1)):
        made[name].use_nodes = True
        inputs = made[name].node_tree.nodes["Background"].inputs
        inputs["Color"].default_value, inputs["Strength"].default_value = (0.1, 0.2, 0.3, 1), strength
    return made


def _filled(name, **options):
    image = bpy.data.images.new(name, *SIZE, **options)
    image.pixels = VALUE * (SIZE[0] * SIZE[1])
    return image


if __name__ == "__main__":
    sys.stdout.write(f"\ntruth: {json.dumps(build(Path(sys.argv[1])))}\n")
