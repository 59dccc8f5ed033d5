"""Disks of what is dark, and of directions that only symmetry tells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.geometry.directions import angles
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.shown.incidence import incidences
from lambent.materials.fitting.symmetry import mirrored
from lambent.materials.measured import load
from lambent.viewer.editor.editor import Editor
from lambent.viewer.editor.readings import UNKNOWN, Disks, Incident, white_of
from lambent.viewer.edits.edits import MaterialEdits
from tests.viewer.measured_specimens import BRASS, BRUSHED, FEW, TURNED, write_measurement

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
