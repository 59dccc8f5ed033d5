"""Quantities of a surface that are one number everywhere, or a picture of numbers: the arithmetic of loaders.

Formats multiply factors and pictures, and derive one quantity from several; here that is plain array functions. At the
end `relative` splits a quantity into the number of the material's document, its mean, and a texture that multiplies it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from lambent.core.colour import HALF_MAX
from lambent.core.directions import Floats
from lambent.scenes.scene import Texture

UvTransform = tuple[tuple[float, float, float], tuple[float, float, float]]
IDENTITY: UvTransform = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
EVEN = 1e-3  # a picture that departs from its mean by less than this share is no picture


@dataclass(frozen=True)
class Varying:
    """`values` is (C,), or (H, W, C) linear texels laid out as a `scene.Texture`'s."""

    values: Floats
    uv_transform: UvTransform = IDENTITY

    @property
    def is_picture(self) -> bool:
        return self.values.ndim == 3

    @property
    def mean(self) -> Floats:
        """(C,)"""
        mean: Floats = self.values.mean(axis=(0, 1), dtype=float) if self.is_picture else self.values
        return mean

    @property
    def highest(self) -> Floats:
        """(C,)"""
        highest: Floats = self.values.max(axis=(0, 1)).astype(float) if self.is_picture else self.values
        return highest

    def channel(self, index: int) -> Varying:
        """One channel, (1,) or (H, W, 1)."""
        return Varying(self.values[..., index : index + 1], self.uv_transform)

    def averaged(self) -> Varying:
        return Varying(self.mean)


def constant(values: ArrayLike) -> Varying:
    """The same everywhere; (C,), a single number becomes (1,)."""
    return Varying(np.atleast_1d(np.asarray(values, float)))


def scaled(v: Varying, factor: float | Floats) -> Varying:
    """`v` times a number, or one per channel."""
    return Varying(v.values * np.asarray(factor, v.values.dtype), v.uv_transform)


def combined(function: Callable[..., Any], *inputs: Varying, said: list[str], what: str = "textures") -> Varying:
    """`function` of the inputs' values, texel by texel.

    Pictures of one uv transform are brought to the size of the largest. One that is laid out otherwise than the first
    becomes its mean, which `said` is told, naming `what`.
    """
    pictures = [v for v in inputs if v.is_picture]
    if not pictures:
        return Varying(np.asarray(function(*(v.values for v in inputs)), float))
    lead = max((v for v in pictures if v.uv_transform == pictures[0].uv_transform), key=lambda v: v.values.size)
    height, width = lead.values.shape[:2]
    values = []
    for v in inputs:
        if v.is_picture and v.uv_transform != lead.uv_transform:
            said.append(f"{what} lie differently on the surface: one is averaged")
            values.append(v.mean)
        else:
            values.append(_resized(v.values, height, width) if v.is_picture else v.values)
    return Varying(np.asarray(function(*values), np.float32), lead.uv_transform)


def _resized(texels: Floats, height: int, width: int) -> Floats:
    if texels.shape[:2] == (height, width):
        return texels
    rows = (np.arange(height) + 0.5) * texels.shape[0] / height
    columns = (np.arange(width) + 0.5) * texels.shape[1] / width
    return texels[rows.astype(int)[:, None], columns.astype(int)]


def relative(v: Varying, seen: Texture | None = None) -> tuple[Floats, Texture | None]:
    """The mean (C,) of a quantity, and the texture that multiplies it; None where it does not vary.

    With a mask `seen` of the same layout the mean is that of what is to be seen.
    """
    mean = v.mean
    if not v.is_picture:
        return mean, None
    if seen is not None and seen.uv_transform == v.uv_transform:
        weight = _resized(seen.texels, *v.values.shape[:2]).astype(float)
        if float(weight.sum()) > 0:
            mean = (v.values * weight).sum(axis=(0, 1)) / weight.sum()
    texels = np.divide(v.values, mean, out=np.ones_like(v.values), where=mean > 0)
    if float(np.abs(texels - 1).max()) < EVEN:
        return mean, None
    return mean, Texture(np.minimum(texels, HALF_MAX).astype(np.float16), v.uv_transform)


def absolute(v: Varying) -> Texture:
    """A texture of the values themselves; a constant becomes one texel."""
    values = v.values if v.is_picture else v.values[None, None]
    return Texture(np.clip(values, -HALF_MAX, HALF_MAX).astype(np.float16), v.uv_transform)
