"""Light fields in rotated surroundings (thesis R, chapter 5)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lambent.baked.light_fields.light_field import LightField, Sky
from lambent.core.arrays import Floats
from lambent.core.geometry.octahedral import texel_directions


def turned(sky: Sky, rotation: Floats) -> Sky:
    """The sky rotated by a matrix (3, 3)."""
    return lambda w: sky(w @ rotation)


def under_sky(field: LightField, sky: Sky) -> LightField:
    """The light field with another sky in its maps; light that surfaces received from the old sky stays."""
    n = field.radiance.shape[1]
    behind = sky(texel_directions(n).reshape(-1, 3)).reshape(n, n, 3).astype(field.radiance.dtype)
    radiance = np.where((np.asarray(field.inverse_distance) == 0)[..., None], behind, np.asarray(field.radiance))
    return replace(field, radiance=radiance, blocks=None)  # blocks hold the old sky
