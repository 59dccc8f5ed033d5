"""Glare: hand-computable views, and Radiance's evalglare on pictures of every kind of source."""

from __future__ import annotations

import importlib.util
import math
import subprocess
from pathlib import Path

import numpy as np
import pytest

from lambent.core.light.glare import Glare, glare, position_index
from lambent.core.light.photometry import LM_PER_W
from lambent.core.pictures import rgbe
from lambent.core.views.camera import Camera
from lambent.core.views.projections import Projection, View

SIDE = 500
EYE = Camera("eye", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
VIEW = View.of(EYE, Projection.fisheye, SIDE, SIDE)
Lamp = tuple[float, float, float, float]  # degrees right, up, radius; cd/m2


def picture(lamps: list[Lamp], background: float, view: View = VIEW) -> np.ndarray:
    """(H, W, 3) radiance of round lamps over an even background."""
    rays, _ = view.directions(SIDE, SIDE)
    shown = np.full((SIDE, SIDE), background) * rays.any(axis=-1)
    for right, up, radius, lit in lamps:
        a, e = math.radians(right), math.radians(up)
        to = np.array([math.sin(a) * math.cos(e), math.sin(e), -math.cos(a) * math.cos(e)])
        shown[rays @ to > math.cos(math.radians(radius))] = lit
    return np.repeat(shown[..., None] / LM_PER_W, 3, axis=-1).astype(np.float32)


def test_one_lamp_ahead():
    """Solid angle 2 pi (1 - cos r), index 1: every term by hand."""
    found = glare(picture([(0, 0, 5, 20_000)], 500), VIEW)
    (lamp,) = found.sources
    omega = 2 * math.pi * (1 - math.cos(math.radians(5)))
    direct = 20_000 * math.pi * math.sin(math.radians(5)) ** 2
    lux = direct + 500 * math.pi * (1 - math.sin(math.radians(5)) ** 2)
    assert lamp.solid_angle == pytest.approx(omega, rel=0.01) and lamp.position_index == pytest.approx(1, abs=0.01)
    assert found.illuminance_lx == pytest.approx(lux, rel=5e-3)
    assert found.background == pytest.approx((lux - direct) / math.pi, rel=5e-3)
    assert found.ugr == pytest.approx(8 * math.log10(0.25 / found.background * 20_000**2 * omega), abs=0.05)
    dgp = 5.87e-5 * lux + 0.0918 * math.log10(1 + 20_000**2 * omega / lux**1.87) + 0.16
    assert found.dgp == pytest.approx(dgp, abs=2e-3) and found.comfort == "perceptible"


def test_nothing_glares():
    for background in (0.0, 50.0, 1500.0):
        found = glare(picture([], background), VIEW)
        assert found.sources == () and found.ugr == 0 and not found.numbers.any()
        assert found.illuminance_lx == pytest.approx(math.pi * background, rel=1e-3)
    assert "too dark" in glare(picture([], 50.0), VIEW).comfort


def test_position_index_grows_off_the_line_of_sight():
    angles = np.radians([0, 20, 40, 60])
    for right, up in ((0, 1), (1, 0), (0, -1), (1, 1), (1, -1)):
        across = np.sin(angles) / math.hypot(right, up)
        index = position_index(across * right, across * up, np.cos(angles))
        assert index[0] == pytest.approx(1) and (np.diff(index) > 0).all() and index.max() <= 16
    assert position_index(0, 0.5, 0.866) == pytest.approx(3.35, abs=0.02)  # Levin's curve: 30 degrees above


# CIE 117, position indices by T/R (to the side): for H/R (above the line of sight) of 0, .1, ... of the distance R.
CIE_117 = {
    0.0: (1.00, 1.26, 1.53, 1.90, 2.35, 2.86, 3.50, 4.20, 5.00, 6.00, 7.00, 8.10, 9.25, 10.35, 11.70, 13.15, 14.70),
    0.5: (1.43, 1.60, 1.82, 2.10, 2.48, 2.91, 3.40, 3.98, 4.70, 5.50, 6.40, 7.30, 8.30, 9.40, 10.50, 11.75, 13.00),
}  # fmt: skip


@pytest.mark.parametrize("aside", CIE_117)
def test_the_position_index_is_that_of_the_standard(aside):
    """Levin's formula is within 6.5 % of the table, .44 in UGR, on both sides of the view."""
    above = 0.1 * np.arange(len(CIE_117[aside]))
    for sign in (-1, 1):
        np.testing.assert_allclose(position_index(sign * aside, above, 1.0), CIE_117[aside], rtol=0.065)


@pytest.mark.parametrize(("aside", "above"), [(0.0, 0.5), (0.0, 1.0), (0.5, 0.5), (-0.5, 1.0)])
@pytest.mark.parametrize("background", [20.0, 100.0])
def test_ugr_and_dgp_of_a_round_luminaire_by_hand(aside, above, background):
    """In an even background, with its solid angle, and its position index from the standard's table."""
    right, up = math.degrees(math.atan(aside)), math.degrees(math.atan(above / math.hypot(aside, 1)))
    found = glare(picture([(right, up, 4, 12_000)], background), VIEW)
    omega, index = 2 * math.pi * (1 - math.cos(math.radians(4))), CIE_117[abs(aside)][round(10 * above)]
    cosine = 1 / math.sqrt(1 + aside**2 + above**2)
    direct = 12_000 * math.pi * math.sin(math.radians(4)) ** 2 * cosine
    around = background * math.pi * (1 - math.sin(math.radians(4)) ** 2 * cosine)
    ugr = 8 * math.log10(0.25 / (around / math.pi) * 12_000**2 * omega / index**2)
    assert found.ugr == pytest.approx(ugr, abs=0.45) and 10 < ugr < 40
    assert found.illuminance_lx == pytest.approx(direct + around, rel=0.02)
    lux = direct + around
    dgp = 5.87e-5 * lux + 0.0918 * math.log10(1 + 12_000**2 * omega / (lux**1.87 * index**2)) + 0.16
    assert found.dgp == pytest.approx(dgp, abs=0.005)


def test_ugr_adds_luminaires():
    """Two of a kind on both sides: twice the sum, 8 log10 2 = 2.4 more, less what the first adds to the background."""
    one, two = (glare(picture([(s * 25, 20, 4, 12_000) for s in sides], 80), VIEW) for sides in ((1,), (-1, 1)))
    assert two.ugr - one.ugr == pytest.approx(8 * math.log10(2), abs=0.05)
    assert two.background == pytest.approx(one.background, rel=0.01)


def evalglare() -> Path | None:
    spec = importlib.util.find_spec("pyradiance")
    program = Path(spec.origin).parent / "bin" / "evalglare" if spec and spec.origin else None
    return program if program and program.exists() else None


@pytest.mark.long
@pytest.mark.skipif(evalglare() is None, reason="pyradiance has no evalglare here: Radiance cannot be asked")
@pytest.mark.parametrize(
    ("lamps", "background", "projection"),
    [
        ([(30, 20, 6, 8000)], 300, Projection.hemispherical),
        ([(-40, -30, 6, 8000), (0, -50, 8, 6000)], 200, Projection.fisheye),
        ([(20, 10, 3, 30_000), (35, 10, 3, 30_000), (-50, 25, 2, 100_000)], 1000, Projection.fisheye),
        ([(10, 35, 10, 9000), (13, 37, 1, 5e6)], 800, Projection.fisheye),  # a sun within a bright sky
        ([(0, 0, 25, 8000)], 300, Projection.fisheye),
    ],
)
def test_as_evalglare(tmp_path, lamps, background, projection):
    view = View.of(EYE, projection, SIDE, SIDE)
    image = picture(lamps, background, view)
    (tmp_path / "view.hdr").write_bytes(rgbe.encode(image, view.radiance_options()))
    program = evalglare()
    program.chmod(program.stat().st_mode | 0o100)
    done = subprocess.run(
        [program, "-d", tmp_path / "view.hdr"], capture_output=True, text=True, timeout=60, check=True
    )
    names, values = done.stdout.splitlines()[-1].split(": ")
    theirs = dict(zip(names.split(","), map(float, values.split()), strict=True))
    ours: Glare = glare(image, view)
    assert len(ours.sources) == int(done.stdout.split()[0])
    assert ours.dgp == pytest.approx(theirs["dgp"], abs=0.003)
    assert ours.illuminance_lx == pytest.approx(theirs["E_v"], rel=0.01)
    assert ours.background == pytest.approx(theirs["lum_backg"], rel=0.01)
    if lamps:
        assert ours.ugr == pytest.approx(theirs["ugr"], abs=0.4)
