"""Fits of curve lobes: what they recover, what they leave alone, and what they refuse."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material, material_from
from lambent.materials.fitting.fit import fit
from lambent.materials.lobes import density_of_slopes, widths
from lambent.materials.measured.inspecting.synthetic import Setup, synthesise
from lambent.materials.measured.protocol import MeasuredSamples
from tests.materials.test_curve_lobes import KD_CURVE, curve_lobe

SETUP = Setup(
    theta_i_deg=(0, 15, 30, 45, 60, 75), phi_i_deg=(0.0,), symmetry="isotropic", step_deg=6.0, fine_deg=2.0,
    fine_reach_deg=14.0, noise=0.01,
)  # fmt: skip


def measured(material: Material, setup: Setup = SETUP) -> MeasuredSamples:
    return synthesise(material, setup).samples()


def share(samples: MeasuredSamples, material: Material) -> float:
    """Mean difference of the cube roots, relative to the measured ones."""
    f = MaterialBSDF(material).eval(samples.wi, samples.wo)[:, : samples.f.shape[1]]
    one, other = np.cbrt(samples.f), np.cbrt(f)
    return float(np.abs(one - other).mean() / one.mean())


TAILED = Material(kd=(0.2, 0.1, 0.05), lobes=(curve_lobe(mx=0.12, my=0.12, alpha=0.3),))


@pytest.fixture(scope="module")
def fitted() -> tuple[MeasuredSamples, Material]:
    """The measured tuples of TAILED, and their curve lobe."""
    samples = measured(TAILED)
    return samples, fit(samples, lobes="curve").material


def test_a_curve_lobe_finds_the_lobe_that_was_measured(fitted: tuple[MeasuredSamples, Material]) -> None:
    samples, found = fitted
    (lobe,) = found.lobes
    assert lobe.distribution == "curve" and lobe.fresnel is not None
    assert share(samples, found) < 0.02
    assert share(samples, fit(samples, lobes=1, distribution="best").material) > 2 * share(samples, found)
    np.testing.assert_allclose(widths(lobe)[0], widths(TAILED.lobes[0])[0], rtol=0.1)
    for tangent in (0.0, 0.1, 0.3):
        one, other = (density_of_slopes((tangent / each.mx) ** 2, each) / each.mx**2 for each in (lobe, *TAILED.lobes))
        assert np.isclose(one * np.mean(lobe.k), other * np.mean(TAILED.lobes[0].k), rtol=0.3)
    material_from(found.model_dump(mode="json"), "found.json")


def test_half_of_a_fitted_lobe_lies_where_that_of_beckmann_does(fitted: tuple[MeasuredSamples, Material]) -> None:
    """So the numbers mx and my mean the same for both: `widths` are the numbers."""
    (lobe,) = fitted[1].lobes
    np.testing.assert_allclose(widths(lobe), (lobe.mx, lobe.my), rtol=0.1)


@pytest.mark.long
def test_a_brushed_curve_lobe_keeps_its_ratio() -> None:
    setup = Setup(
        theta_i_deg=(0, 20, 40, 60), phi_i_deg=(0.0, 45.0, 90.0), symmetry="quadrant", step_deg=8.0, fine_deg=3.0,
        fine_reach_deg=18.0, noise=0.01,
    )  # fmt: skip
    brushed = Material(kd=0.1, lobes=(curve_lobe(mx=0.3, my=0.1),))
    (lobe,) = fit(measured(brushed, setup), lobes="curve").material.lobes
    assert lobe.mx / lobe.my == pytest.approx(3, rel=0.1)


@pytest.mark.long
def test_transmission_has_a_curve_and_no_diffuse_one() -> None:
    sheet = Material(kd=0.2, kt_d=0.3, lobes=(curve_lobe(mx=0.2, my=0.2, side="transmission"),))
    samples = measured(sheet)
    found = fit(samples, lobes="curve").material
    through = [lobe for lobe in found.lobes if lobe.side == "transmission"]
    assert len(through) == 1 and through[0].shape is not None
    assert share(samples, found) < 0.03


@pytest.mark.long
@pytest.mark.parametrize("coupled", [False, True])
def test_a_coupled_diffuse_term_gets_no_curve(coupled: bool) -> None:
    material = Material(kd=0.5, lobes=TAILED.lobes, **({"kd_coupled": True} if coupled else {"kd_curve": KD_CURVE}))
    found = fit(measured(material), lobes="curve", coupled=coupled).material
    assert found.kd_coupled == coupled and (found.kd_curve is None) == coupled
    assert found.kd[0] == pytest.approx(0.5, rel=0.1)


@pytest.mark.long
def test_the_automatic_choice_is_by_tuples_held_out() -> None:
    plain = Material(kd=0.2, lobes=(Lobe(mx=0.2, my=0.2, r0=0.5),))
    kept = fit(measured(plain), lobes="auto")
    assert [lobe.distribution for lobe in kept.material.lobes] == ["beckmann"]
    assert any("held out (not taken)" in note for note in kept.notes)
    taken = fit(measured(TAILED), lobes="auto")
    assert [lobe.distribution for lobe in taken.material.lobes] == ["curve"]
    assert any("held out (taken)" in note for note in taken.notes)


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"fix": {"r0": 0.5}}, "r0"),
        ({"ranges": {"mx": (0.1, 0.2)}}, "mx"),
        ({"keep_albedo": True}, "keep_albedo"),
    ],
)
def test_what_a_curve_cannot_keep_is_refused(options: dict[str, object], field: str) -> None:
    table = synthesise(TAILED, SETUP)
    call: Callable[..., object] = fit
    with pytest.raises(UserError, match=field):
        call(table, lobes="curve", **options)


@pytest.mark.long
def test_alpha_and_kd_can_be_fixed() -> None:
    found = fit(measured(TAILED), lobes="curve", fix={"alpha": 0.1, "kd": (0.3, 0.2, 0.1)}).material
    assert found.kd == pytest.approx((0.3, 0.2, 0.1))
    assert found.lobes[0].alpha == pytest.approx(0.1, abs=1e-6)


def test_a_tape_that_only_returns_light_gets_no_curve() -> None:
    tape = Material(lobes=(Lobe(retro=True, mx=0.15, my=0.15, r0=0.8),))
    found = fit(measured(tape), lobes="auto").material
    assert [lobe.kind for lobe in found.lobes] == ["retro"]
