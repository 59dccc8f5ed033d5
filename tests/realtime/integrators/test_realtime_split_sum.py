"""Split-sum under light that varies: the level of its cube fits the lobe, and the cube is the right way round."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lambent.core.geometry.directions import normalize, reflect
from lambent.core.views.camera import Camera
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from tests.realtime.lit_wall import cube_of, wall_scene

ABOVE = Camera(name="above", position=(0.0, 0.0, 2.0), target=(0.0, 0.0, 0.0), fov_y_deg=0.5)
STATE = FrameState(ABOVE, 4, 4, antialias=False, show="specular", lookup="plain", integrator="split-sum")


def lamp(w: np.ndarray) -> np.ndarray:
    """A lamp of some 20 degrees about +z, and less light from everywhere."""
    return np.repeat(0.1 + np.exp(30 * (w[..., 2:] - 1)), 3, axis=-1)


def seen(device: Any, state: FrameState, light: Any, **lobe: float) -> np.ndarray:
    material = Material(name="m", lobes=(Lobe(r0=0.8, **lobe),))
    return Renderer(device, wall_scene(material, cube_of(light, 128))).image(state)


def slopes_of(m: float, n: int = 400) -> np.ndarray:
    """(n n, 2) slopes that follow a Beckmann lobe."""
    u = (np.arange(n) + 0.5) / n
    r, phi = np.sqrt(-np.log1p(-u))[:, None], 2 * np.pi * u
    return m * np.stack([r * np.cos(phi), r * np.sin(phi)], axis=-1).reshape(-1, 2)


@pytest.mark.parametrize("m", [0.03, 0.6])
def test_seen_from_above_it_is_the_mean_over_the_lobe(device: Any, m: float) -> None:
    """The albedo times the mean light of the mirrored directions, weighted by their cosine (Karis 2013)."""
    slopes = slopes_of(m)
    h = normalize(np.column_stack([slopes, np.ones(len(slopes))]))
    up = np.array([0.0, 0.0, 1.0])
    w = reflect(np.broadcast_to(up, h.shape), h)
    cosine = np.maximum(w[:, 2:], 0)
    mean = (cosine * lamp(w)).sum(axis=0) / cosine.sum()
    material = Material(lobes=(Lobe(mx=m, my=m, r0=0.8, alpha=0.3),))
    expected = MaterialBSDF(material).albedo(up, samples=60_000) * mean
    image = seen(device, STATE, lamp, mx=m, my=m, alpha=0.3)
    np.testing.assert_allclose(image.mean(axis=(0, 1)), expected, rtol=0.06)


@pytest.mark.long
def test_a_brushed_lobe_looks_up_the_level_of_its_mean_roughness(device: Any) -> None:
    brushed, even = (seen(device, STATE, lamp, mx=mx, my=my) for mx, my in ((0.5, 0.125), (0.25, 0.25)))
    np.testing.assert_allclose(brushed, even, rtol=2e-3)
    assert seen(device, STATE, lamp, mx=0.125, my=0.125).mean() > 1.3 * even.mean()
