"""What the editor says of a material: errors, disks, curves and albedo are those of its BSDF."""

from dataclasses import replace

import numpy as np
import pytest

from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.measured.inspecting.synthetic import synthesise
from lambent.viewer.editor.matrix import matrix
from lambent.viewer.editor.measurement import read_measurement, thinned
from lambent.viewer.editor.readings import Incident
from tests.viewer.measured_specimens import BRUSHED, TURNED, write_measurement

OTHERS = (
    Material(kd=0.3),
    Material(kd=0.02, lobes=(Lobe(mx=0.03, my=0.03, r0=0.9),)),
    Material(kd=0.05, lobes=(Lobe(mx=0.2, my=0.1, r0=0.5, distribution="ggx", alpha=0.4),)),
)


@pytest.fixture(scope="module")
def brushed(tmp_path_factory):
    return read_measurement(write_measurement(tmp_path_factory.mktemp("m") / "brushed.txt", BRUSHED, TURNED))


def test_the_true_material_has_no_error(brushed):
    """Up to the digits that the text keeps."""
    for name, error in brushed.exact_errors(BRUSHED).items():
        assert error < 1e-3 * brushed.lambertian[name], name


def test_errors_are_those_of_the_metrics(brushed):
    f = MaterialBSDF(OTHERS[1]).eval(brushed.samples.wi, brushed.samples.wo)
    for name, error in brushed.exact_errors(OTHERS[1]).items():
        assert error == pytest.approx(METRICS[name].error(brushed.samples, f))
        assert brushed.error(OTHERS[1], name) == pytest.approx(error, rel=1e-3)  # so small a table is not thinned


@pytest.mark.parametrize("material", OTHERS)
def test_few_tuples_stand_for_all(brushed, material):
    few = thinned(brushed.samples, 3000)
    assert len(few) <= 3000 < len(brushed.samples)
    for name, metric in METRICS.items():
        exact = metric.error(brushed.samples, MaterialBSDF(material).eval(brushed.samples.wi, brushed.samples.wo))
        estimate = metric.error(few, MaterialBSDF(material).eval(few.wi, few.wo))
        assert estimate == pytest.approx(exact, rel=0.05), name


def test_few_tuples_stand_for_noise_about_zero():
    """Most tuples of a dark specimen are below zero; each is drawn as often as its weight asks."""
    dark = synthesise(Material(kd=0.001, lobes=(Lobe(mx=0.1, my=0.1, r0=0.5),)), replace(TURNED, floor=0.02)).samples()
    assert dark.below_zero > 0.3 * len(dark)
    few = thinned(dark, 3000)
    assert len(few) <= 3000 < len(dark) and (few.weight > 0).all() and np.isfinite(few.weight).all()
    f = [MaterialBSDF(OTHERS[0]).eval(samples.wi, samples.wo) for samples in (few, dark)]
    for name, metric in METRICS.items():
        assert metric.error(few, f[0]) == pytest.approx(metric.error(dark, f[1]), rel=0.05), name


@pytest.mark.parametrize("sides", [1, 2])
@pytest.mark.parametrize("kinds", [1, 2, 3])
@pytest.mark.parametrize("phis", [(0.0,), (0.0, 45.0, 90.0)])
@pytest.mark.parametrize("room", [(450.0, 420.0), (900.0, 250.0), (300.0, 800.0)])
def test_the_matrix_fits_and_nothing_overlaps(sides, kinds, phis, room):
    incidents = [Incident(theta, phi) for theta in (0.0, 20.0, 40.0, 60.0) for phi in phis]
    laid = matrix(incidents, kinds, sides, *room)
    corners = np.array(list(laid.tiles.values()))
    assert len(corners) == len(incidents) * kinds * sides
    assert laid.step > 8
    assert corners.min() >= 0 and np.all(corners.max(axis=0) + laid.step <= np.array(room) + 1e-6)
    apart = np.abs(corners[:, None] - corners[None]).max(axis=-1) + np.eye(len(corners)) * 1e9
    assert apart.min() >= laid.step - 1e-6
