"""Texels path traced with other materials: a furnace whose irradiance is known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lambent.baking.surfaces.atlas import merged, unwrap
from lambent.core.progress import silent
from lambent.materials.document import Material
from tests.baking.small_scenes import furnace


@pytest.mark.parametrize(("albedo", "radiance"), [(0.5, 1.0), (0.25, 2 / 3)])
def test_irradiance_at_texels_is_that_of_the_edited_scene(mi: Any, albedo: float, radiance: float) -> None:
    """Emission .5: radiance .5 / (1 - albedo) everywhere, irradiance pi times that."""
    from lambent.baking.reference.at_texels import retraced
    from lambent.baking.tracing.traced_scene import TracedScene

    atlas = unwrap(furnace(), 48)
    traced = TracedScene(atlas, merged(atlas), [False])
    sides = traced.lit_sides(1.0)
    chosen = np.arange(0, len(sides.texels.index), 16)
    found = retraced(traced, sides, chosen, {"grey": Material(kd=albedo)}, 256, 0, silent)
    assert found.shape == (2, len(chosen), 3)
    assert found.mean() == pytest.approx(np.pi * radiance, rel=0.01)
    assert np.abs(found.mean(axis=(0, 2)) / (np.pi * radiance) - 1).max() < 0.3  # 256 paths of deviation below 1
