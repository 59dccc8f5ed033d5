"""Which texture multiplies a term."""

from __future__ import annotations

import pytest

from lambent.materials.document import Lobe, Material
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import editable
from lambent.materials.factored.quotients import CoupledDiffuse, Microfacets, One
from lambent.materials.factored.terms import Factor, Term
from lambent.materials.models import model_named

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
