from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.progress import Cancelled
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.fitting.fit import fit
from lambent.materials.fitting.metrics import METRICS, errors_of
from lambent.materials.measured.registry import load
from tests.materials.fitting.known_answers import ALANOD, ANISOTROPIC, FEW, FOIL, ISOTROPIC, PAINT, grey


@pytest.fixture(scope="module")
def paint():
    return grey(PAINT, FEW)


def true_errors(samples, material):
    return errors_of(samples, MaterialBSDF(material).eval(samples.wi, samples.wo)[:, : samples.f.shape[1]])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_alanod_is_recovered_whatever_the_noise(seed):
    samples = grey(ALANOD, replace(ANISOTROPIC, seed=seed))
    result = fit(samples, metric="l1")
    (found,), (true,) = result.material.lobes, ALANOD.lobes
    assert result.material.kd[0] == pytest.approx(0.003, rel=0.05)
    for name in ("mx", "my", "alpha"):
        assert getattr(found, name) == pytest.approx(getattr(true, name), rel=0.005)
    assert found.r0[0] == pytest.approx(true.r0[0], rel=0.03)
    assert found.k[0] == pytest.approx(true.k[0], rel=0.03)
    assert result.errors["l1"] <= 1.0005 * true_errors(samples, ALANOD)["l1"]


@pytest.mark.slow
def test_white_foil_is_recovered_on_both_sides():
    samples = grey(FOIL, replace(ISOTROPIC, symmetry="quadrant"))
    result = fit(samples, metric="l1")
    reflection, transmission = result.material.lobes
    true_r, true_t = FOIL.lobes
    assert result.material.kd[0] == pytest.approx(0.76, rel=0.02)
    for name in ("mx", "my", "alpha"):
        assert getattr(reflection, name) == pytest.approx(getattr(true_r, name), rel=0.05)
        assert getattr(transmission, name) == pytest.approx(getattr(true_t, name), rel=0.05)
    assert reflection.k[0] == pytest.approx(0.78, rel=0.05)
    assert reflection.r0[0] == pytest.approx(0.029, rel=0.05)
    assert transmission.k[0] * (1 - transmission.r0[0]) == pytest.approx(0.67 * 0.25, rel=0.05)
    assert any("kt (1 - r0)" in line for line in result.warnings)
    assert result.errors["l1"] <= 1.05 * true_errors(samples, FOIL)["l1"]


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


def test_range_of_ks_is_respected(paint):
    (lobe,) = fit(paint, fix={"r0": 0.06}, ranges={"ks": (0.0, 0.3)}).material.lobes
    assert lobe.k[0] == pytest.approx(0.3, rel=1e-6)


def test_same_seed_same_material(paint):
    first, second = fit(paint, seed=3), fit(paint, seed=3)
    assert first.material == second.material


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


def test_fit_cancelled_before_it_began_is_diffuse(paint):
    def progress(done, total, what):
        raise Cancelled

    result = fit(paint, progress=progress)
    assert result.partial
    assert result.material.lobes == ()
    assert result.material.kd[0] == pytest.approx(0.2, rel=0.03)


def test_gradient_is_no_worse_than_grid(paint):
    assert fit(paint, method="gradient").errors["cuberoot"] <= fit(paint).errors["cuberoot"] * (1 + 1e-6)


@pytest.mark.slow
def test_two_lobes_are_told_apart():
    sharp = PAINT.lobes[0].model_copy(update={"mx": 0.04, "my": 0.04, "k": (0.3,) * 3})
    two = PAINT.model_copy(update={"lobes": (PAINT.lobes[0], sharp)})
    samples = grey(two, FEW)
    one = fit(samples, method="gradient")
    both = fit(samples, lobes=2, method="gradient")
    assert both.errors["cuberoot"] < 0.5 * one.errors["cuberoot"]
    assert sorted(lobe.mx for lobe in both.material.lobes) == pytest.approx([0.04, 0.15], rel=0.1)


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


def test_impossible_requests(paint):
    for options in ({"method": "gird"}, {"metric": "l3"}, {"lobes": 0}, {"fix": {"mxx": 1.0}}, {"fix": {"t_mx": 0.1}}):
        with pytest.raises(UserError):
            fit(paint, **options)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "shares"),
    [
        ("rgl/satin_rosaline_rgb.bsdf", {"cuberoot": 0.5, "log": 0.45}),
        ("cornell/garnet_red.brdf", {"cuberoot": 0.4, "log": 0.3}),
    ],
)
def test_one_lobe_explains_most_of_a_real_table(shared_data, file, shares):
    began = time.perf_counter()
    result = fit(load(shared_data / "measured" / file))
    assert time.perf_counter() - began < 60
    for metric, share in shares.items():
        assert result.errors[metric] < share * result.lambertian_errors[metric]
    assert all(np.isfinite(list(result.errors.values())))
