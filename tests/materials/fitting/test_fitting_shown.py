"""Plots of a fit, and slices of its error with their minimum at the known lobe."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.shown.incidence import incidences, measured_disk
from lambent.materials.fitting.shown.plot import error_slices, save_plots
from lambent.materials.fitting.shown.slices import slices
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.measured.inspecting.synthetic import ANISOTROPIC, synthesise
from lambent.materials.plots import disk_places, plot_measurement, plot_plane_of_incidence
from tests.materials.fitting.known_answers import FEW, FOIL, PAINT, grey


def test_incidences_follow_the_grid():
    gathered = incidences(grey(PAINT, FEW))
    assert np.isfinite(measured_disk(gathered[3], False, 32)).mean() > 0.5
    assert [entry.theta_deg for entry in gathered] == [0, 5, 19, 33, 47, 61, 75]
    assert {entry.phi_deg for entry in gathered} == {0}


def test_tables_without_incident_directions_are_grouped_in_bins():
    samples = grey(PAINT, FEW)
    theta, turn = np.radians(np.linspace(1, 80, len(samples))), np.linspace(0, 6, len(samples))
    scattered = replace(samples, wi=direction(theta, turn))
    gathered = incidences(scattered)
    assert [entry.theta_deg for entry in gathered] == [2.5, 15, 30, 45, 60, 75]


def test_many_azimuths_are_grouped_at_the_quarters():
    """As of a Klems basis: rings of 1, 8, 20 and 24 patches, phi from 0 to 360, the pole's anywhere."""
    rings = [(0.0, [180.0]), *((10.0 * n, np.arange(0, 360, 360 / n)) for n in (8, 20, 24) if n < 9)]
    rings += [(30.0, np.arange(0, 360, 18)), (40.0, np.arange(15, 361, 15))]
    samples = grey(PAINT, FEW)
    samples = replace(samples, info=replace(samples.info, isotropic=False))
    incident = np.array([(theta, phi) for theta, phis in rings for phi in phis])
    chosen = incident[np.arange(len(samples)) % len(incident)]
    gathered = incidences(replace(samples, wi=direction(*np.radians(chosen.T))))
    keys = {(entry.theta_deg, entry.phi_deg) for entry in gathered}
    quarters = (0, 90, 180, 270)
    assert keys == {(0, 0)} | {(theta, phi) for theta in (80, 30, 40) for phi in quarters}


def test_albedo_of_an_incidence_ignores_gaps():
    for entry in incidences(grey(Material(kd=0.5), FEW)):
        assert entry.albedo(far=False)[0] == pytest.approx(0.5, rel=0.01)
        assert entry.albedo(far=True)[0] == 0


@pytest.mark.long
def test_plots_are_written(tmp_path):
    paths = save_plots(grey(FOIL, FEW), FOIL, tmp_path, "table")
    assert [path.name for path in paths] == ["table_polar.png", "table_in_plane.png", "table_albedo.png"]
    for path in paths:
        picture = np.asarray(Image.open(path).convert("L"))
        assert picture.min() < 60
        assert picture.max() == 255


COARSE = replace(ANISOTROPIC, theta_i_deg=(5, 35, 65), phi_i_deg=(0, 45, 90), step_deg=6, fine_deg=3, noise=0, floor=0)
BRUSHED = Material(name="brushed", kd=0.05, lobes=(Lobe(k=0.8, mx=0.1, my=0.3, r0=0.6, alpha=0.4),))


@pytest.mark.parametrize("metric", METRICS)
def test_the_minimum_is_at_the_known_lobe(metric):
    samples = grey(BRUSHED, COARSE)
    for one in slices(samples, BRUSHED, 0, METRICS[metric], steps=17):
        lowest = np.unravel_index(one.error.argmin(), one.error.shape)
        steps = np.abs(np.log(one.x / one.best[0])), np.abs(one.y - one.best[1])
        assert abs(lowest[1] - int(steps[0].argmin())) <= 1
        assert abs(lowest[0] - int(steps[1].argmin())) <= 2
        assert one.error.min() < 0.2 * np.median(one.error)


def test_isotropic_tables_move_both_roughnesses_at_once():
    first, second = slices(grey(PAINT, FEW), PAINT, 0, METRICS["cuberoot"], steps=5)
    assert (first.across, first.down, second.across, second.down) == ("m", "alpha", "r0", "alpha")


def test_slices_of_a_transmission_lobe_omit_r0():
    first, second = slices(grey(FOIL, COARSE), FOIL, 1, METRICS["cuberoot"], steps=5)
    assert (first.across, first.down, second.across, second.down) == ("mx", "my", "mx", "alpha")


def test_slices_are_drawn(tmp_path):
    metric = METRICS["cuberoot"]
    drawn = slices(grey(BRUSHED, COARSE), BRUSHED, 0, metric, steps=7)
    figure = error_slices(drawn, metric, "lobe 1")
    figure.savefig(tmp_path / "slices.png")
    assert len(figure.axes) == 4  # two panels, two colour bars
    assert (tmp_path / "slices.png").stat().st_size > 10_000


@pytest.mark.long
def test_measurements_and_materials_are_drawn(tmp_path):
    """The plane of incidence of both, and the disks of the measurement: several incident directions, both sides."""
    plot_plane_of_incidence(tmp_path / "m.png", MaterialBSDF(FOIL).eval, "foil", title="foil", transmits=True)
    table = synthesise(FOIL, replace(COARSE, theta_i_deg=(5, 65)))
    plot_measurement(tmp_path / "t.png", table, title="table")
    for name in ("m", "t"):
        picture = np.asarray(Image.open(tmp_path / f"{name}.png").convert("L"))
        assert picture.min() < 60 and picture.max() == 255
    placed, shape = disk_places(incidences(table.samples()), True)
    assert shape == (4, 3) and [place for *_, place in placed[:4]] == [(0, 0), (1, 0), (0, 1), (1, 1)]
