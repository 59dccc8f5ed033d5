"""A texture of each kind with a uv transform, and the same picture repeated texel by texel."""

from __future__ import annotations

import numpy as np

from lambent.scenes.scene import Texture

REPEATED = ("diffuse", "specular", "roughness", "normal", "direction", "opacity")
_TWICE_AND_THRICE = ((2.0, 0.0, 3.0), (0.0, 3.0, -1.0))  # moved by whole pictures, too


def tiles(part: str) -> tuple[Texture, Texture]:
    """A texture that a transform repeats twice across and three times up, and one whose texels are so repeated."""
    u, v = (np.indices((4, 4)) + 0.5) / 4
    across, up = np.sin(2 * np.pi * u), np.cos(2 * np.pi * v)
    texels = {
        "diffuse": np.stack([0.5 + 0.4 * across, 0.5 + 0.4 * up, 0.5 + 0 * u], -1),
        "specular": np.stack([0.5 + 0.4 * up, 0.5 + 0.4 * across, 0.5 + 0 * u], -1),
        "roughness": (0.6 + 0.35 * across * up)[..., None],
        "normal": np.stack([0.4 * across, 0.4 * up, 1 + 0 * u], -1) / np.sqrt(1.32),
        "direction": np.stack([np.cos(across), np.sin(across)], -1),
        "opacity": np.where(across * up > 0, 1.0, 0.0)[..., None],
    }[part].astype(np.float16)
    return Texture(texels, _TWICE_AND_THRICE), Texture(np.tile(texels, (3, 2, 1)))
