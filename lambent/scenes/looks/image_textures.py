"""Images shown as the diffuse texture of a material: their mean colour, and the detail that multiplies it."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lambent.core.errors import UserError
from lambent.core.plain import Triple, triple
from lambent.scenes.loaders.surfaces.material_builder import read_texture_image
from lambent.scenes.loaders.surfaces.textured import Textured, relative
from lambent.scenes.scene import IDENTITY, ImageTexture, MaterialTextures, Texture

MOST_REPEAT = 1000.0
KEPT = 6  # images in memory; one of 2048 x 2048 texels takes 25 MB


class MeanAndDetail(NamedTuple):
    """Mean reflectance of an image, linear RGB, and the texture that multiplies it; None for an even image."""

    mean: Triple
    detail: Texture | None


def mean_and_detail(file: Path) -> MeanAndDetail:
    """Split an image into its mean and its detail. Values of EXR and HDR count as reflectances, at most 1.

    Raises
    ------
    UserError
        If it cannot be read.
    """
    try:
        changed_ns = file.stat().st_mtime_ns
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise UserError(f"image cannot be read ({why})", file=file) from error
    return _read(file, changed_ns)


@lru_cache(KEPT)
def _read(file: Path, changed_ns: int) -> MeanAndDetail:
    rgb = read_texture_image(file, []).rgb(srgb=True)
    mean, detail = relative(Textured(np.clip(np.nan_to_num(rgb.values), 0.0, 1.0)))
    return MeanAndDetail(triple(mean), detail)


def with_image(own: MaterialTextures | None, image: ImageTexture) -> MaterialTextures:
    """A material's own textures with an image as the diffuse one; `UserError` if it cannot be read."""
    detail, base = mean_and_detail(Path(image.file)).detail, own or MaterialTextures()
    if detail is None:
        return replace(base, diffuse=None)
    placed = base.diffuse.uv_transform if base.diffuse is not None else IDENTITY
    u, v = (triple(image.repeat * x for x in row) for row in placed)
    return replace(base, diffuse=Texture(detail.texels, (u, v)))
