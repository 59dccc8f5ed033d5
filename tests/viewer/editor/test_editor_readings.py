"""The editor's disks, curves, albedo and errors: of known materials, of halves and of samples of a measurement."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.geometry.directions import angles
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.shown.incidence import incidences, mirrored
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.measured.inspecting.synthetic import synthesise
from lambent.viewer.editor.editor import Editor
from lambent.viewer.editor.matrix import matrix
from lambent.viewer.editor.measurement import read_measurement, thinned
from lambent.viewer.editor.readings import (
    ALBEDO_THETA_DEG,
    THETA_O_DEG,
    UNKNOWN,
    Disks,
    Incident,
    albedo,
    in_plane,
    white_of,
)
from lambent.viewer.edits.edits import MaterialEdits
from tests.viewer.editor.measured_specimens import BRASS, BRUSHED, FEW, TURNED, write_measurement

SHEET = Material(kd=(0.2, 0.4, 0.6), kt_d=(0.3, 0.1, 0.05))
INCIDENTS = (Incident(0.0, 0.0), Incident(45.0, 90.0), Incident(60.0, 200.0))


def test_disks_show_the_cube_root_of_f_cos() -> None:
    """Lambert's f is kd/pi, and kt_d/pi behind; the middle of a disk looks along the normal."""
    pixels = 25
    disks = Disks(INCIDENTS, True, pixels)
    assert disks.tiles == tuple((i, far) for far in (False, True) for i in range(3))
    values = disks.model(SHEET)
    for (_, far), tile in zip(disks.tiles, values, strict=True):
        k = np.array(SHEET.kt_d if far else SHEET.kd)
        brightest = tile[np.argmax(tile[:, 0])]
        np.testing.assert_allclose(brightest, np.cbrt(k / np.pi), rtol=5e-3)
        assert tile[:, 0].min() < 0.75 * brightest[0], "the rim is the horizon"


def test_every_disk_lies_where_its_place_says() -> None:
    """Six disks in rows of three: a picture of each tile's own brightness."""
    disks = Disks(INCIDENTS, True, 9)
    inside = disks.model(SHEET).shape[1]
    values = np.repeat(np.arange(1, 7)[:, None, None] / 6, inside, axis=1) * np.ones(3)
    picture = disks.picture(values.astype(np.float32), 1.0)
    height, width = picture.shape[:2]
    assert (height, width) == (2 * 9, 3 * 9)
    for number, (index, far) in enumerate(disks.tiles, 1):
        (left, top), (right, bottom) = disks.place(index, far)
        row, column = int((top + bottom) / 2 * height), int((left + right) / 2 * width)
        assert picture[row, column, 0] == pytest.approx(255 * number / 6, abs=1)
        assert picture[row, column, 3] == 255
        assert picture[round(top * height), round(left * width), 3] == 0, "off the disk it is transparent"


def test_albedo_of_both_sides_and_p_in_the_plane() -> None:
    reflected, transmitted = albedo(SHEET, 30.0, 512)
    assert reflected.shape == (len(ALBEDO_THETA_DEG), 3)
    np.testing.assert_allclose(reflected, np.broadcast_to(SHEET.kd, reflected.shape), rtol=0.02)
    np.testing.assert_allclose(transmitted, np.broadcast_to(SHEET.kt_d, reflected.shape), rtol=0.02)
    for far, k in ((False, SHEET.kd), (True, SHEET.kt_d)):
        p = in_plane(SHEET, INCIDENTS[1], far)
        expected = np.array(k) / np.pi * np.cos(np.radians(THETA_O_DEG))[:, None]
        np.testing.assert_allclose(p, expected, rtol=1e-4)


LACQUER = Material(name="lacquer", kd=0.004, lobes=(Lobe(mx=0.02, my=0.02, r0=(0.04, 0.04, 0.04)),))


def half_of(samples, side=1):
    """What one half of a gonio-photometer's turns sees: wo on one side of the plane of incidence."""
    _, phi = angles(samples.wi)
    _, phi_o = angles(samples.wo)
    kept = side * np.sin(phi_o - phi) > -0.02
    fields = ("wi", "wo", "f", "weight")
    return replace(samples, **{name: getattr(samples, name)[kept] for name in fields})


@pytest.mark.parametrize(("material", "setup"), [(BRASS, FEW), (BRUSHED, TURNED)], ids=["isotropic", "brushed"])
def test_the_other_half_is_what_symmetry_says(tmp_path, material, setup):
    samples = load(write_measurement(tmp_path / "m.txt", material, setup)).samples()
    whole, half = incidences(samples), incidences(half_of(samples))
    disks = Disks([Incident(e.theta_deg, e.phi_deg) for e in whole], False, 24)
    truth, known, guessed = disks.measured(whole), disks.measured(half), disks.mirrored(half)
    filled = np.isnan(known[..., 0]) & np.isfinite(guessed[..., 0])
    symmetric = [k for k, e in enumerate(half) if e.phi_deg % 90 == 0]  # others would need the other quadrant
    for k in symmetric:
        assert filled[k].mean() > 0.3, "nearly half of the disk"
        both = filled[k] & np.isfinite(truth[k, :, 0])
        error = np.abs(guessed[k] - truth[k])[both]
        assert np.median(error) < 0.02 * truth[k][both].max()


def test_a_mirror_needs_a_partner(tmp_path):
    """At phi_i = 45 degrees of a brushed metal a mirror across the plane of incidence would be wrong."""
    entries = incidences(load(write_measurement(tmp_path / "m.txt", BRUSHED, TURNED)).samples())
    oblique = next(e for e in entries if e.phi_deg == 45 and e.theta_deg > 0)
    assert mirrored(oblique, entries) is None
    partner = replace(oblique, phi_deg=315.0)
    found = mirrored(oblique, [*entries, partner])
    np.testing.assert_array_equal(found.wo, partner.wo * (1, -1, 1))


def test_what_is_guessed_is_hatched():
    disks = Disks([Incident(0.0, 0.0)], False, 40)
    values = disks.model(BRASS)
    half = values.copy()
    half[:, : values.shape[1] // 2] = np.nan
    plain, hatched = disks.picture(values, 1.0), disks.picture(half, 1.0, values)
    differ = (plain != hatched).any(axis=-1)
    assert (hatched[differ][:, :3] == UNKNOWN).all()
    assert differ[:18].any() and not differ[22:].any()
    assert 0.1 < differ[:18].mean() / (plain[:18, :, 3] > 0).mean() < 0.3, "what is guessed can still be seen"
    bare = disks.picture(half, 1.0)
    assert (bare[:18][plain[:18, :, 3] > 0][:, :3] == UNKNOWN).all()


def test_a_dark_glossy_material_comes_out_of_the_black(screen):
    """Its highlight is white, and everything else lies below a twentieth of that until the disks are made brighter."""
    disks = Disks([Incident(45.0, 0.0)], False, 40)
    values = disks.model(LACQUER)
    assert np.median(values) < 0.1 * white_of(values)
    editor = Editor(MaterialEdits({"lacquer": LACQUER}), "lacquer", screen)
    editor.show_measurement(None)
    editor.tick()
    before = editor.shown.images["A"]
    editor.plots.brighter = 9.0
    editor.tick()
    after, inside = editor.shown.images["A"], before[..., 3] > 0
    assert np.median(before[inside][:, 1]) < 30
    assert np.median(after[inside][:, 1]) == pytest.approx(8 * np.median(before[inside][:, 1]), abs=8)


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
