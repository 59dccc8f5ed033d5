"""The kernel that turns photons per texel into irradiance: energy, uniform light, leaks and fine texels."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baking.photons.density import Kernel
from lambent.baking.surfaces.coverage import texel_areas
from lambent.baking.surfaces.texels import Texels, texels_of

SIDE = 32  # texels
FINE = 8  # times finer are the texels of the strip
Patch = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


def map_of(patches: list[tuple[Patch, tuple[float, float, float, float]]]) -> tuple[Texels, np.ndarray]:
    """Texels and their areas of parallelograms (corner, edge, edge), each in its rectangle of the map, in texels."""
    positions, normals, uv2, faces = [], [], [], []
    for (corner, first, second), (x, y, width, height) in patches:
        faces.append(np.array([[0, 1, 2], [0, 2, 3]]) + 4 * len(faces))
        edges = np.array([np.zeros(3), first, np.add(first, second), second])
        positions.append(np.array(corner) + edges)
        normal = np.cross(first, second)
        normals.append(np.tile(normal / np.linalg.norm(normal), (4, 1)))
        uv2.append(np.array([(x, y), (x + width, y), (x + width, y + height), (x, y + height)]) / SIDE)
    parts = {"positions": positions, "normals": normals, "uv2": uv2, "faces": faces}
    geometry = {name: np.concatenate(part) for name, part in parts.items()}
    return texels_of(geometry, SIDE, SIDE), texel_areas(geometry, SIDE, SIDE)


def strip() -> tuple[Texels, np.ndarray]:
    """A floor of texels of 10 cm, and beside it a joint one fine texel wide; borders across texels."""
    floor = ((0, 0, 0), (0, 0, 1.25), (2, 0, 0)), (1.3, 1.4, 12.5, 20)
    joint = ((0, 0, 1.25), (0, 0, 0.1 / FINE), (0.25, 0, 0)), (20, 2, 1, 20)
    return map_of([floor, joint])


def kernel_of(texels: Texels, area: np.ndarray) -> Kernel:
    return Kernel(area, texels, np.ones(len(texels.index)))


def test_light_reaches_a_part_of_some_texels() -> None:
    """Half of the strip's texels lie in a solid, others by a share: uniform light stays uniform in the rest."""
    texels, area = strip()
    rng = np.random.default_rng(2)
    share = rng.uniform(0.3, 1, len(texels.index)) * (rng.random(len(texels.index)) < 0.5)
    kernel, lit = Kernel(area, texels, share), np.zeros(SIDE * SIDE)
    lit[texels.index] = share
    flux = area * lit.reshape(SIDE, SIDE)
    assert kernel.area.sum() == pytest.approx(flux.sum())
    assert kernel.known.sum() > 0.45 * (area > 0).sum() and not kernel.known[lit.reshape(SIDE, SIDE) == 0].any()
    assert np.allclose(kernel.irradiance(np.repeat(flux[..., None], 3, 2))[kernel.known], 1, rtol=1e-5)


def test_energy_and_uniform_light_stay() -> None:
    texels, area = strip()
    kernel = kernel_of(texels, area)
    assert np.allclose(kernel.irradiance(np.repeat(area[..., None], 3, 2))[kernel.known], 1, rtol=1e-5)
    known = kernel.known & (area > 0)
    flux = np.random.default_rng(1).exponential(size=(SIDE, SIDE, 3)) * known[..., None]
    received = kernel.irradiance(flux) * area[..., None]
    assert area[kernel.known].sum() == pytest.approx(area.sum(), rel=1e-6), "nothing is left out here"
    assert received.sum(axis=(0, 1)) == pytest.approx(flux.sum(axis=(0, 1)), rel=1e-4)


def test_fine_texels_share_their_photons() -> None:
    texels, area = strip()
    kernel = kernel_of(texels, area)
    fine = (area > 0) & (np.arange(SIDE) >= 18)
    photons = np.random.default_rng(1).poisson(400 * np.repeat((area * 100)[..., None], 3, 2)) / 4e4
    error = photons[fine] / area[fine][:, None] - 1
    assert np.sqrt((kernel.irradiance(photons)[fine] - 1).var()) < 0.4 * np.sqrt((error**2).mean())


@pytest.mark.parametrize("other", [((0, -0.1, 0), (0, 0, 1), (1, 0, 0)), ((0, 0, 0), (0, 0, 1), (0, 1, 0))])
def test_no_light_leaks_to_what_lies_below_or_stands_on_edge(other: Patch) -> None:
    floor = ((0, 0, 0), (0, 0, 1), (1, 0, 0)), (1, 1, 12, 12)
    for width, rest in ((12, floor), (1, floor)):
        texels, area = map_of([rest, (other, (17, 1, width, 12))])
        dark = np.tile(np.arange(SIDE) >= 16, (SIDE, 1))
        lit = ~dark & (area > 0)
        found = kernel_of(texels, area).irradiance(np.repeat((area * lit)[..., None], 3, 2))
        assert found[dark].max() < 0.02 and np.allclose(found[lit], 1, atol=0.02)
