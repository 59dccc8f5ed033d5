"""Curve lobes: normalised, sampled by their own quantiles, containing GGX; documents of version 2."""

from __future__ import annotations

import json
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials import lobes
from lambent.materials.bsdf import MaterialBSDF, diffuse_seen, normalised, under_fresnel
from lambent.materials.document import COSINE_NODES, SHAPE_NODES, Lobe, Material, load_material, material_from
from lambent.materials.lobes import NUMPY
from lambent.materials.slope_curve import NODES_RHO, at_cosine, half_density, log_density, quantile
from tests.tools.checks import assert_reciprocal, assert_sampler

RHO2 = NODES_RHO**2
GGX = tuple(((1 + RHO2) ** -2).tolist())
SHAPES = {
    "ggx": GGX,
    "beckmann": tuple(np.exp(-np.minimum(RHO2, 600)).tolist()),
    "two widths": tuple((40 * np.exp(-np.minimum(8 * RHO2, 600)) + (1 + RHO2 / 9) ** -1.4).tolist()),
    "a ring": tuple(np.exp(-(((np.sqrt(RHO2) - 1) / 0.3) ** 2).clip(0, 80)).tolist()),
    "no light at the centre": (0.0, 0.0, 1.0, 1.0, *[0.0] * (SHAPE_NODES - 4)),
    "flat to the end": (1.0,) * SHAPE_NODES,
    "of power -1": tuple(((1 + RHO2) ** -1).tolist()),
    "huge": tuple((1e29 * (1 + RHO2) ** -2).tolist()),
}
FRESNEL = ((0.9, 0.5, 0.3, 0.2, 0.2, 0.2, 0.3, 0.4), (1.0,) * COSINE_NODES, (1.0, *[0.0] * (COSINE_NODES - 1)))
KD_CURVE = (0.2, 0.9, 1.0, 1.1, 1.0, 1.0, 0.9, 1.2)


def curve_lobe(**numbers: object) -> Lobe:
    """A lobe with a tail and a ring, whose Fresnel reflectance is that of no glass."""
    shape = (1 + NODES_RHO**2) ** -1.8 + 0.1 * np.exp(-(((NODES_RHO - 1.5) / 0.4) ** 2))
    fresnel = ((0.9, 0.5, 0.3, 0.2, 0.2, 0.2, 0.3, 0.4), (1.0,) * 8, (0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1))
    return Lobe(distribution="curve", shape=tuple(shape.tolist()), fresnel=fresnel, k=(0.5, 0.4, 0.3), **numbers)


MATERIALS = {
    "two widths": Material(
        kd=0.2, lobes=(Lobe(distribution="curve", shape=SHAPES["two widths"], mx=0.1, my=0.1, r0=0.5),)
    ),
    "brushed": Material(
        kd=(0.3, 0.2, 0.1), kd_curve=KD_CURVE,
        lobes=(Lobe(distribution="curve", shape=GGX, mx=0.3, my=0.1, k=0.6, alpha=0.4, fresnel=FRESNEL),),
    ),
    "sheet": Material(
        kt_d=0.1,
        lobes=(
            Lobe(distribution="curve", shape=SHAPES["a ring"], side="transmission", mx=0.2, my=0.25, fresnel=FRESNEL),
            Lobe(distribution="curve", shape=SHAPES["beckmann"], retro=True, mx=0.2, my=0.2, r0=1.0, alpha=-1.0),
        ),
    ),
}  # fmt: skip
CURVED = MATERIALS["brushed"].lobes[0]


@pytest.mark.parametrize("name", SHAPES)
def test_a_shape_has_the_projected_area_one(name: str) -> None:
    """The integral of D cos over the hemisphere is twice that of P rho, here over asinh(rho) to 1e9."""

    def density(x: float) -> float:
        return float(np.exp(log_density(np.sinh(x) ** 2, SHAPES[name], NUMPY)) * np.sinh(2 * x))

    edges = np.append(np.arcsinh(NODES_RHO), np.linspace(8, 60, 40))
    total = sum(quad(density, low, high)[0] for low, high in pairwise(edges))
    assert total == pytest.approx(1, abs=2e-6)


@pytest.mark.parametrize("name", SHAPES)
def test_quantiles_invert_the_mass(name: str) -> None:
    mass = np.array([0.0, 1e-6, 0.01, 0.3, 0.5, 0.9, 0.999, 1 - 1e-7])
    rho = quantile(mass, SHAPES[name], NUMPY)
    assert np.isfinite(rho).all() and (np.diff(rho) >= 0).all()
    u = (np.arange(200_000) + 0.5) / 200_000
    sampled = quantile(u, SHAPES[name], NUMPY)
    x = np.linspace(0, np.arcsinh(rho[4]), 20_001)
    inside = np.trapezoid(np.exp(log_density(np.sinh(x) ** 2, SHAPES[name], NUMPY)) * np.sinh(2 * x), x)
    assert inside == pytest.approx(0.5, abs=2e-3)
    assert (sampled <= rho[4]).mean() == pytest.approx(0.5, abs=1e-4)


def test_ggx_is_a_curve() -> None:
    slope2, u = np.geomspace(1e-8, 1e9, 200), np.linspace(0, 0.9999, 100)
    np.testing.assert_allclose(log_density(slope2, GGX, NUMPY), -2 * np.log1p(slope2), atol=1e-12)
    np.testing.assert_allclose(quantile(u, GGX, NUMPY), np.sqrt(u / (1 - u)), rtol=1e-9, atol=1e-12)
    lobe = Lobe(mx=0.2, my=0.3, distribution="ggx")
    curve = lobe.model_copy(update={"distribution": "curve", "shape": GGX})
    wi, wo = direction(0.7, 0.2), direction(np.linspace(0, 1.5, 20), 2.9)
    one, other = (MaterialBSDF(Material(lobes=(each,))) for each in (lobe, curve))
    np.testing.assert_allclose(one.eval(wi, wo), other.eval(wi, wo), rtol=1e-9)
    np.testing.assert_allclose(one.pdf(wi, wo), other.pdf(wi, wo), rtol=1e-9)
    assert half_density(GGX) == pytest.approx(np.sqrt(2) - 1) and lobes.widening(curve) == pytest.approx(
        lobes.widening(lobe)
    )


def test_scaling_a_shape_changes_nothing() -> None:
    slope2 = np.geomspace(1e-3, 1e3, 30)
    for factor in (1e-20, 1e20):
        scaled = tuple(factor * value for value in SHAPES["two widths"])
        np.testing.assert_allclose(
            log_density(slope2, scaled, NUMPY), log_density(slope2, SHAPES["two widths"], NUMPY), rtol=1e-9
        )


@pytest.mark.long
@pytest.mark.parametrize("theta_deg", [0.0, 50.0, 85.0, 130.0])
@pytest.mark.parametrize("name", MATERIALS)
def test_samplers_follow_their_density(name: str, theta_deg: float) -> None:
    assert_sampler(MaterialBSDF(MATERIALS[name]), theta_deg, 200.0)


@pytest.mark.parametrize("name", MATERIALS)
def test_curves_are_reciprocal(name: str) -> None:
    assert_reciprocal(MaterialBSDF(MATERIALS[name]))


def test_schlick_is_a_curve() -> None:
    """Between nodes a curve is linear in (1 - cosine)^5: so are Schlick's F, and the coupling's transmittance."""
    cosine, r0 = np.linspace(0, 1, 301), 0.04
    nodes = tuple(lobes.fresnel(np.linspace(0, 1, COSINE_NODES), r0).tolist())
    np.testing.assert_allclose(at_cosine(cosine, nodes, NUMPY), lobes.fresnel(cosine, r0), atol=1e-12)
    seen = tuple(under_fresnel(np.linspace(0, 1, COSINE_NODES)).tolist())
    np.testing.assert_allclose(at_cosine(cosine, seen, NUMPY), under_fresnel(cosine), atol=1e-12)


def test_fresnel_runs_through_its_nodes_and_stays_between_them() -> None:
    cosine = np.linspace(0, 1, COSINE_NODES)
    for channel, nodes in enumerate(FRESNEL):
        np.testing.assert_allclose(lobes.reflectance(cosine, CURVED, channel), nodes, atol=1e-12)
        for low, high, at in zip(nodes, nodes[1:], cosine, strict=False):
            between = lobes.reflectance(at + np.linspace(0.01, 0.13, 9), CURVED, channel)
            assert (between >= min(low, high) - 1e-12).all() and (between <= max(low, high) + 1e-12).all()
    assert CURVED.r0 == tuple(nodes[-1] for nodes in FRESNEL)


@pytest.mark.parametrize("theta_deg", [0.0, 60.0, 88.0])
def test_the_diffuse_curve_keeps_the_albedo_kd(theta_deg: float) -> None:
    """Towards a viewer it is kd times the curve; under uniform light, over all viewers, kd."""
    material = Material(kd=0.6, kd_curve=KD_CURVE)
    cos_o = np.cos(np.radians(theta_deg))
    found = MaterialBSDF(material).albedo(direction(np.radians(theta_deg), 0.3), samples=200_000)[0]
    assert found == pytest.approx(0.6 * at_cosine(cos_o, normalised(KD_CURVE), NUMPY), rel=3e-3)
    mu = (np.arange(100_000) + 0.5) / 100_000
    assert np.mean(2 * mu * diffuse_seen(mu, material)) == pytest.approx(1, abs=1e-6)


def test_a_document_has_the_least_version_that_holds_it(tmp_path) -> None:
    plain, curved = Material(kd=0.5, lobes=(Lobe(mx=0.1, my=0.1),)), MATERIALS["brushed"]
    for material, version in ((plain, 1), (Material(kd=0.5, kd_curve=KD_CURVE), 2), (curved, 2)):
        file = tmp_path / "m.json"
        material.save(file)
        assert json.loads(file.read_text())["version"] == version
        assert load_material(file) == material
    assert "shape" not in plain.model_dump_json() and "kd_curve" not in plain.model_dump_json()
    assert list(plain.model_dump(mode="json"))[:3] == ["format", "version", "name"]


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"shape": list(GGX)[:-1]}, "shape"),
        ({"shape": [-1.0, *list(GGX)[1:]]}, "shape"),
        ({"shape": [float("nan"), *list(GGX)[1:]]}, "shape"),
        ({"shape": [0.0] * SHAPE_NODES}, "shape: every value is 0"),
        ({"shape": None}, "shape: a lobe has one"),
        ({"distribution": "ggx"}, "shape: a lobe has one"),
        ({"fresnel": [[0.5] * COSINE_NODES] * 2}, "fresnel"),
        ({"fresnel": [[1.5] * COSINE_NODES] * 3}, "fresnel"),
    ],
)
def test_impossible_curves_are_refused(change: dict, what: str) -> None:
    lobe = CURVED.model_dump(mode="json") | change
    with pytest.raises(UserError, match=what):
        material_from({"version": 2, "lobes": [lobe]}, "m.json")


@pytest.mark.parametrize(
    "data", [{"kd": 0.5, "kd_curve": [0.0] * 8}, {"kd": 0.5, "kd_curve": list(KD_CURVE), "kd_coupled": True}]
)
def test_impossible_diffuse_curves_are_refused(data: dict) -> None:
    with pytest.raises(UserError, match="kd_curve"):
        material_from(data, "m.json")


def test_an_unknown_version_is_refused() -> None:
    with pytest.raises(UserError, match="version"):
        material_from({"version": 3, "kd": 0.5}, "m.json")
