"""Zemax and FRED text: known answers, one specimen in both formats, stated TIS, refused files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.core.light.colour import RGB_TO_XYZ
from lambent.materials.measured import load
from tests.materials.measured.measured_files import Loaded, fred_text, zemax_text

ANO = "AnoBlackEC1onAlum"


def tilted_lobe(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """(N, 1): falls by the angle from the mirror direction, and differs along y and towards the horizon."""
    mirrored = wi * (-1, -1, 1)
    return (0.1 + np.exp(-4 * np.arccos(np.sum(mirrored * wo, axis=-1).clip(-1, 1))))[..., None] * (1.5 - wo[..., 2:])


@pytest.mark.parametrize("symmetry", ["PlaneSymmetrical", "Asymmetrical"])
def test_zemax_angles_turn_about_the_mirror_direction(loaded: Loaded, symmetry: str) -> None:
    """Hand-made directions: radial r towards azimuth 0 is r less in theta, 90 degrees aside is at right angles."""
    table = loaded(zemax_text(tilted_lobe, symmetry))
    assert table.info.format == "Zemax BSDF text" and table.info.isotropic
    sheet = table.reflected[1][0]  # 40 degrees
    w = sheet.directions.reshape(len(sheet.theta_deg), len(sheet.phi_deg), 3)
    forward = np.array([-1, 1, 1])  # the light stands at phi = 0, so the mirror direction at x < 0
    np.testing.assert_allclose(w[0, 0] * forward, direction(np.radians(40), 0.0), atol=1e-9)
    r = 2
    to_normal, away = np.radians(40 - sheet.theta_deg[r]), np.radians(40 + sheet.theta_deg[r])
    np.testing.assert_allclose(w[r, 0] * forward, direction(to_normal, 0.0), atol=1e-9)
    half = int(np.searchsorted(sheet.phi_deg, 180))
    np.testing.assert_allclose(w[r, half] * forward, direction(away, 0.0), atol=1e-9)
    quarter = int(np.searchsorted(sheet.phi_deg, 90))
    assert w[r, quarter] @ direction(np.radians(40), np.pi) == pytest.approx(np.cos(np.radians(sheet.theta_deg[r])))
    assert w[r, quarter] @ direction(np.radians(50), 0.0) == pytest.approx(0, abs=1e-9)
    samples = table.samples()
    np.testing.assert_allclose(samples.f, tilted_lobe(samples.wi, samples.wo), rtol=1e-4)
    below = sum(int((row[0].directions[row[0].measured, 2] <= 0).sum()) for row in table.reflected)
    assert samples.left_out.shadowed == below > 0 and any("below the horizon" in note for note in table.info.notes)


def test_zemax_transmission_colour_and_rotations(loaded: Loaded) -> None:
    rgb = np.array([0.3, 0.2, 0.1])

    def coloured(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.broadcast_to(rgb @ RGB_TO_XYZ.T, (*wo.shape[:-1], 3))

    table = loaded(zemax_text(coloured, "Asymmetrical4D", kind="BTDF", rotations=(0, 45, 90)))
    assert table.info.transmits and table.info.channels == 3 and not table.info.isotropic
    assert table.symmetry == "quadrant"
    straight = direction(np.radians(40), np.radians(45))
    np.testing.assert_allclose(table.eval(straight, -straight), rgb, rtol=1e-3)
    assert (table.eval(straight, straight) == 0).all()
    assert table.samples().transmitted.all()


def test_one_specimen_in_both_formats(shared_data: Path) -> None:
    """The Zemax file is the FRED file's measurement, recentred and resampled by its writer: equal within some percent.

    In the plane of incidence, which the recentring leaves alone, they are closest; any other reading of the angles
    is far off.
    """
    gonio = shared_data / "measured" / "gonio"
    zemax, fred = load(gonio / f"zemax_{ANO}.bsdf"), load(gonio / f"fred_{ANO}.txt")
    samples = zemax.samples()
    theta_o = np.degrees(np.arccos(samples.wo[:, 2]))
    inside = theta_o < 80
    wi, wo, f = samples.wi[inside], samples.wo[inside], samples.f[inside, 0]

    def off(towards: np.ndarray) -> float:
        return np.abs(fred.eval(wi, towards)[:, 0] / f - 1)

    assert np.median(off(wo)) < 0.08
    assert np.median(off(wo)[(np.abs(wo[:, 1]) < 1e-9) & (wo[:, 0] < 0)]) < 0.03
    assert np.median(off(wo * (-1, 1, 1))) > 0.5
    assert len(fred.samples()) == 289 + 3 * 285 and fred.samples().left_out.shadowed == 76


def test_stated_tis_is_compared(shared_data: Path) -> None:
    """BrownVinyl at 15 degrees: the maker of the original file states .1345; the file at hand .1082."""
    table = load(shared_data / "measured" / "gonio" / "zemax_ValidationTest_of_TIS_via_BrownVinyl.bsdf")
    assert table.reflectivity(direction(np.radians(15), 0.0))[0] == pytest.approx(0.1345, rel=0.03)
    note = next(note for note in table.info.notes if note.startswith("TIS"))
    assert "0.1082 (0.13" in note and "at 15" in note


def test_fred_units_scale_and_sides(loaded: Loaded) -> None:
    """The block names the mirror direction; negative theta is behind the normal; sin and log are other spellings."""
    angles = np.array([[0, 0], [20, 0], [20, 90], [20, 180], [60, 0], [60, 90], [60, 180], [60, 270], [20, 270]])
    f = np.linspace(0.1, 0.9, len(angles))
    first = loaded(fred_text({(30, 0): (angles, f)})).samples()
    mirror = np.array([-np.sin(np.radians(30)), 0, np.cos(np.radians(30))])
    np.testing.assert_allclose(first.wi[0] * (-1, -1, 1), mirror, atol=1e-12)
    order = np.argmin(((first.wo - direction(np.radians(60), np.pi)) ** 2).sum(axis=1))
    assert first.f[order, 0] == pytest.approx(0.5)  # theta 60, phi 0 is ahead, where the mirror direction is
    cosines = np.sin(np.radians(angles[:, 0])) * np.array(
        [np.cos(np.radians(angles[:, 1])), np.sin(np.radians(angles[:, 1]))]
    )
    again = loaded(fred_text({(0.5, 0): (cosines.T, np.log10(f / 2))}, "angles=sin bsdf=log scale=2")).samples()
    np.testing.assert_allclose(np.sort(again.f[:, 0]), np.sort(first.f[:, 0]), rtol=1e-6)
    behind = np.where(angles[:, 1:] == 180, [-1, -1], [1, 1]) * angles
    behind[angles[:, 1] == 180, 1] = 0
    same = loaded(fred_text({(30, 0): (behind, f)})).samples()
    np.testing.assert_allclose(np.sort(same.wo, axis=0), np.sort(first.wo, axis=0), atol=1e-9)


def test_a_scan_in_the_plane_of_incidence_is_turned_about_the_mirror_direction(loaded: Loaded) -> None:
    theta = np.arange(-80, 81, 4)
    peak = np.exp(-(((theta - 32) / 15) ** 2)) + 0.01
    table = loaded(fred_text({(32, 0): (np.stack([theta, 0 * theta], axis=1), peak)}))
    wi = direction(np.radians(32), 0.0)
    samples = table.samples()
    np.testing.assert_allclose(table.eval(samples.wi, samples.wo), samples.f, rtol=1e-6)
    mirror, aside = wi * (-1, 1, 1), np.array([0, 1.0, 0])
    tilted = np.cos(np.radians(8)) * mirror + np.sin(np.radians(8)) * aside
    assert table.eval(wi, tilted)[0] == pytest.approx(np.exp(-((8 / 15) ** 2)) + 0.01, rel=0.01)


GOOD = zemax_text(tilted_lobe, "PlaneSymmetrical")


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda text: text.replace("PlaneSymmetrical", "PlanSymmetrical"), "did you mean 'PlaneSymmetrical'"),
        (lambda text: text.replace("ScatterType\tBRDF", ""), "ScatterType: unknown ScatterType"),
        (lambda text: text.replace("ScatterRadial", "Scatterradius"), "ScatterRadial: is missing"),
        (lambda text: text.replace("AngleOfIncidence\t3", "AngleOfIncidence\t4"), "count differs"),
        (lambda text: text.replace("10\t40\t70", "40\t10\t70"), "not a list of angles"),
        (lambda text: text.replace("DataBegin", ""), "has no DataBegin"),
        (lambda text: text.replace("TIS", "", 1), "wrong number of data blocks"),
        (lambda text: text[:-200], "wrong number of values"),
        (lambda text: text.replace("Monochrome\nSca", "XYZ\nSca"), "data sections"),
        (
            lambda text: text[: text.index("TIS")] + "TIS 0\n" + "0 " * 133 + "TIS 0\n" + "0 " * 266,
            "wrong number of data blocks",
        ),
    ],
)
def test_broken_zemax_files(loaded: Loaded, change, expected: str) -> None:
    with pytest.raises(UserError, match=expected):
        loaded(change(GOOD))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("type bsdf_data\n10 0\n0 0 1\n", "second line must give the format"),
        ("type bsdf_data\nformat angles=rad bsdf=value scale=1\n10 0\n0 0 1\n", "angles: is unknown"),
        ("type bsdf_data\nformat angles=deg bsdf=value scale=-1\n10 0\n0 0 1\n", "scale: is not a positive"),
        ("type bsdf_data\nformat angles=deg bsdf=value scale=1\n", "no block"),
        ("type bsdf_data\nformat angles=deg bsdf=value scale=1\n0 0 1\n", "no block"),
        ("type bsdf_data\nformat angles=deg bsdf=value scale=1\n10 0\n0 0 1 2\n", "4 numbers in line 4"),
        ("type bsdf_data\nformat angles=sin bsdf=value scale=1\n0 0\n2 0 1\n", "direction cosines exceed 1"),
    ],
)
def test_broken_fred_files(loaded: Loaded, text: str, expected: str) -> None:
    with pytest.raises(UserError, match=expected):
        loaded(text)


@pytest.mark.parametrize("azimuth", [(), (0, 10, 30, 70, 130, 180)])
def test_mirror_images_lie_across_the_plane_of_incidence(loaded: Loaded, azimuth: tuple[int, ...]) -> None:
    """Half a turn that is written becomes a whole one: f at azimuth -a is that at a, not at 180 - a."""
    table = loaded(zemax_text(tilted_lobe, "PlaneSymmetrical", azimuth=azimuth))
    for theta, (sheet,) in zip(table.theta_i_deg, table.reflected, strict=True):
        wo, f = sheet.directions, sheet.values
        shown = np.isfinite(f[:, 0]) & (wo[:, 2] > 1e-3)
        assert (wo[shown, 1] < -1e-3).sum() == (wo[shown, 1] > 1e-3).sum() > 5
        wi = np.broadcast_to(direction(np.radians(theta), 0.0), wo.shape)
        np.testing.assert_allclose(f[shown], tilted_lobe(wi[shown], wo[shown]), rtol=1e-4)
    aside = direction(np.radians(np.array([40.0, 40.0])), np.radians(np.array([150.0, 210.0])))
    left, right = table.eval(direction(np.radians(40), 0.0), aside)
    np.testing.assert_allclose(left, right, rtol=1e-9)
