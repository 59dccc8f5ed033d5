"""Materials with a procedural diffuse texture, and meshes that show one of its colours."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.plain import triple
from lambent.materials.document import Lobe, Material
from lambent.scenes.scene import IDENTITY, MaterialTextures, Mesh, Texture, UvTransform


def painted(
    name: str, texels: Floats, *lobes: Lobe, uv_transform: UvTransform = IDENTITY
) -> tuple[Material, MaterialTextures]:
    """A material of diffuse reflectance `texels` (H, W, 3), row 0 on top, under some lobes."""
    mean = texels.mean(axis=(0, 1))
    texture = Texture((texels / mean).astype(np.float16), uv_transform)
    return Material(name=name, kd=triple(mean), lobes=lobes), MaterialTextures(diffuse=texture)


def of_one_colour(mesh: Mesh, u: float, v: float) -> Mesh:
    """`mesh` in the colour that its texture has at one point."""
    return replace(mesh, uv=np.tile(np.array([u, v], np.float32), (len(mesh.positions), 1)))
