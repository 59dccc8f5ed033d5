"""Terms and curves evaluate to the model, or the document, that they were made of."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import editable, same_quotients
from lambent.materials.factored.quotients import CoupledDiffuse, Microfacets, One
from lambent.materials.factored.terms import Factor, Term
from lambent.materials.models import model_named, models

VALUES = {
    "phong": [{"exponent": 30}, {"exponent": 500}],
    "ashikhmin-shirley": [{"ex": 20, "ey": 20}, {"ex": 8, "ey": 300, "rs": (0.1, 0.4, 0.8)}],
    "cook-torrance": [{"m": 0.1}, {"m": 0.3, "n": (0.2, 1.1, 1.5), "k": (3, 2, 1)}],
    "ward": [{}, {"mx": 0.08, "my": 0.3}],
    "ward-original": [{}, {"mx": 0.08, "my": 0.3}],
    "kurt": [{"alpha": 0.4}, {"mx": 0.08, "my": 0.3, "r0": (0.02, 0.3, 0.9)}],
    "kurt-ggx": [{"alpha": 0.4}, {"mx": 0.08, "my": 0.3}],
    "kurt-transmission": [{"r0": 0.3}, {"mx": 0.08, "my": 0.3, "r0": 0.3}],
    "ggx": [{}, {"alpha_x": 0.1, "alpha_y": 0.4}],
    "schlick": [{}, {"p": 0.3, "r": 0.2}],
    "oren-nayar": [{"sigma": 0}, {"sigma": 30}],
}


def pairs(across: bool = False, count: int = 4000) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    wi, wo = (direction(np.arccos(rng.uniform(0.03, 1, count)), rng.uniform(0, 2 * np.pi, count)) for _ in range(2))
    near = count // 2  # half of the pairs near the mirror direction
    wi[:near] = wo[:near] * [-1, -1, 1] + rng.normal(0, 0.1, (near, 3))
    wi[:, 2] = np.maximum(wi[:, 2], 0.03) * (-1 if across else 1)
    return wi / np.linalg.norm(wi, axis=1, keepdims=True), wo


@pytest.mark.parametrize("name", models())
def test_terms_are_the_model(name: str) -> None:
    wi, wo = pairs(across=name == "kurt-transmission")
    for values in VALUES.get(name, [{}]):
        model = model_named(name)(**values)
        expected, found = model.eval(wi, wo), editable(model).eval(wi, wo)
        assert expected.any()
        assert np.allclose(found, expected, rtol=3e-3, atol=3e-4 * expected.max()), values
        assert not editable(model).eval(wi * [1, 1, -1], wo).any()


def test_documents_are_the_sum_of_their_parts() -> None:
    lobes = (
        Lobe(k=(0.5, 0.4, 0.3), mx=0.1, my=0.1, r0=0.04, alpha=0.3),
        Lobe(k=0.3, mx=0.2, my=0.4, r0=(0.1, 0.2, 0.3), distribution="ggx"),
        Lobe(k=0.6, mx=0.1, my=0.3, r0=0.2, side="transmission"),
    )
    for coupled in (False, True):
        material = Material(kd=(0.3, 0.2, 0.1), kd_coupled=coupled, kt_d=(0.1, 0.2, 0.3), lobes=lobes)
        for across in (False, True):
            wi, wo = pairs(across)
            expected = MaterialBSDF(material).eval(wi, wo)
            assert np.allclose(of_material(material).eval(wi, wo), expected, rtol=3e-3, atol=3e-4 * expected.max())


def test_colours_and_curves_change_no_quotient() -> None:
    """What a slider may change while the transport stays, and what it may not."""
    kurt = model_named("kurt")
    start = editable(kurt(mx=0.1, my=0.1))
    assert same_quotients(start, editable(kurt(mx=0.3, my=0.3, k=0.2, r0=0.9)))
    assert not same_quotients(start, editable(kurt(mx=0.1, my=0.1, alpha=0.5)))
    assert not same_quotients(start, editable(kurt(mx=0.1, my=0.3)))


DIFFUSE_TERMS = {
    "ashikhmin-shirley": {"diffuse"},
    "lambert": {"diffuse"},
    "oren-nayar": {"diffuse", "towards the light", "aside", "twice"},
}


@pytest.mark.parametrize(
    "name", ["lambert", "oren-nayar", "ashikhmin-shirley", "phong", "ward", "ggx", "cook-torrance"]
)
def test_terms_of_models(name: str) -> None:
    found = {term.name for term in editable(model_named(name)()).terms if term.is_diffuse}
    assert found == DIFFUSE_TERMS.get(name, set())


def test_terms_of_a_document() -> None:
    lobe, brushed = Lobe(k=(0.2,) * 3, mx=0.1, my=0.1), Lobe(k=(0.2,) * 3, mx=0.1, my=0.3)
    terms = of_material(Material(name="m", kd=(0.5,) * 3, kt_d=(0.1,) * 3, lobes=(lobe, brushed))).terms
    assert {term.name for term in terms if term.is_diffuse} == {"diffuse", "diffuse through"}


@pytest.mark.parametrize("viewer", [None, "seen"])
def test_the_quotient_decides_for_a_term_without_factors(viewer: str | None) -> None:
    """A constant is Lambertian, so that the diffuse texture multiplies it; the quotient of a lobe is a highlight."""
    for quotient, diffuse in ((One(), True), (CoupledDiffuse(), True), (Microfacets(), False)):
        assert Term("scale", quotient, (0.3, 0.2, 0.1), viewer=viewer).is_diffuse == diffuse


def test_one_curve_over_the_half_angle_makes_a_highlight() -> None:
    factors = (Factor("light", "theta_i"), Factor("shine", "theta_h"))
    assert not Term("t", One(), factors=factors).is_diffuse
    assert Term("t", One(), factors=factors[:1]).is_diffuse
