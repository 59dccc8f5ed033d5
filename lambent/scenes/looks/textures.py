"""Textures as arrays: interpolated quantities, reduction, and filling beyond masks.

Texels are averaged as quantities with meaningful means: normals as slopes, directions (which have no sign) as doubled
angles. Path tracer and renderer interpolate the same quantities.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.scenes.scene import MaterialTextures, Texture

CHANNELS: Mapping[str, int] = {
    "diffuse": 3, "specular": 3, "roughness": 1, "normal": 3, "direction": 2, "opacity": 1,
}  # fmt: skip
SIDE_MAX = 2048  # texels; larger textures are halved until they fit
STEEPEST = 8.0  # slope; limit for steeper normals, and for those below the surface


def parts(textures: MaterialTextures) -> dict[str, Texture]:
    """The textures of a material, by field name."""
    found = {name: getattr(textures, name) for name in CHANNELS}
    return {name: texture for name, texture in found.items() if texture is not None}


def slopes(normals: Floats) -> NDArray[np.float32]:
    """(..., 2) slopes n_t/n_n and n_b/n_n of normals (..., 3), which need not be unit."""
    n = np.asarray(normals, np.float32)
    across = np.abs(n[..., :2]).max(axis=-1)
    return np.asarray(n[..., :2] / np.maximum(n[..., 2], np.maximum(across / STEEPEST, 1e-6))[..., None])


def doubled_angle(directions: Floats) -> NDArray[np.float32]:
    """(..., 2) cosine and sine of twice the angle of (cosine, sine) (..., 2); t and -t give the same."""
    c, s = np.moveaxis(np.asarray(directions, np.float32), -1, 0)
    square = np.maximum(c * c + s * s, 1e-12)
    return np.stack([(c * c - s * s) / square, 2 * c * s / square], axis=-1)


def halved(texels: Floats) -> Floats:
    """The next smaller level (max(1, H//2), max(1, W//2), C): means of equal areas, also if a side is odd."""
    return _halved_along(_halved_along(texels, 0), 1)


def _halved_along(texels: Floats, axis: int) -> Floats:
    x = np.moveaxis(texels, axis, 0)
    n, m = len(x), len(x) // 2
    if n == 1:
        return texels
    if n % 2 == 0:
        mean = (x[0::2] + x[1::2]) * np.float32(0.5)
    else:  # each covers 2 + 1/m texels
        i = np.arange(m, dtype=np.float32)[:, None, None]
        mean = ((m - i) * x[0:-1:2] + m * x[1::2] + (i + 1) * x[2::2]) / np.float32(n)
    return np.asarray(np.moveaxis(mean, 0, axis))


def filled(texels: Floats, known: NDArray[np.bool_]) -> Floats:
    """Texels (H, W, C) with unknown ones replaced by means of the nearest `known` ones (H, W).

    Otherwise the white behind the leaves of a texture would enter every mean over an edge and show inside the mask.
    """
    weight = known[..., None].astype(np.float32)
    levels = [(texels.astype(np.float32) * weight, weight)]
    while max(weight.shape[:2]) > 1:
        levels.append((halved(levels[-1][0]), halved(levels[-1][1])))
        weight = levels[-1][1]
    result = levels[-1][0] / np.maximum(levels[-1][1], 1e-12)
    for total, weight in reversed(levels[:-1]):
        rows, columns = (np.arange(n) * m // n for n, m in zip(weight.shape, result.shape[:2], strict=False))
        result = np.where(weight > 0, total / np.maximum(weight, 1e-12), result[rows[:, None], columns])
    return np.where(known[..., None], texels, result.astype(texels.dtype))


def prepared(textures: Mapping[str, MaterialTextures]) -> dict[str, MaterialTextures]:
    """Textures ready for a bake: checked, at most SIDE_MAX texels per side, colours filled beyond a mask's edge."""
    return {name: _filled(of_material) for name, of_material in _bounded(textures).items()}


def _filled(textures: MaterialTextures) -> MaterialTextures:
    mask = textures.opacity
    if mask is None:
        return textures
    known = mask.texels[..., 0] >= textures.cutoff
    if not known.any():
        return textures
    colours: dict[str, Any] = {
        part: replace(texture, texels=filled(texture.texels, known))
        for part, texture in parts(textures).items()
        if part in ("diffuse", "specular")
        and (texture.uv_transform, texture.texels.shape[:2]) == (mask.uv_transform, known.shape)
    }
    return replace(textures, **colours)


def _bounded(textures: Mapping[str, MaterialTextures]) -> dict[str, MaterialTextures]:
    smaller: dict[int, Texture] = {}  # keeps a texture shared by several materials shared
    found = {}
    for material, of_material in textures.items():
        changed: dict[str, Any] = {}
        for part, texture in parts(of_material).items():
            check(material, part, texture)
            if max(texture.texels.shape[:2]) > SIDE_MAX:
                if id(texture.texels) not in smaller:
                    smaller[id(texture.texels)] = replace(texture, texels=_reduced(texture.texels))
                changed[part] = replace(texture, texels=smaller[id(texture.texels)].texels)
        found[material] = replace(of_material, **changed)
    return found


def _reduced(texels: Floats) -> Floats:
    values = texels.astype(np.float32)
    while max(values.shape[:2]) > SIDE_MAX:
        values = halved(values)
    return values.astype(np.float16)


def check(material: str, part: str, texture: Texture) -> None:
    """Raise `UserError` if a texture cannot be `part` of a material."""
    shape = texture.texels.shape
    field = f"{part} texture of {material}"
    if len(shape) != 3 or shape[2] != CHANNELS[part] or 0 in shape:
        raise UserError("texture has another shape", field=field, got=shape, expected=f"(H, W, {CHANNELS[part]})")
    if not (np.isfinite(texture.texels).all() and np.isfinite(texture.uv_transform).all()):
        raise UserError("texture holds numbers that are not finite", field=field)


def digest(texture: Texture) -> str:
    """Hash of a texture's texels and uv transform."""
    h = hashlib.sha256(f"{texture.texels.shape} {texture.texels.dtype} {texture.uv_transform}".encode())
    h.update(np.ascontiguousarray(texture.texels).tobytes())
    return h.hexdigest()
