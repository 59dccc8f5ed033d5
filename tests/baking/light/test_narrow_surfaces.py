"""Surfaces narrower than a texel, beside light that varies across them: both integrators against quadrature."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.surfaces.coverage import texel_areas
from lambent.baking.surfaces.texels import texels_of
from lambent.scenes.geometry import patch
from lambent.scenes.scene import Scene, SceneObject
from lambent.store.store import Store
from tests.baking.small_scenes import BLACK, TINY

WIDE, LONG, HIGH, BEYOND, RADIANCE = 0.03, 3.0, 0.02, 1.0, 5.0  # metres; W/(sr m^2)
QUALITY = TINY.changed(
    "narrow", geometry={"texels": 64}, light_map={"samples": (512, 512), "max_depth": 1, "photons_per_texel": 256}
)
BLOCKS = 16


def scene() -> Scene:
    """A strip along z, and on its one border, upright, a lamp that goes on beyond its ends; it is dark elsewhere.

    A floor far below makes the texels large.
    """
    strip = patch((0, 0, LONG / 2), (WIDE, 0, 0), (0, 0, -LONG))
    lamp = patch((0, 0, LONG / 2 + BEYOND), (0, 0, -LONG - 2 * BEYOND), (0, HIGH, 0))
    floor = patch((-1.5, -1, 1.5), (3, 0, 0), (0, 0, -3))
    objects = (
        SceneObject("strip", strip, "black"),
        SceneObject("lamp", lamp, "black", emission=(RADIANCE,) * 3),
        SceneObject("floor", floor, "black"),
    )
    return Scene("narrow", objects, {"black": BLACK})


def by_quadrature() -> float:
    """Mean irradiance: L x h / (D^2 + z^2)^2 over the lamp, x from its plane, h up, z along it, D^2 = x^2 + h^2.

    Over z the integral is x h (z / (2 D^2 (D^2 + z^2)) + atan(z/D) / (2 D^3)); the rest are sums, finer at the border.
    """
    x, x_step = cells(WIDE, 600)
    h, h_step = cells(HIGH, 400)
    x, h = x[:, None, None], h[None, :, None]
    z = LONG * (np.arange(40) + 0.5) / 40 - LONG / 2
    d2, along = x**2 + h**2, 0.0
    for end in (LONG / 2 + BEYOND - z, LONG / 2 + BEYOND + z):
        along = along + end / (2 * d2 * (d2 + end**2)) + np.arctan(end / np.sqrt(d2)) / (2 * d2**1.5)
    over_strip = (x * h * along).mean(axis=2) * x_step[:, None] * h_step
    return float(RADIANCE * over_strip.sum() / WIDE)


def cells(length: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Middles and widths of cells that grow in proportion to where they are."""
    edges = length * np.linspace(0, 1, count + 1) ** 2
    return (edges[1:] + edges[:-1]) / 2, np.diff(edges)


def strip_of(store: Store) -> tuple[np.ndarray, np.ndarray]:
    """(H, W) area of the strip in each texel, and which of BLOCKS along it that lies in."""
    geometry = {name: store.read(f"geometry/{name}") for name in ("positions", "normals", "uv2", "faces")}
    first = store.documents["scene"]["objects"][0]
    mine = slice(first["first_face"], first["first_face"] + first["face_count"])
    height, width = store.read("light_map/irradiance").shape[:2]
    geometry["faces"] = geometry["faces"][mine]
    texels, block = texels_of(geometry, width, height), np.zeros(height * width, int)
    block[texels.index] = BLOCKS * (texels.positions[..., 2].mean(axis=1) / LONG + 0.5)
    return texel_areas(geometry, width, height), block.reshape(height, width).clip(0, BLOCKS - 1)


@pytest.mark.long
@pytest.mark.parametrize("integrator", ["paths", "photons"])
def test_mean_irradiance_is_that_of_the_whole_width(tmp_path: Path, integrator: str) -> None:
    store = bake(scene(), tmp_path / integrator, quality=QUALITY, light_map=integrator, only=("light_map",))
    area, block = strip_of(store)
    assert area.sum() == pytest.approx(WIDE * LONG, rel=1e-4)
    if integrator == "photons":
        flux = store.read("light_map/photons")[:, 0, ..., 1].astype(float)
        flux = flux[flux.any(axis=(1, 2))].mean(axis=0)
    else:
        raw = store.read("light_map/traced").astype(float).sum(axis=0)
        flux = area * raw[..., 1] / np.maximum(raw[..., 3], 1)
    # the lamp looks the same from all along the strip: its blocks tell the error, that of the points included
    of_block = [np.bincount(block[area > 0], v[area > 0], minlength=BLOCKS) for v in (flux, area)]
    assert min(of_block[1]) > 0
    residual = of_block[0] - of_block[1] * flux[area > 0].sum() / area.sum()
    mean, error = flux[area > 0].sum() / area.sum(), np.sqrt(BLOCKS / (BLOCKS - 1) * (residual**2).sum()) / area.sum()
    expected = by_quadrature()
    assert error < 0.02 * expected
    assert abs(mean - expected) < 3 * error
