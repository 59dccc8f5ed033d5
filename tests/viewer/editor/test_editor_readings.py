"""The editor's disks, curves and albedo of materials whose numbers are known."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.materials.document import Material
from lambent.viewer.editor.readings import ALBEDO_THETA_DEG, THETA_O_DEG, Disks, Incident, albedo, in_plane

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
