from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from lambent.core.geometry.directions import direction
from lambent.materials.document import Material
from lambent.materials.fitting.shown.incidence import incidences
from lambent.materials.fitting.shown.plot import save_plots
from tests.materials.fitting.known_answers import FEW, FOIL, PAINT, grey


def test_incidences_follow_the_grid():
    gathered = incidences(grey(PAINT, FEW))
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


@pytest.mark.parametrize("material", [PAINT, FOIL], ids=lambda material: material.name)
def test_plots_are_written(tmp_path, material):
    paths = save_plots(grey(material, FEW), material, tmp_path, "table")
    assert [path.name for path in paths] == ["table_polar.png", "table_in_plane.png", "table_albedo.png"]
    for path in paths:
        picture = np.asarray(Image.open(path).convert("L"))
        assert picture.min() < 60
        assert picture.max() == 255
