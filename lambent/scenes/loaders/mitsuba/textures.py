"""Mitsuba's textures as quantities that vary over the surface.

Its v counts from the top of a picture, ours from the bottom: layouts are turned over on both sides.
"""

from __future__ import annotations

import numpy as np

from lambent.core.directions import Floats
from lambent.scenes.loaders.mitsuba.values import Plugin
from lambent.scenes.loaders.place import found
from lambent.scenes.loaders.varying import UvTransform, Varying, combined, constant

CHECKS = 128  # texels along a checkerboard of 2 x 2 fields
GREY = 0.5
LUMINANCE = np.array([0.212671, 0.715160, 0.072169], np.float32)
_TURNED = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, 1.0]])
# What an exporter leaves of a picture's name that says it holds numbers, not colours, is `raw`; 0.6 says gamma = 1.


def colour(plugin: Plugin, name: str, default: float | Floats, *, emitted: bool = False) -> Varying:
    """Linear RGB of a plugin's parameter, which may be of light that is `emitted`."""
    fixed = plugin.constant(name, emitted=emitted)
    if fixed is not None:
        return constant(fixed)
    texture = plugin.texture(name)
    if texture is None:
        return constant(np.broadcast_to(np.asarray(default, float), 3).copy())
    return of_texture(texture)


def number(plugin: Plugin, name: str, default: float) -> Varying:
    """One channel of a plugin's parameter: of a texture its luminance."""
    v = colour(plugin, name, default)
    if not v.is_picture:
        return constant(float(v.values.mean()))
    return Varying((v.values @ LUMINANCE)[..., None], v.uv_transform)


def opacity(plugin: Plugin, name: str) -> Varying:
    """As `number`; of a picture with an alpha channel that is meant."""
    texture = plugin.texture(name)
    if texture is not None and texture.type == "bitmap":
        read = _picture(texture)
        if read is not None and read[0].alpha:
            texture.ignore("gamma", "raw")
            plugin.say("its mask is the picture's alpha channel")
            return Varying(read[0].opacity(), read[1])
    return number(plugin, name, GREY)


def of_texture(texture: Plugin) -> Varying:
    """Linear RGB of a texture."""
    if texture.type == "bitmap":
        v = _bitmap(texture)
    elif texture.type == "checkerboard":
        v = _checkerboard(texture)
    elif texture.type == "scale":
        inner = next(iter(texture.objects("texture")), None)
        factor = texture.constant("scale")
        base = of_texture(inner) if inner is not None else constant(np.full(3, GREY))
        v = combined(lambda a, b: a * b, base, constant(np.ones(3) if factor is None else factor), said=[])
    elif texture.type in ("rgb", "srgb", "uniform", "d65", "rawconstant", "constant"):
        v = colour(texture, "color" if texture.has("color") else "value", GREY)
    else:
        texture.say("unknown texture, it is grey")
        return constant(np.full(3, GREY))
    texture.say_unread()
    return v


def raw_picture(texture: Plugin) -> Varying | None:
    """Values of a bitmap as they stand, (H, W, 3), for normal maps."""
    read = _picture(texture)
    if read is None:
        return None
    texture.ignore("gamma", "raw", "wrap_mode", "wrap_mode_u", "wrap_mode_v")
    return Varying(read[0].rgb(srgb=False), read[1])


def _bitmap(texture: Plugin) -> Varying:
    read = _picture(texture)
    if read is None:
        return constant(np.full(3, GREY))
    picture, layout = read
    gamma = texture.number("gamma", 0.0)
    raw = texture.flag("raw", False) or gamma == 1
    texels = picture.rgb(srgb=not raw and gamma <= 0)
    if not raw and gamma > 0 and picture.texels.dtype == np.uint8:
        texels = texels ** np.float32(gamma)
    for side in ("wrap_mode", "wrap_mode_u", "wrap_mode_v"):
        mode = texture.text(side, "repeat").lower()
        if mode != "repeat":
            texture.say(f"its picture is repeated beyond its edges, not {mode}")
    channel = texture.text("channel").lower()
    if channel in ("r", "g", "b"):
        texels = np.repeat(texels[..., ["r", "g", "b"].index(channel), None], 3, axis=-1)
    elif channel == "a":
        texels = np.repeat(picture.opacity(), 3, axis=-1)
    return Varying(texels, layout)


def _picture(texture: Plugin):  # type: ignore[no-untyped-def]
    """The picture of a bitmap and its layout; None where the file is not there, which is said."""
    reading = texture.reading
    name = texture.text("filename")
    layout = _layout(texture)
    path, moved = found(name, texture.element.file, reading.document.root, f"line {texture.element.line} filename")
    if not path.is_file():
        texture.say(f"picture {name} is not there: it is grey")
        return None
    if moved:
        texture.say(f"picture {name} was found beside {texture.element.file.name}")
    if path not in reading.sources:
        reading.sources.append(path)
    return reading.pictures.of_file(path), layout


def _layout(texture: Plugin) -> UvTransform:
    """Our uv transform of Mitsuba's to_uv (3), or of its scales and offsets (0.6)."""
    theirs = np.eye(3)
    matrix = texture.transform("to_uv")
    theirs[:2, :2], theirs[:2, 2] = matrix[:2, :2], matrix[:2, 3]
    both = texture.number("uvscale", 1.0)
    scale = [texture.number(f"{c}scale", both) for c in "uv"]
    old = np.diag([*scale, 1.0])
    old[:2, 2] = [texture.number(f"{c}offset", 0.0) for c in "uv"]
    m = _TURNED @ old @ theirs @ _TURNED
    (a, b, c), (d, e, f) = m[:2].tolist()
    return (a, b, c), (d, e, f)


def _checkerboard(texture: Plugin) -> Varying:
    dark, light = (
        colour(texture, name if texture.has(name) else other, default).mean
        for name, other, default in (("color0", "color_0", 0.4), ("color1", "color_1", 0.2))
    )
    second = np.arange(CHECKS) >= CHECKS // 2
    differs = second[:, None] != second[None, :]
    texels = np.where(differs[..., None], light, dark).astype(np.float32)
    return Varying(texels, _layout(texture))
