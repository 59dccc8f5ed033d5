"""A lobe under one small lamp: quadrature over the lamp, and the shader's twin."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry.directions import normalize
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.lamp_light import lamp_response
from lambent.realtime.gpu.shader_source import assemble
from tests.materials.test_lobes_shader import declared
from tests.tools.shader_parity import assert_parity, run_wgsl

LOBES = {
    "satin": Lobe(mx=0.1, my=0.1, r0=(0.9, 0.7, 0.4), alpha=0.4),
    "rough": Lobe(mx=0.4, my=0.4, r0=0.7, alpha=0.5),
    "brushed": Lobe(mx=0.3, my=0.1, r0=0.8, alpha=0.5),
    "ggx": Lobe(mx=0.2, my=0.15, r0=0.5, distribution="ggx"),
    "transmission": Lobe(mx=0.2, my=0.2, r0=0.1, k=(0.8, 0.7, 0.6), side="transmission"),
    "retro": Lobe(mx=0.15, my=0.2, r0=1.0, k=0.7, retro=True, alpha=-1.5),
}
TOLERANCE = {"ggx": 0.04}  # of the largest value; a lobe without a variance is widened by a fit


def disc(w: np.ndarray, a: np.ndarray, b: np.ndarray, steps: int = 41) -> np.ndarray:
    """Unit directions (K, 3) spread evenly over an elliptic lamp with the deviations a, b."""
    grid = (np.arange(steps) + 0.5) / steps * 2 - 1
    x, y = np.meshgrid(grid, grid)
    inside = x * x + y * y < 1
    return normalize(w + 2 * (x[inside][:, None] * a + y[inside][:, None] * b))


def viewers(lobe: Lobe, w: np.ndarray, count: int) -> np.ndarray:
    """Directions wo about the middle of the lobe that a lamp at w fills, at least .25 high."""
    turn = np.array([1, 1, -1]) if lobe.side == "transmission" else 1
    mirror = np.array([1, 1, 1]) if lobe.retro else np.array([-1, -1, 1])
    rng = np.random.default_rng(1)
    wo = normalize(w * turn * mirror + rng.normal(size=(4 * count, 3)) * 2 * max(lobe.mx, lobe.my))
    return wo[wo[:, 2] > 0.25][:count]


@pytest.mark.parametrize("name", LOBES)
@pytest.mark.parametrize("length", [1.0, 4.0])
def test_the_mean_over_a_lamp(name: str, length: float) -> None:
    """Round lamps of .6 of the lobe's width, and others of four times the length."""
    lobe = LOBES[name]
    narrow = 0.6 * np.sqrt(lobe.mx * lobe.my) / np.sqrt(2 * length)
    w = normalize(np.array([0.3, 0.2, 0.8])) * ([1, 1, -1] if lobe.side == "transmission" else 1)
    u = normalize(np.cross([0.3, 1.0, 0.2], w))
    axes = np.stack([u * narrow * np.sqrt(length), np.cross(w, u) * narrow / np.sqrt(length)])
    wo = viewers(lobe, w, 40)
    bsdf, wi = MaterialBSDF(Material(name="m", lobes=(lobe,))), disc(w, *axes)
    expected = np.array([(bsdf.eval(wi, np.broadcast_to(o, wi.shape)) * np.abs(wi[:, 2:])).mean(axis=0) for o in wo])
    got = lamp_response(lobe, wo, np.broadcast_to(w, wo.shape), np.broadcast_to(axes, (len(wo), 2, 3)))
    assert np.abs(got - expected).max() < TOLERANCE.get(name, 0.02) * expected.max()


def test_a_lamp_sets_smoothly() -> None:
    lobe = LOBES["rough"]
    height = np.linspace(-0.4, 0.4, 400)
    w = np.stack([np.sqrt(1 - height**2), 0 * height, height], axis=-1)
    up = np.stack([-height, 0 * height, np.sqrt(1 - height**2)], axis=-1)
    side = np.broadcast_to([0.0, 1.0, 0.0], w.shape)
    got = lamp_response(
        lobe, np.broadcast_to(normalize(np.array([-1, 0, 0.5])), w.shape), w, 0.08 * np.stack([up, side], 1)
    )
    light = got[:, 0]
    assert light[height < -0.12].max() == 0
    assert (np.diff(light[height < 0.1]) >= 0).all()
    assert np.diff(light).max() < 0.05 * light.max()


@pytest.mark.parametrize("name", LOBES)
def test_numpy_and_the_shader_agree(name: str) -> None:
    lobe = LOBES[name]
    rng = np.random.default_rng(3)
    wo = normalize(rng.normal(size=(4000, 3)))
    wo[:, 2] = np.abs(wo[:, 2])
    wi = normalize(rng.normal(size=wo.shape))
    axes = rng.normal(size=(len(wo), 2, 3)) * rng.uniform(0.001, 0.2, (len(wo), 1, 1))
    axes -= wi[:, None] * (axes * wi[:, None]).sum(axis=-1, keepdims=True)
    side = np.array([-1.0, -1.0, 1.0] if lobe.retro else [1.0, 1.0, 1.0])
    side = side * ([1, 1, -1] if lobe.side == "transmission" else 1)
    expected = lamp_response(lobe, wo, wi * side, axes * side)
    got = run_wgsl(
        assemble("lobes.wgsl", "lamp_light.wgsl"), "lambent_lamp_response(LOBE, wo, wi, a, b)",
        {"wo": wo, "wi": wi, "a": axes[:, 0], "b": axes[:, 1]}, components=3, declarations=declared(lobe),
    )  # fmt: skip
    assert_parity(got, expected.astype(np.float32), rtol=2e-3, atol=1e-4 * float(expected.max()))
