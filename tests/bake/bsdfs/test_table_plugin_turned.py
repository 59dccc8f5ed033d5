"""A brushed table on a surface whose tangent is turned: samples, density and value agree in world space."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lambent.bake.bsdfs.table_plugin import table_dict
from lambent.core.geometry.directions import direction, normalize
from lambent.materials.bsdf import MaterialBSDF, components
from lambent.materials.checking.chi_square import chi_square
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.protocol import TableInfo
from lambent.materials.measured.tables.half_vector_grid import GridShape
from lambent.materials.measured.tables.half_vector_resampling import grid_of
from tests.tools.chi_square import LEVEL
from tests.tools.in_mitsuba import square, vectors

BRUSHED = Material(
    kd=(0.05, 0.1, 0.15),
    lobes=(
        Lobe(mx=0.35, my=0.08, k=(0.5, 0.6, 0.7), r0=0.6, alpha=0.3),
        Lobe(side="transmission", mx=0.15, my=0.4, k=0.4, r0=0.1),
    ),
)
N = normalize(np.array([0.3, -0.5, 0.8]))  # a surface that leans, its tangent 130 degrees from any axis in it
E = normalize(np.cross([0.0, 1.0, 0.0], N))
T = np.cos(np.radians(130)) * E + np.sin(np.radians(130)) * np.cross(N, E)
FRAME = np.stack([T, np.cross(N, T), N])
WO = direction(np.radians(50), 0.7)  # the viewer in the frame of the brushing


class Exact:
    """A table without gaps."""

    info = TableInfo("brushed", "exact", False, True, 3, "f")

    def eval(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return MaterialBSDF(BRUSHED).eval(wi, wo)


@pytest.fixture(scope="module")
def seen(mi: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The grid, and what the viewer sees of a square that wears it, for any number of rays."""
    import drjit as dr

    grid = grid_of(Exact(), GridShape(8, 8, 64, 32))
    folder = tmp_path_factory.mktemp("turned")
    scene = square(folder, table_dict(grid), np.stack([E, np.cross(N, E)]), T)
    viewer = mi.Vector3f(*(WO @ FRAME).tolist())

    def interaction(count: int) -> Any:
        origin = 2 * viewer + mi.Vector3f(*(0.1 * E).tolist()) + dr.zeros(mi.Vector3f, count)
        return scene.ray_intersect(mi.Ray3f(mi.Point3f(origin), -viewer))

    return grid, interaction


def density_at(mi: Any, seen: Any, w: np.ndarray) -> np.ndarray:
    """Density in 1/sr of directions w (N, 3) of the world."""
    si = seen[1](len(w))
    return np.array(si.bsdf().pdf(mi.BSDFContext(), si, si.to_local(vectors(w))), float)


def test_samples_follow_the_density_in_world_space(mi: Any, seen: Any) -> None:
    def draw(u: np.ndarray) -> np.ndarray:
        si = seen[1](len(u))
        u0, u1, u2 = (mi.Float(column.astype(np.float32)) for column in u.T)
        bs, _ = si.bsdf().sample(mi.BSDFContext(), si, u0, mi.Point2f(u1, u2))
        return np.array(si.to_world(bs.wo), float).T

    test = chi_square(draw, lambda w: density_at(mi, seen, w), samples=200_000)
    assert test.p_value > LEVEL
    assert test.pdf_integral == pytest.approx(1, abs=0.02)


def test_density_and_value_are_those_of_the_grid_in_the_turned_frame(mi: Any, seen: Any) -> None:
    """Samples and density that ignored the tangent alike would agree with each other."""
    random = np.random.default_rng(2)
    wi = normalize(random.normal(size=(4000, 3)))
    wi = wi[np.abs(wi[:, 2]) > 0.05]
    wo = np.broadcast_to(WO, wi.shape)
    expected = seen[0].pdf(components(wi), components(wo))
    np.testing.assert_allclose(density_at(mi, seen, wi @ FRAME), expected, rtol=5e-3, atol=1e-3)


def test_weights_are_value_over_density(mi: Any, seen: Any) -> None:
    u = np.random.default_rng(3).random((4000, 3)).astype(np.float32)
    si = seen[1](len(u))
    u0, u1, u2 = (mi.Float(column) for column in u.T)
    bs, weight = si.bsdf().sample(mi.BSDFContext(), si, u0, mi.Point2f(u1, u2))
    value, density = si.bsdf().eval_pdf(mi.BSDFContext(), si, bs.wo)
    some = np.array(bs.pdf) > 1e-3
    np.testing.assert_allclose(np.array(bs.pdf)[some], np.array(density)[some], rtol=2e-2)
    ratio = np.array(value / density)[:, some]
    np.testing.assert_allclose(np.array(weight)[:, some], ratio, rtol=2e-2, atol=1e-3)
