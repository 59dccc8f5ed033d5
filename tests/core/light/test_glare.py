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


def evalglare() -> Path | None:
    spec = importlib.util.find_spec("pyradiance")
    program = Path(spec.origin).parent / "bin" / "evalglare" if spec and spec.origin else None
    return program if program and program.exists() else None


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
