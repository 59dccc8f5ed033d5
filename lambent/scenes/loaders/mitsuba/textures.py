"""Mitsuba's textures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lambent.core.geometry.directions import Floats
from lambent.scenes.loaders.mitsuba.values import Plugin
from lambent.scenes.loaders.surfaces.surface import GREY
from lambent.scenes.loaders.surfaces.texture_images import TextureImage
from lambent.scenes.loaders.surfaces.textured import Textured, combined, constant, flipped_uv
from lambent.scenes.scene import UvTransform

CHECKS = 128  # texels along a checkerboard of 2 x 2 fields
LUMINANCE = np.array([0.212671, 0.715160, 0.072169], np.float32)  # Mitsuba's own weights, for agreement with it


def colour(plugin: Plugin, name: str, default: float | Floats, *, emitted: bool = False) -> Textured:
    """Linear RGB of a plugin's parameter, which may be `emitted` light."""
    fixed = plugin.constant(name, emitted=emitted)
    if fixed is not None:
        return constant(fixed)
    texture = plugin.texture(name)
    if texture is None:
        return constant(np.broadcast_to(np.asarray(default, float), 3).copy())
    return of_texture(texture)


def number(plugin: Plugin, name: str, default: float) -> Textured:
    """A plugin's parameter as one channel; for a texture, its luminance."""
    v = colour(plugin, name, default)
    if not v.is_texture:
        return constant(float(v.values.mean()))
    return Textured((v.values @ LUMINANCE)[..., None], v.uv_transform)


def opacity(plugin: Plugin, name: str) -> Textured:
    """Like `number`; for an image with an alpha channel, that channel."""
    texture = plugin.texture(name)
    if texture is not None and texture.type == "bitmap":
        image = _image(texture)
        if image is not None and image.alpha:
            texture.ignore("gamma", "raw")
            plugin.note("its mask is the image's alpha channel")
            return image.opacity()
    return number(plugin, name, GREY)


def of_texture(texture: Plugin) -> Textured:
    """Linear RGB of a texture."""
    if texture.type == "bitmap":
        v = _bitmap(texture)
    elif texture.type == "checkerboard":
        v = _checkerboard(texture)
    elif texture.type == "scale":
        inner = next(iter(texture.objects("texture")), None)
        factor = texture.constant("scale")
        base = of_texture(inner) if inner is not None else constant(np.full(3, GREY))
        v = combined(lambda a, b: a * b, base, constant(np.ones(3) if factor is None else factor), notes=[])
    elif texture.type in ("rgb", "srgb", "uniform", "d65", "rawconstant", "constant"):
        v = colour(texture, "color" if texture.has("color") else "value", GREY)
    else:
        texture.note("unknown texture, it becomes grey")
        return constant(np.full(3, GREY))
    texture.note_unread()
    return v


def raw_values(texture: Plugin) -> Textured | None:
    """Values of a bitmap as stored, 3 channels, for normal maps."""
    image = _image(texture)
    if image is None:
        return None
    texture.ignore("gamma", "raw", "wrap_mode", "wrap_mode_u", "wrap_mode_v")
    return image.rgb(srgb=False)


def _bitmap(texture: Plugin) -> Textured:
    image = _image(texture)
    if image is None:
        return constant(np.full(3, GREY))
    gamma = texture.number("gamma", 0.0)
    raw = texture.flag("raw", False) or gamma == 1
    texels = image.rgb(srgb=not raw and gamma <= 0).values
    if not raw and gamma > 0 and image.texels.dtype == np.uint8:
        texels = texels ** np.float32(gamma)
    for side in ("wrap_mode", "wrap_mode_u", "wrap_mode_v"):
        mode = texture.text(side, "repeat").lower()
        if mode != "repeat":
            texture.note(f"its texture is repeated, not {mode}")
    channel = texture.text("channel").lower()
    if channel in ("r", "g", "b"):
        texels = np.repeat(texels[..., ["r", "g", "b"].index(channel), None], 3, axis=-1)
    elif channel == "a":
        texels = np.repeat(image.opacity().values, 3, axis=-1)
    return Textured(texels, image.uv_transform)


def _image(texture: Plugin) -> TextureImage | None:
    """The image of a bitmap; None, with a note, if its file is missing."""
    name, uv_transform, element = texture.text("filename"), _uv_transform(texture), texture.element
    field = f"line {element.line} filename"
    image = texture.reading.images.named(name, element.file, field, texture.note, ": it becomes grey")
    return None if image is None else replace(image, uv_transform=uv_transform)


def _uv_transform(texture: Plugin) -> UvTransform:
    """Our uv transform of Mitsuba's to_uv (version 3), or of its scales and offsets (0.6)."""
    theirs = np.eye(3)
    matrix = texture.transform("to_uv")
    theirs[:2, :2], theirs[:2, 2] = matrix[:2, :2], matrix[:2, 3]
    both = texture.number("uvscale", 1.0)
    old = np.diag([*(texture.number(f"{c}scale", both) for c in "uv"), 1.0])
    old[:2, 2] = [texture.number(f"{c}offset", 0.0) for c in "uv"]
    return flipped_uv(old @ theirs)


def _checkerboard(texture: Plugin) -> Textured:
    dark, light = (
        colour(texture, name if texture.has(name) else other, default).mean
        for name, other, default in (("color0", "color_0", 0.4), ("color1", "color_1", 0.2))
    )
    second = np.arange(CHECKS) >= CHECKS // 2
    differs = second[:, None] != second[None, :]
    texels = np.where(differs[..., None], light, dark).astype(np.float32)
    return Textured(texels, _uv_transform(texture))
