"""No direction returns more than arrives, and the appearance changes as little as two remedies allow."""

from __future__ import annotations

import pytest

from lambent.core.errors import UserError
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.checking import check
from lambent.materials.checking.check import check_sampler, furnace
from lambent.materials.checking.normalise import NOTE, change, normalisation, normalised, with_less_alpha, with_less_k
from lambent.materials.document import Lobe, Material, Provenance
from tests.materials.checking.test_check import BRUSHED, FOIL


@pytest.fixture(autouse=True)
def few_directions(monkeypatch):
    """Of the furnace: the axes, and above all near grazing."""
    monkeypatch.setattr(check, "THETA_DEG", (0, 45, 75, 82, 85, 87, 89))
    monkeypatch.setattr(check, "PHI_DEG", (0.0, 90.0))


STEEP = Material(lobes=(Lobe(mx=0.5, my=0.5, r0=1, alpha=1),))
BRIGHT = Material(kd=0.2, lobes=(Lobe(k=2, mx=0.2, my=0.2, r0=0.7, alpha=0.0),))


def test_normalised_does_not_exceed_one():
    material, tame = FOIL, normalised(FOIL)
    assert furnace(material).highest[0] > 1 >= furnace(tame).highest[0]
    assert all(now.alpha < before.alpha for now, before in zip(tame.lobes, material.lobes, strict=True))
    assert tame.kd == material.kd and [o.mx for o in tame.lobes] == [o.mx for o in material.lobes]
    _, theta, phi = furnace(material).highest
    assert check_sampler(MaterialBSDF(tame), theta, phi, samples=200_000).albedo_quadrature <= 1.002


def test_alpha_or_k_is_lowered_whichever_is_the_cause():
    less_alpha, less_k = with_less_alpha(STEEP), with_less_k(STEEP)
    assert less_alpha.lobes[0].k == STEEP.lobes[0].k and 0 < less_alpha.lobes[0].alpha < 1
    assert change(STEEP, less_alpha) < 0.7 * change(STEEP, less_k)
    assert normalised(BRIGHT).lobes[0].alpha == 0 and normalised(BRIGHT).lobes[0].k[0] < 1.3
    assert change(STEEP, STEEP) == 0


def test_normalised_keeps_a_passive_material():
    assert normalised(BRUSHED) is BRUSHED


def test_normalised_refuses_diffuse_terms_over_one():
    with pytest.raises(UserError, match="kd"):
        normalised(Material(kd=0.8, kt_d=0.3))


def test_the_report_names_the_changes():
    provenance = Provenance(source="steep.txt", notes=("first",))
    done = normalisation(STEEP.model_copy(update={"provenance": provenance}))
    assert done.needed and done.highest[0][0] > 1 >= done.highest[1][0]
    was, now = done.changed["lobes[0].alpha"]
    assert was == 1 and now == done.after.lobes[0].alpha
    assert "lobes[0].mx" not in done.changed
    assert set(done.errors) == set(done.share) and all(0 < share < 1 for share in done.share.values())
    assert done.after.provenance.notes == ("first", NOTE)


def test_scaling_k_is_an_error_of_its_share():
    """k alone is scaled where alpha is 0: f of the lobe by one factor, so L1 is that share of a lobe without kd."""
    done = normalisation(Material(lobes=(Lobe(k=1.6, mx=0.2, my=0.2, r0=1),)))
    was, now = done.changed["lobes[0].k"]
    assert list(done.changed) == ["lobes[0].k"] and was == (1.6, 1.6, 1.6)
    assert done.share["l1"] == pytest.approx(1 - now[0] / 1.6, rel=1e-6)


def test_the_report_of_a_passive_material():
    done = normalisation(BRUSHED)
    assert not done.needed and done.after is BRUSHED and not done.changed and not done.errors
