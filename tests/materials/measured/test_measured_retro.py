"""Retro-reflectors between measured incident directions: the peak follows the light and keeps its height."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.bench.scenes.retro_tapes import TAPES, Tape
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction, normalize
from lambent.materials.document import Lobe, Material
from lambent.materials.export import gonio_text, lbnl_xml
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.inspection import inspect_table
from lambent.materials.measured.inspecting.synthetic import ISOTROPIC, record, synthesise
from lambent.materials.measured.tables.retro import towards_light


@pytest.fixture(scope="module", params=TAPES, ids=lambda tape: tape.name)
def tape(request):
    return request.param


@pytest.fixture(scope="module")
def table(tape):
    return tape.measured()


def test_the_way_about_the_light_is_chosen(table):
    choice = table.choice
    assert choice.way == "back_vector"
    assert choice.errors["back_vector"] < 0.5 * min(choice.errors["half_vector"], choice.errors["quadrilinear"])


def about(w, reach_deg, count=400, seed=0):
    """Directions (N, 3) within about `reach_deg` of w (3,)."""
    off = np.random.default_rng(seed).normal(0, np.radians(reach_deg), (count, 3))
    return normalize(w + off)


@pytest.mark.parametrize("theta_deg", [15.0, 25.0, 45.0])
def test_peaks_between_incident_directions(tape, table, theta_deg):
    """Both peaks are where they belong, as high as they are; half vectors lose that about the light."""
    wi = direction(np.radians(theta_deg), 0.3)
    for centre, width in ((wi, tape.width_deg), (wi * (-1, -1, 1), 4.0)):
        wo = about(centre, width / 2)
        truth, got = tape.eval(np.broadcast_to(wi, wo.shape), wo), table.eval(np.broadcast_to(wi, wo.shape), wo)
        assert np.abs(got - truth).sum() < 0.12 * truth.sum()
    peak = tape.eval(wi, wi)
    assert table.eval(wi, wi) == pytest.approx(peak, rel=0.15)
    assert replace(table, reconstruction="half_vector").eval(wi, wi) < 0.7 * peak


def test_albedo_counts_the_peak(tape, table):
    theta, phi = np.meshgrid((np.arange(900) + 0.5) / 10, np.arange(0.5, 360), indexing="ij")
    for at in (0.0, 30.0):
        wi = direction(np.radians(at), 0.0)
        frame = np.stack([direction(np.radians(at + 90), 0.0), np.array([0.0, 1.0, 0.0]), wi])
        wo = direction(*np.radians([theta, phi])) @ frame
        f = tape.eval(np.broadcast_to(wi, wo.shape), wo)[..., 0] * np.maximum(wo[..., 2], 0)
        expected = (f * np.sin(np.radians(theta))).sum() * np.radians(0.1) * np.radians(1)
        assert table.albedo(wi)[0] == pytest.approx(expected, rel=0.06)


def test_a_scan_in_the_plane_of_incidence_keeps_the_peak_round():
    """Seen beside the plane, the peak about the light is as narrow as within it."""
    from pathlib import Path

    from lambent.materials.measured.parts.gonio_rows import table_of

    tape = Tape("scan", 2.0, 0.3, 1.0, 0.1)
    rows = [
        (theta_i, 0.0, abs(theta_o), 0.0 if theta_o > 0 else 180.0)
        for theta_i in (20.0, 30.0, 40.0, 50.0)
        for theta_o in np.arange(-80, 80.1, 0.5)
    ]
    angles = np.array(rows)
    wi, wo = (direction(*np.radians(angles[:, k : k + 2].T)) for k in (0, 2))
    table = table_of(angles, tape.eval(wi, wo), Path("scan.txt"), "gonio text", "scan")
    assert table.choice.way == "back_vector"
    light = direction(np.radians(35), 0.0)
    wo = about(light, 1.5)
    truth, got = (eval(np.broadcast_to(light, wo.shape), wo) for eval in (tape.eval, table.eval))
    assert np.abs(got - truth).sum() < 0.1 * truth.sum()


def test_peaks_about_the_mirror_direction_keep_their_way():
    lobe = Material(name="lobe", kd=0.1, lobes=(Lobe(mx=0.05, my=0.05, r0=0.9, alpha=0.5),))
    table = synthesise(lobe, replace(ISOTROPIC, step_deg=5))
    assert table.choice.way == "half_vector"


def test_faint_peaks_count():
    """A hundredth of the light, twelve times the f beside it: too little for sums of light, not for the eye."""
    tape = Tape("faint", 3.0, 0.01, 1.0, 0.3)
    table, wi = tape.measured(), direction(np.radians(25), 0.0)
    assert table.choice.way == "back_vector"
    assert table.eval(wi, wi) == pytest.approx(tape.eval(wi, wi), rel=0.1)


def test_peaks_of_a_fifth_of_a_degree_are_seen():
    samples = Tape("narrow", 0.2, 0.4, 2.0, 0.05).measured(10.0).samples()
    assert towards_light(samples) > 100


def test_many_incident_directions_cost_a_few_folds(monkeypatch):
    monkeypatch.setattr("lambent.materials.measured.tables.gonio._MOST_FOLDS", 3)
    setup = replace(ISOTROPIC, theta_i_deg=tuple(range(0, 80, 8)), about_lamp=True, sector_deg=0.0, step_deg=10.0)
    table = record(TAPES[1].eval, "many", setup)
    assert len(list(table._folds())) == 3 and table.choice.way == "back_vector"


def test_the_way_can_be_given():
    table = replace(TAPES[1].measured(10.0), reconstruction="quadrilinear")
    assert table.choice.way == "quadrilinear" and not table.choice.errors


def test_two_incident_directions_predict_each_other():
    tape = TAPES[1]
    two = record(tape.eval, "two", replace(ISOTROPIC, theta_i_deg=(30, 40), about_lamp=True, sector_deg=0.0))
    assert two.choice.way == "back_vector"


def test_inspection_names_it_and_says_how_it_is_looked_up(table):
    report = inspect_table(table)
    assert any("is retro-reflective" in line and "follows the light" in line for line in report["findings"])
    assert report["reconstruction"]["way"] == "back_vector"
    given = inspect_table(replace(table, reconstruction="half_vector"))
    assert any("--reconstruction back_vector" in line for line in given["findings"])


def test_the_way_is_given_where_a_file_is_read(tmp_path):
    file = tmp_path / "tape.txt"
    gonio_text.write(TAPES[2].measured(10.0), file)
    assert load(file).choice.way == "back_vector"
    assert load(file, "quadrilinear").choice.way == "quadrilinear"
    patches = tmp_path / "patches.xml"
    lbnl_xml.write(Material(name="grey", kd=0.5), patches)
    with pytest.raises(UserError, match="does not apply to"):
        load(patches, "back_vector")
