"""Cornell text: spectra to RGB, exact at the samples, reasonable between them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.materials.measured import load
from lambent.materials.measured.parts.spectral import rgb_of_spectra
from tests.materials.measured.measured_files import Loaded, cornell_rows, cornell_text

BANDS_NM = np.linspace(400, 700, 31)


def test_flat_spectrum_is_grey() -> None:
    np.testing.assert_allclose(rgb_of_spectra(BANDS_NM) @ np.full(31, 0.37), 0.37, rtol=1e-12)


def test_spectra_agree_with_colour_science() -> None:
    """A smooth reddish reflectance, against the reference's own integration."""
    import colour

    values = 0.1 + 0.8 / (1 + np.exp(-(BANDS_NM - 590) / 20))
    shape = colour.SpectralShape(360, 780, 5)
    sd = colour.SpectralDistribution(dict(zip(BANDS_NM, values, strict=True)))
    sd = sd.extrapolate(shape).interpolate(colour.SpectralShape(360, 780, 1), colour.LinearInterpolator)
    with colour.utilities.suppress_warnings(colour_runtime_warnings=True):
        xyz = colour.sd_to_XYZ(sd, illuminant=colour.SDS_ILLUMINANTS["D65"], method="Integration") / 100
    expected = colour.RGB_COLOURSPACES["ITU-R BT.709"].matrix_XYZ_to_RGB @ xyz
    np.testing.assert_allclose(rgb_of_spectra(BANDS_NM) @ values, expected, atol=2e-3)


@pytest.mark.parametrize("name", ["garnet_red", "krylon_blue"])
def test_real_files(shared_data: Path, name: str) -> None:
    table = load(shared_data / "measured" / "cornell" / f"{name}.brdf")
    samples = table.samples()
    assert len(samples) == 1439 and samples.left_out.total == 0
    np.testing.assert_allclose(table.eval(samples.wi, samples.wo), samples.f, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(samples.weight.sum(), (2 * np.pi) ** 2, rtol=1e-9)
    r, g, b = table.albedo(np.array([0.5, 0.0, np.sqrt(0.75)]))
    assert (r > 2 * max(g, b)) if name == "garnet_red" else (b > 2 * max(r, g))
    assert any("saturated" in note for note in table.info.notes)


def test_bad_samples_are_counted(loaded: Loaded) -> None:
    rows = cornell_rows()
    rows[3, 5], rows[4, 6], rows[5, 6] = np.nan, -0.1, -0.2
    samples = loaded(cornell_text(rows, np.linspace(400, 700, 5))).samples()
    assert (len(samples), samples.left_out.shadowed) == (len(rows) - 1, 1)
    assert (samples.f[[3, 4], 1] < 0.1).all()  # their green reading is below zero
    np.testing.assert_allclose(np.delete(samples.f, [3, 4], axis=0), 0.2, rtol=1e-6)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda text: text[:-12], "wrong number"),
        (lambda text: text.replace("0.2", "spam", 1), "not a number"),
        (lambda text: text.replace("\n5\n", "\n500\n"), "wavelengths are missing"),
        (lambda text: "\n".join(text.split("\n")[:3]), "wrong number"),
        (lambda text: text.replace(" 0.2 0.2 0.2 0.2 0.2", " -1 nan -1 -1 -1"), "no measured value"),
    ],
)
def test_broken_files(loaded: Loaded, change, expected: str) -> None:
    with pytest.raises(UserError, match=expected):
        loaded(change(cornell_text(cornell_rows(), np.linspace(400, 700, 5))))
