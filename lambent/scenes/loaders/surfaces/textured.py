"""Surface quantities that are constant or textured, and their arithmetic.

Formats multiply factors and textures, and derive one quantity from several. At the end, `relative` splits a quantity
into its mean, the number in the material's document, and a texture that multiplies it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from lambent.core.geometry.directions import Floats
from lambent.core.light.colour import HALF_MAX
from lambent.scenes.scene import IDENTITY, Texture, UvTransform

EVEN = 1e-3  # a texture that deviates from its mean by less than this share is dropped
_V_FLIPPED = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class Textured:
    """`values` is (C,), or (H, W, C) linear texels laid out as a `scene.Texture`'s."""

    values: Floats
    uv_transform: UvTransform = IDENTITY

    @property
    def is_texture(self) -> bool:
        return self.values.ndim == 3

    @property
    def mean(self) -> Floats:
        """(C,)"""
        mean: Floats = self.values.mean(axis=(0, 1), dtype=float) if self.is_texture else self.values
        return mean

    @property
    def highest(self) -> Floats:
        """(C,)"""
        highest: Floats = self.values.max(axis=(0, 1)).astype(float) if self.is_texture else self.values
        return highest

    def channel(self, index: int) -> Textured:
        """One channel, (1,) or (H, W, 1)."""
        return Textured(self.values[..., index : index + 1], self.uv_transform)


def constant(values: ArrayLike) -> Textured:
    """A constant quantity; (C,), a single number becomes (1,)."""
    return Textured(np.atleast_1d(np.asarray(values, float)))


def scaled(v: Textured, factor: float | Floats) -> Textured:
    """`v` times a number, or times one number per channel."""
    return Textured(v.values * np.asarray(factor, v.values.dtype), v.uv_transform)


def combined(function: Callable[..., Any], *inputs: Textured, notes: list[str]) -> Textured:
    """`function` of the inputs' values, texel by texel.

    Textures with the same uv transform are resized to the largest. A texture with another uv transform than the first's
    becomes its mean; `notes` gets a line about it.
    """
    textures = [v for v in inputs if v.is_texture]
    if not textures:
        return Textured(np.asarray(function(*(v.values for v in inputs)), float))
    lead = max((v for v in textures if v.uv_transform == textures[0].uv_transform), key=lambda v: v.values.size)
    height, width = lead.values.shape[:2]
    values = []
    for v in inputs:
        if v.is_texture and v.uv_transform != lead.uv_transform:
            notes.append("textures have different uv transforms: one is averaged")
            values.append(v.mean)
        else:
            values.append(_resized(v.values, height, width) if v.is_texture else v.values)
    return Textured(np.asarray(function(*values), np.float32), lead.uv_transform)


def _resized(texels: Floats, height: int, width: int) -> Floats:
    if texels.shape[:2] == (height, width):
        return texels
    rows = (np.arange(height) + 0.5) * texels.shape[0] / height
    columns = (np.arange(width) + 0.5) * texels.shape[1] / width
    return np.asarray(texels[rows.astype(int)[:, None], columns.astype(int)])


def relative(v: Textured, visible: Texture | None = None) -> tuple[Floats, Texture | None]:
    """The mean (C,) of a quantity, and the texture that multiplies it; None if it is constant.

    With a mask `visible` of the same layout, the mean is over the visible texels.
    """
    mean = v.mean
    if not v.is_texture:
        return mean, None
    if visible is not None and visible.uv_transform == v.uv_transform:
        weight = _resized(visible.texels, *v.values.shape[:2]).astype(float)
        if float(weight.sum()) > 0:
            mean = (v.values * weight).sum(axis=(0, 1)) / weight.sum()
    texels = np.divide(v.values, mean, out=np.ones_like(v.values), where=mean > 0)
    if float(np.abs(texels - 1).max()) < EVEN:
        return mean, None
    return mean, Texture(np.minimum(texels, HALF_MAX).astype(np.float16), v.uv_transform)


def absolute(v: Textured) -> Texture:
    """A texture of the values themselves; a constant becomes one texel."""
    values = v.values if v.is_texture else v.values[None, None]
    return Texture(np.clip(values, -HALF_MAX, HALF_MAX).astype(np.float16), v.uv_transform)


def flipped_uv(theirs: Floats, decimals: int | None = None) -> UvTransform:
    """Our uv transform from a format's (3, 3) matrix whose v points down, for points and for textures."""
    ours = _V_FLIPPED @ theirs @ _V_FLIPPED
    (a, b, c), (d, e, f) = (ours if decimals is None else np.round(ours, decimals))[:2].tolist()
    return (a, b, c), (d, e, f)
