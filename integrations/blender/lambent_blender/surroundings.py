"""The world of a scene: one colour, a picture, or a sky."""

from __future__ import annotations

import math
from pathlib import PurePath

import bpy
import numpy as np

from .lamps import source

ROWS = 1024  # of the picture of a soft sun
READ = (".exr", ".hdr", ".png", ".jpg", ".jpeg")


def environment_of(world, copies, note):
    """The [environment] of a scene.toml; None if it is black, or, with a note, cannot be carried."""
    if world is None:
        return None
    if world.node_tree is None or not getattr(world, "use_nodes", True):  # of Blender 4
        return _constant(world.color)
    output = next(
        (n for n in world.node_tree.nodes if n.bl_idname == "ShaderNodeOutputWorld" and n.is_active_output), None
    )
    if output is None or not output.inputs["Surface"].is_linked:
        return None
    background = source(output.inputs["Surface"])
    if background.bl_idname != "ShaderNodeBackground" or background.inputs["Strength"].is_linked:
        note("world: its nodes are not carried, but for one Background of a colour, a picture or a sky")
        return None
    strength, colour = max(background.inputs["Strength"].default_value, 0.0), background.inputs["Color"]
    node = source(colour)
    if node is None:
        return _constant([strength * c for c in colour.default_value[:3]])
    if node.bl_idname == "ShaderNodeTexSky":
        return _sky(node, strength, note)
    if node.bl_idname == "ShaderNodeTexEnvironment":
        return _picture(node, strength, copies, note)
    note(f"world: a {node.name} is not carried")
    return None


def _constant(radiance):
    return {"kind": "constant", "radiance": list(radiance)} if any(radiance) else None


def with_sun(environment, towards, irradiance, radius_rad, copies):
    """The [environment] of a scene.toml whose plain world also shows a disc that gives this irradiance."""
    theta, phi = ((np.arange(n) + 0.5) / n * np.pi for n in (ROWS, 2 * ROWS))
    level, phi = np.sin(theta)[:, None], 2 * phi - np.pi
    cosine = level * np.sin(phi) * towards[0] + np.cos(theta)[:, None] * towards[1] - level * np.cos(phi) * towards[2]
    disc = np.clip((radius_rad - np.arccos(np.clip(cosine, -1, 1))) * ROWS / np.pi + 0.5, 0, 1)
    gain = np.array(irradiance) / ((np.pi / ROWS) ** 2 * (disc * level * cosine).sum())
    pixels = np.ones((ROWS, 2 * ROWS, 4), np.float32)
    pixels[..., :3] = disc[..., None] * gain + (environment or {"radiance": [0.0] * 3})["radiance"]
    return {
        "kind": "image",
        "file": _written("sun", 2 * ROWS, ROWS, pixels[::-1].ravel(), True, copies),
        "layout": "lat-long",
    }


def _sky(node, strength, note):
    rise, turn = node.sun_elevation, node.sun_rotation
    if rise < 0:
        note("world: its sun is below the horizon: left out")
        return None
    note("world: its Sky Texture becomes Lambent's clear sky with the same sun, in W/(sr m2) times the strength")
    level = math.cos(rise)
    towards = [math.sin(turn) * level, math.sin(rise), -math.cos(turn) * level]
    sun = node.sun_intensity * strength if node.sun_disc else 0.0
    radius_deg = min(max(math.degrees(node.sun_size) / 2, 0.05), 30.0)
    return {
        "kind": "sunsky", "sun_direction": towards, "sky_scale": strength, "sun_scale": sun,
        "sun_radius_deg": radius_deg,
    }  # fmt: skip


def _picture(node, strength, copies, note):
    turn_rad = _turn(node)
    if node.image is None or node.projection != "EQUIRECTANGULAR" or turn_rad is None:
        note("world: left out, its picture is not a lat-long one that is turned about z only")
        return None
    file = image_file(node.image, copies, "world")
    if file is None:
        return None
    # The middle of the picture looks along x, which is a quarter turn to the right of Lambent's front.
    rotation = -90.0 - math.degrees(turn_rad)
    return {"kind": "image", "file": file, "scale": strength, "rotation_deg": rotation, "layout": "lat-long"}


def _turn(node):
    """Angle by which a Mapping node turns directions about z; None if it, or another node, does anything else."""
    mapping = source(node.inputs["Vector"])
    if mapping is None or (mapping.bl_idname == "ShaderNodeTexCoord" and _is_generated(node.inputs["Vector"])):
        return 0.0
    if mapping.bl_idname != "ShaderNodeMapping" or mapping.vector_type == "NORMAL":
        return None
    vector, place, turns, scale = (mapping.inputs[name] for name in ("Vector", "Location", "Rotation", "Scale"))
    before = source(vector)
    if any(one.is_linked for one in (place, turns, scale)) or before is None or not _is_generated(vector):
        return None
    moved = any(abs(x) > 1e-6 for x in (*place.default_value, *turns.default_value[:2]))
    if moved or any(abs(x - 1) > 1e-6 for x in scale.default_value):
        return None
    return turns.default_value[2] * (-1 if mapping.vector_type == "TEXTURE" else 1)


def _is_generated(socket):
    link = socket.links[0]
    return link.from_node.bl_idname == "ShaderNodeTexCoord" and link.from_socket.name == "Generated"


def image_file(image, copies, what):
    """Name of a copy of an image of Blender, packed or not, in a format that Lambent reads."""
    name = PurePath((image.filepath_raw or image.name).replace("\\", "/")).name
    readable = PurePath(name).suffix.lower() in READ
    if readable and image.packed_file is not None:
        return copies.write(name, image.packed_file.data, "textures", image)
    if readable and image.source == "FILE" and not image.is_dirty:
        return copies.take(image.filepath, image, "textures", what)
    if not image.has_data and not len(image.pixels):
        copies.note(f"{what}: picture {image.name} is missing: left out")
        return None
    pixels = np.empty(4 * image.size[0] * image.size[1], np.float32)
    image.pixels.foreach_get(pixels)
    return _written(PurePath(name).stem or "picture", *image.size, pixels, image.is_float, copies)


def _written(stem, width, height, pixels, is_float, copies):
    """Name of a file of RGBA, the lowest row first: floats, linear, as EXR; or bytes, sRGB, as PNG."""
    target = copies.folder / "textures" / f"{stem}.{'exr' if is_float else 'png'}"
    target.parent.mkdir(parents=True, exist_ok=True)
    # Blender would save floats as sRGB, were they not data
    image = bpy.data.images.new(stem, width, height, alpha=True, float_buffer=is_float, is_data=is_float)
    try:
        image.file_format = "OPEN_EXR" if is_float else "PNG"
        image.pixels.foreach_set(pixels)
        image.save(filepath=str(target))
    finally:
        bpy.data.images.remove(image)
    return target.relative_to(copies.folder).as_posix()
