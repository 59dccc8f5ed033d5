"""What the editor says of a material: errors, disks, curves and albedo are those of its BSDF."""

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.shown.disks import disk_directions
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.measured.inspecting.synthetic import synthesise
from lambent.viewer.editor import readings
from lambent.viewer.editor.matrix import matrix
from lambent.viewer.editor.measurement import read_measurement, thinned
from lambent.viewer.editor.readings import Disks, Incident
from tests.viewer.measured_specimens import BRUSHED, FROSTED, TURNED, write_measurement

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


def test_the_same_tuples_every_time(brushed):
    a, b = thinned(brushed.samples, 500), thinned(brushed.samples, 500)
    assert np.array_equal(a.wi, b.wi) and np.array_equal(a.weight, b.weight)


def test_disks_hold_the_cube_root_of_p(brushed):
    incidents = readings.incidents_of(brushed.gathered)
    disks = Disks(incidents, False, 20)
    model = disks.model(BRUSHED)
    wo, inside = disk_directions(20, incidents[3].phi_deg, False)
    wi = direction(*np.radians([incidents[3].theta_deg, incidents[3].phi_deg]))
    f = MaterialBSDF(BRUSHED).eval(np.broadcast_to(wi, wo[inside].shape), wo[inside])
    assert model[3] == pytest.approx(np.cbrt(f * np.abs(wo[inside][:, 2:])), abs=1e-3)
    measured = disks.measured(brushed.gathered)
    known = np.isfinite(measured[3])
    assert known.mean() > 0.6
    assert np.abs(measured[3] - model[3])[known].mean() < 0.05 * model[3].max(), "nearest tuples, so not exact"


def test_the_curve_is_p_in_the_plane():
    p = readings.in_plane(FROSTED, Incident(30.0, 0.0), far=True)
    at = int(np.argmin(np.abs(readings.THETA_O_DEG - 30.0)))
    wi, wo = direction(np.radians(30.0), 0.0), direction(np.radians(180 - readings.THETA_O_DEG[at]), np.pi)
    assert p[at] == pytest.approx(MaterialBSDF(FROSTED).eval(wi, wo) * abs(wo[2]), rel=1e-6)


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
