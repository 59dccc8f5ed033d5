"""Integra DDR/DDT and LightTools BSDF text: geometry, units, channels, sides; and what is refused."""

from __future__ import annotations

import re

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from tests.materials.measured.measured_files import Loaded, ddr, lighttools, lobe, outgoing


def at_nodes(table, side=1) -> None:
    for sigma, phi, theta in ((30, 0, 10), (30, 90, 20), (30, 270, 20), (60, 135, 5), (0, 45, 60)):
        wi, wo = direction(np.radians(sigma), 0.0), outgoing(sigma, phi, theta)
        np.testing.assert_allclose(table.eval(wi, wo * (1, 1, side))[0], lobe(wi, wo), rtol=1e-4)


@pytest.mark.parametrize("kind", ["Luminance Absolute", "Intensity Absolute"])
@pytest.mark.parametrize("kbdf", [0.8, None])
def test_values_at_the_nodes(loaded: Loaded, kind: str, kbdf: float | None) -> None:
    table = loaded(ddr(kind=kind, kbdf=kbdf))
    assert table.info.format == "Integra DDR/DDT text" and not table.info.transmits and table.info.isotropic
    assert table.info.sizes["theta_i"] == 3 and any("sigma of 90" in note for note in table.info.notes)
    at_nodes(table)


def test_a_perfect_diffuser_is_one_over_pi(loaded: Loaded) -> None:
    """By hand: Luminance 1 everywhere, kbdf 1, reflects all: f = 1 / pi."""
    table = loaded(ddr(lambda wi, wo: 1 / np.pi, kbdf=1.0))
    np.testing.assert_allclose(table.eval(direction(0.4, 0), direction(0.6, 2)), 1 / np.pi, rtol=0.05)
    np.testing.assert_allclose(table.reflectivity(direction(np.radians(30), 0.0)), 1, rtol=0.01)


@pytest.mark.parametrize("kind", ["Luminance Relative", "Intensity Relative"])
def test_relative_values_scatter_kbdf(loaded: Loaded, kind: str) -> None:
    table = loaded(ddr(kind=kind, kbdf=0.37))
    np.testing.assert_allclose(table.reflectivity(direction(np.radians([0, 30, 60]), 0.0)), 0.37, rtol=1e-6)
    wi, wo, off = direction(np.radians(30), 0.0), outgoing(30, 0, 5), outgoing(30, 90, 20)
    np.testing.assert_allclose(table.eval(wi, wo) / table.eval(wi, off), lobe(wi, wo) / lobe(wi, off), rtol=1e-4)


def test_half_a_turn_is_mirrored(loaded: Loaded) -> None:
    table = loaded(ddr(phi=(0, 45, 90, 135, 180)).replace("ASymmetrical", "PlaneSymmetrical"))
    wi = direction(np.radians(30), 0.0)
    for phi in (90, 270):
        np.testing.assert_allclose(table.eval(wi, outgoing(30, phi, 20))[0], lobe(wi, outgoing(30, 90, 20)), rtol=1e-4)


def test_transmission_by_name_or_by_refraction(loaded: Loaded) -> None:
    at_nodes(loaded(ddr(), "sheet.DDT"), side=-1)
    table = loaded(ddr(sigmat=(0, 20, 40, 50)), "sheet.txt")
    assert table.info.transmits
    wi, wo = direction(np.radians(60), 0.0), outgoing(40, 90, 20)
    np.testing.assert_allclose(table.eval(wi, wo * (1, 1, -1))[0], lobe(wi, wo), rtol=1e-4)


def test_colours(loaded: Loaded) -> None:
    wi, wo = direction(np.radians(30), 0.0), outgoing(30, 90, 20)
    rgb = loaded(ddr(model="RGB", tint=(1.0, 0.5, 0.25)))
    np.testing.assert_allclose(rgb.eval(wi, wo), lobe(wi, wo) * np.array([1, 0.5, 0.25]), rtol=1e-4)
    late = ddr(model="RGB", tint=(1.0, 0.5, 0.25)).replace("\ngre\n", "\nGREEN\n").replace("\nblu\n", "\nblue\n")
    np.testing.assert_array_equal(loaded(late).eval(wi, wo), rgb.eval(wi, wo))
    flat = loaded(ddr(model="spectral 3", tint=(1.0, 1.0, 1.0)))
    np.testing.assert_allclose(flat.eval(wi, wo), [lobe(wi, wo)] * 3, rtol=1e-3)
    red = loaded(ddr(model="spectral 3", tint=(0.1, 0.2, 1.0))).eval(wi, wo)
    assert red[0] > 2 * red[1] > 2 * red[2] > 0


def test_azimuths_of_incidence(loaded: Loaded) -> None:
    table = loaded(ddr(psi=(0, 90, 180, 270)))
    assert table.symmetry == "none" and table.info.sizes["phi_i"] == 4
    np.testing.assert_allclose(table.eval(direction(np.radians(30), np.pi / 2), turned(outgoing(30, 90, 20))),
                               lobe(direction(np.radians(30), 0.0), outgoing(30, 90, 20)), rtol=1e-4)  # fmt: skip


def turned(w: np.ndarray) -> np.ndarray:
    return np.array([-w[1], w[0], w[2]])


def test_crlf_commas_in_comments_and_capitals(loaded: Loaded) -> None:
    text = ddr().replace("TypeData", "TYPEDATA").replace("sigma", "Sigma").replace("made up", "gemäß 0,5").upper()
    at_nodes(loaded("\ufeff".encode().decode("latin-1") + text.replace("\n", "\r\n")))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("Luminance Absolute", "Radiance", "TypeData: quantity of the values is not stated; found radiance"),
        ("TypeColorModel BW", "TypeColorModel RGB", "channels do not match.*found bw"),
        ("theta 9", "theta 8", "theta: count differs"),
        ("sigma 4\n 0 30 60 90", "sigma 4\n 0 30 60 91", "sigma: is not a list of angles"),
        (" kbdf\n  0.8", " kbdf\n ", "bw kbdf: wrong number of values; found 3; expected 1 x 4"),
        (" enddef", " 1 enddef", "bw def: wrong number of values"),
        (" def", " 1,5 def", "not a number; found 1,5"),
        ("phi 8", "psi 8", "is missing|is not a list"),
    ],
)
def test_refusals(loaded: Loaded, old: str, new: str, said: str) -> None:
    assert old in ddr()
    with pytest.raises(UserError, match=said):
        loaded(ddr().replace(old, new, 1))


def test_relative_values_need_their_share(loaded: Loaded) -> None:
    with pytest.raises(UserError, match="kbdf: is relative"):
        loaded(ddr(kind="Luminance Relative", kbdf=None))


def test_specular_tables_are_refused_as_such(loaded: Loaded) -> None:
    text = "Source Measured\nTypeColorModel BW\nsigma 3\n 0 30 60\nbw\n def\n 0.04 0.05 0.09\n enddef\n"
    with pytest.raises(UserError, match=r"specular reflectance.*load the diffuse distribution"):
        loaded(text, "sheet.sdr")


def check_lighttools(table, side=1, scale=1.0) -> None:
    for aoi, radial, azimuth in ((30, 30, 180), (30, 45, 90), (30, 45, 270), (60, 15, 30), (0, 60, 120)):
        wi, wo = direction(np.radians(aoi), 1.0), direction(np.radians(radial), 1.0 + np.radians(azimuth))
        if aoi == 0:
            wo = direction(*np.radians([radial, azimuth]))
        expected = scale * lobe(direction(np.radians(aoi), 0.0), direction(*np.radians([radial, azimuth])))
        np.testing.assert_allclose(table.eval(wi, wo * (1, 1, side))[0], expected, rtol=1e-5)


def test_lighttools(loaded: Loaded) -> None:
    table = loaded(lighttools(), "sheet.bsdf")
    assert table.info.format == "LightTools BSDF text" and table.info.sizes["theta_i"] == 3
    check_lighttools(table)
    both = loaded(lighttools(sides=("Back", "Front"), kinds=("BRDF", "BTDF")).replace("\n", "\r\n"))
    check_lighttools(both)
    check_lighttools(both, side=-1)
    assert any("from the back are not used" in note for note in both.info.notes)
    check_lighttools(loaded(lighttools(sides=("Back",))), scale=10)
    from_the_front = re.sub(r"AOI (\d+)", lambda aoi: f"AOI {180 - int(aoi[1])}", lighttools(sides=("Back",)))
    check_lighttools(loaded(from_the_front), scale=10)


def test_lighttools_in_colour(loaded: Loaded) -> None:
    names = ((0, "TrisX"), (0, "TrisY"), (0, "TrisZ"))
    table = loaded(lighttools(lambda wi, wo: 0.1, channels=names, xyz=True))
    y = table.eval(direction(np.radians(30), 0), direction(0.5, 2)) @ (0.2126, 0.7152, 0.0722)
    assert table.info.channels == 3 and float(y) == pytest.approx(0.1, rel=1e-3)
    spectra = loaded(lighttools(channels=((450, ""), (550, ""), (650, ""))))
    assert spectra.info.channels == 3 and any("D65" in note for note in spectra.info.notes)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (lighttools(poi=(0, 45)), "several planes of incidence"),
        (lighttools().replace("Side Front", "Side Top", 1), "block 1: unknown Side; found Top"),
        (lighttools().replace("ScatterRadial 6", "ScatterRadial 5"), "ScatterRadial: count differs"),
        (lighttools().replace("TIS 0.3\n", "TIS 0.3\n1 ", 1), "block 1: wrong number of values"),
        (lighttools().replace("TIS 0.3", "", 1), "is missing|wrong number of blocks"),
        (lighttools(xyz=True), "TristimulusValue: is missing"),
        (lighttools().replace("Wavelength 550", "Wavelength 450", 1), "channels are missing"),
        (lighttools().replace("AOI 30", "AOI 95", 1), "outside its range"),
    ],
)
def test_lighttools_refusals(loaded: Loaded, text: str, said: str) -> None:
    with pytest.raises(UserError, match=said):
        loaded(text, "sheet.bsdf")
