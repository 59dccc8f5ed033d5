"""Edited materials in the path tracer: unedited they are their documents; samples have the density that is said."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lambent.core.geometry.directions import normalize
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.of_lobes import of_material

SATIN = Material(kd=(0.4, 0.3, 0.2), lobes=(Lobe(mx=0.3, my=0.15, r0=0.5, k=(0.9, 0.5, 0.3)),))
CURTAIN = Material(kd=0.2, kt_d=0.4, lobes=(Lobe(mx=0.3, my=0.3, r0=0.5, side="transmission"),))
BEADS = Material(kd=0.1, lobes=(Lobe(mx=0.3, my=0.3, r0=0.5, retro=True),))
VIEWERS = normalize(np.array([[0.1, 0.2, 1.0], [0.9, -0.3, 0.5], [0.4, 0.1, -0.8]]))


def plugin(material: Material, edited: Any = None) -> Any:
    from lambent.bake.engine import engine

    engine()
    import mitsuba as mi

    from lambent.bake.bsdfs.edited_plugin import edited_dict

    return mi.load_dict(edited_dict(material, edited or of_material(material)))


def interactions(wo: np.ndarray) -> tuple[Any, Any]:
    import drjit as dr
    import mitsuba as mi

    si = dr.zeros(mi.SurfaceInteraction3f, len(wo))
    si.wi, si.sh_frame = mi.Vector3f(wo.T.astype(np.float32)), mi.Frame3f(mi.Normal3f(0, 0, 1))
    si.n = mi.Normal3f(0, 0, 1)
    return si, mi.BSDFContext()


@pytest.mark.parametrize("material", [SATIN, CURTAIN, BEADS], ids=["satin", "curtain", "beads"])
def test_unedited_it_scatters_as_its_document(material: Material) -> None:
    import mitsuba as mi

    made = plugin(material)
    from lambent.bake.bsdfs.material_plugin import material_dict

    known = mi.load_dict(material_dict(material))
    rng = np.random.default_rng(0)
    wi, wo = normalize(rng.normal(size=(2, 4096, 3)))
    si, ctx = interactions(wo)
    light = mi.Vector3f(wi.T.astype(np.float32))
    one, other = (np.array(bsdf.eval(ctx, si, light)).T for bsdf in (made, known))
    assert np.abs(one - other).max() < 2e-3 * other.max()
    assert other.any()


@pytest.mark.parametrize("material", [SATIN, CURTAIN, BEADS], ids=["satin", "curtain", "beads"])
@pytest.mark.parametrize("wo", VIEWERS, ids=str)
def test_chi_square(material: Material, wo: np.ndarray) -> None:
    """A million samples in bins of equal solid angle, against the density's integral over each."""
    import mitsuba as mi
    from scipy.stats import chi2

    made, count, (rows, columns) = plugin(material), 1_000_000, (24, 16)
    rng = np.random.default_rng(1)
    si, ctx = interactions(np.broadcast_to(wo, (count, 3)))
    bs, _ = made.sample(ctx, si, mi.Float(rng.random(count)), mi.Point2f(rng.random((2, count))))
    w, pdf = np.array(bs.wo).T, np.array(bs.pdf)
    w = w[pdf > 0]
    z, phi = w[:, 2], np.arctan2(w[:, 1], w[:, 0]) / (2 * np.pi) % 1
    found = np.histogram2d(z, phi, (rows, columns), ((-1, 1), (0, 1)))[0].ravel()
    fine = 24
    z, phi = np.meshgrid(
        (np.arange(rows * fine) + 0.5) / (rows * fine) * 2 - 1, (np.arange(columns * fine) + 0.5) / (columns * fine)
    )
    z, phi = z.T.ravel(), phi.T.ravel() * 2 * np.pi
    direction = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], axis=1)
    si, _ = interactions(np.broadcast_to(wo, direction.shape))
    density = np.array(made.pdf(ctx, si, mi.Vector3f(direction.T.astype(np.float32))))
    expected = (
        density.reshape(rows, fine, columns, fine).mean(axis=(1, 3)).ravel() * 4 * np.pi / (rows * columns) * count
    )
    kept = expected > 20
    assert expected.sum() <= 1.01 * count
    statistic = np.sum((found - expected)[kept] ** 2 / (expected[kept] + (0.01 * expected[kept]) ** 2))
    assert chi2.sf(statistic, kept.sum()) > 1e-3
    assert found[~kept].sum() < 0.01 * count


def test_curves_that_no_document_has() -> None:
    """Its values are those of the terms, steps and all."""
    import mitsuba as mi

    start, rng = of_material(SATIN), np.random.default_rng(2)
    name = start.terms[1].factors[0].curve
    edited = start.with_curve(name, Curve(np.repeat(rng.random((65, 3)), 64, axis=0)[: 4096 + 1]))
    wi, wo = normalize(rng.normal(size=(2, 4096, 3)))
    wi[:, 2], wo[:, 2] = np.abs(wi[:, 2]), np.abs(wo[:, 2])
    si, ctx = interactions(wo)
    found = np.array(plugin(SATIN, edited).eval(ctx, si, mi.Vector3f(wi.T.astype(np.float32)))).T
    expected = edited.eval(wi, wo) * wi[:, 2:]
    assert np.mean(np.abs(found - expected).max(axis=1) > 1e-3 * expected.max()) < 0.01  # at the steps' edges
