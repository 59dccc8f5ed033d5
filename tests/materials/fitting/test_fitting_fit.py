from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.progress import Cancelled
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.fitting.fit import fit
from lambent.materials.measured.inspecting.metrics import METRICS, errors_of
from tests.materials.fitting.known_answers import FEW, FOIL, ISOTROPIC, KNOWN, PAINT, TWO_LOBES, grey, setup_of


@pytest.fixture(scope="module")
def paint():
    return grey(PAINT, FEW)


def true_errors(samples, material):
    return errors_of(samples, MaterialBSDF(material).eval(samples.wi, samples.wo)[:, : samples.f.shape[1]])


SHAPES = ("mx", "my", "alpha", "r0")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["white foil", "miro 5, two lobes"])
def test_the_thesis_materials_are_recovered(name):
    material = KNOWN[name]
    samples = grey(material, setup_of(material))
    result = fit(samples, lobes=len(material.reflection_lobes), metric="l1")
    assert result.errors["l1"] <= true_errors(samples, material)["l1"]
    assert result.material.kd[0] == pytest.approx(material.kd[0], rel=0.01)
    tolerance = 0.1 if name.startswith("miro") else 0.05
    for found, true in zip(result.material.lobes, material.lobes, strict=True):
        assert found.side == true.side
        for shape in SHAPES[: 4 if true.side == "reflection" else 3]:
            assert np.mean(getattr(found, shape)) == pytest.approx(np.mean(getattr(true, shape)), rel=tolerance)
        if true.side == "transmission":
            assert found.k[0] * (1 - found.r0[0]) == pytest.approx(true.k[0] * (1 - true.r0[0]), rel=0.02)


def test_only_the_product_of_a_transmission_is_measured():
    result = fit(grey(FOIL, replace(ISOTROPIC, step_deg=8)))
    assert any("kt (1 - r0)" in line for line in result.warnings)


@pytest.mark.parametrize("metric", METRICS)
def test_every_metric_finds_the_lobe(paint, metric):
    result = fit(paint, metric=metric)
    (lobe,) = result.material.lobes
    assert lobe.mx == lobe.my == pytest.approx(0.15, rel=0.03)
    assert lobe.k[0] * lobe.r0[0] == pytest.approx(0.042, rel=0.1)
    assert result.errors[metric] < 0.1 * result.lambertian_errors[metric]
    assert set(result.errors) == set(METRICS) == set(result.lambertian_errors)


def test_provenance_accounts_for_the_fit(paint, tmp_path):
    source = tmp_path / "table"
    source.write_bytes(b"measured")
    result = fit(paint, source=source, fix={"alpha": 0.3})
    provenance = result.material.provenance
    assert provenance.errors == result.errors
    assert provenance.metric == "cuberoot"
    assert len(provenance.source_sha256) == 64
    assert provenance.samples["used"] == len(paint)
    assert provenance.samples["shadowed"] == paint.left_out.shadowed > 0
    assert "alpha fixed at 0.3" in provenance.notes


def test_fixed_parameters_stay_fixed_and_ranges_are_respected(paint):
    result = fit(paint, fix={"mx": 0.3, "ks": 0.5, "kd": 0.1}, ranges={"alpha": (0.6, 0.9), "r0": (0.2, 0.4)})
    (lobe,) = result.material.lobes
    assert (lobe.mx, lobe.my, lobe.k, result.material.kd) == (0.3, 0.3, (0.5,) * 3, (0.1,) * 3)
    assert 0.6 <= lobe.alpha <= 0.9
    assert 0.2 - 1e-9 <= lobe.r0[0] <= 0.4 + 1e-9
    assert any("bound" in line for line in result.warnings)


@pytest.mark.parametrize("stop", [Cancelled, KeyboardInterrupt])
def test_cancelled_fit_gives_the_best_so_far(paint, stop):
    calls = []

    def progress(done, total, what):
        calls.append(what)
        if len(calls) == 6:
            raise stop

    result = fit(paint, progress=progress)
    assert result.partial
    assert "cancelled" in result.warnings[0]
    assert result.errors["cuberoot"] < 0.3 * result.lambertian_errors["cuberoot"]


def test_progress_rises_to_its_end(paint):
    seen = []
    fit(paint, distribution="best", progress=lambda done, total, what: seen.append(done / total))
    assert seen == sorted(seen) and seen[0] == 0 and seen[-1] == 1


def test_the_number_of_lobes_is_found(paint):
    assert len(fit(paint, lobes="auto").material.lobes) == 1
    assert len(fit(grey(TWO_LOBES, FEW), lobes="auto").material.lobes) == 2


def test_lobes_that_explain_nothing_are_not_added():
    flat = fit(grey(PAINT.model_copy(update={"lobes": ()}), replace(FEW, noise=0, floor=0)), lobes=4)
    assert len(flat.material.lobes) < 4
    assert any("reduces the error no further" in line for line in flat.warnings)
    assert flat.errors["cuberoot"] < 1e-3


def test_the_better_distribution_is_found():
    ggx = PAINT.model_copy(update={"lobes": (PAINT.lobes[0].model_copy(update={"distribution": "ggx"}),)})
    for material, name in ((PAINT, "beckmann"), (ggx, "ggx")):
        result = fit(grey(material, FEW), distribution="best")
        assert [lobe.distribution for lobe in result.material.lobes] == [name]


@pytest.mark.parametrize("metric", ["l1", "cuberoot"])
@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("value", [0.0, 0.3])
def test_degenerate_tables_give_a_finite_material(paint, metric, count, value):
    few = replace(
        paint,
        wi=paint.wi[:count],
        wo=paint.wo[:count],
        weight=paint.weight[:count] + 1e-3,
        f=np.full((count, 1), value),
    )
    result = fit(few, metric=metric)
    assert all(np.isfinite(list(result.errors.values())))
    assert result.errors[metric] < 1e-3


def test_lost_light_is_reported(paint):
    lines = fit(paint, fix={"kd": 0.1, "ks": 0.7, "mx": 0.15, "r0": 0.06, "alpha": 0.3}).warnings
    assert any("reflects 0." in line and "times the light that was measured" in line for line in lines)
    assert not any("times the light" in line for line in fit(paint).warnings)


def test_a_peak_that_is_missed_is_reported(paint):
    lines = fit(paint, fix={"mx": 0.5}).warnings
    assert any("of the measured peak" in line and "l2_ngan" in line for line in lines)
    assert not any("of the measured peak" in line for line in fit(paint).warnings)


def test_a_coupled_diffuse_term_is_recovered():
    coupled = PAINT.model_copy(update={"kd_coupled": True, "kd": (0.5,) * 3})
    samples = grey(coupled, FEW)
    with_it, without = fit(samples, coupled=True), fit(samples)
    assert with_it.material.kd_coupled
    assert with_it.material.kd[0] == pytest.approx(0.5, rel=0.01)
    assert with_it.errors["cuberoot"] < 0.8 * without.errors["cuberoot"]


def test_impossible_requests(paint):
    impossible = [{"metric": "l3"}, {"distribution": "ggxx"}, {"lobes": 0}, {"lobes": 5}]
    impossible += [{"gain": 0.0}, {"gain": 1.0}, {"fix": {"mxx": 1.0}}, {"fix": {"t_mx": 0.1}}]
    for options in impossible:
        with pytest.raises(UserError):
            fit(paint, **options)
