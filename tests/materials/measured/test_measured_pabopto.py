"""pab-opto text: Radiance's conventions of angles, cosine and sides; one file or several joined."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from tests.materials.measured.measured_files import Loaded, beam, glossy


def brushed(wi, wo):
    """Not isotropic: darker where light and view lie along x."""
    return 0.2 + 0.1 * wi[..., 1] ** 2 + 0.05 * wi[..., 0] * wo[..., 0]


def test_the_manual_page_s_example(loaded: Loaded) -> None:
    """A DSF is f cos theta_o: 0.009744 at 84.968 degrees is .1111 1/sr."""
    rows = "84.968 125.790 0.009744\n84.889 125.610 0.007737\n84.805 125.427 0.008569\n0 0 .3\n"
    table = loaded("#incident_angle 82.5 180\n#format: theta phi DSF\n" + rows)
    assert table.info.format == "pab-opto text" and table.info.stored == "f_cos"
    wi, wo = direction(np.radians(82.5), np.pi), direction(*np.radians([84.968, 125.79]))
    assert float(table.eval(wi, wo)[0]) == pytest.approx(0.009744 / np.cos(np.radians(84.968)), rel=1e-3)
    assert any("one incident direction" in note and "join" in note for note in table.info.notes)


@pytest.mark.parametrize(("kind", "stored"), [("DSF", "f_cos"), ("BSDF", "f"), ("BRDF", "f")])
def test_joined_files_make_one_table(loaded: Loaded, kind: str, stored: str) -> None:
    table = loaded("".join(beam(theta, 180, kind=kind) for theta in (60, 0, 30)))
    assert table.info.stored == stored and table.info.sizes["theta_i"] == 3 and table.info.isotropic
    assert table.name == "felt 7"
    for theta_i, theta_o, phi in ((30, 30, 180), (30, 60, 90), (60, 54, 180), (0, 12, 45)):
        wi, wo = direction(np.radians(theta_i), 0.7), direction(np.radians(theta_o), 0.7 + np.radians(phi))
        np.testing.assert_allclose(table.eval(wi, wo)[0], glossy(wi, wo), rtol=1e-4)


def test_transmission_and_light_from_the_back(loaded: Loaded) -> None:
    """theta over 90 is the back; a specimen whose back is lit is turned over, so that its near side reflects."""
    both = "".join(beam(t, 180, far=far, head=f"# side {far}") for t in (0, 30) for far in (False, True))
    back = "".join(beam(180 - t, 180, far=far) for t in (0, 30) for far in (False, True))
    wi = direction(np.radians(30), 0.0)
    for text in (both, back):
        table = loaded(text)
        assert table.info.transmits
        for wo in (wi * (-1, 1, 1), -wi, direction(np.radians(132), 1.0)):
            np.testing.assert_allclose(table.eval(wi, wo)[0], glossy(wi, wo), rtol=0.05)
    assert any("turned over" in note for note in table.info.notes)


def test_a_specimen_lit_from_the_back_is_turned_over_about_phi_0(loaded: Loaded) -> None:
    """x stays, y and z change their signs, so that the sense of the azimuths does too."""
    over = np.array([1, -1, -1])

    def skewed(wi, wo):
        return glossy(wi, wo) * (1.5 + 0.4 * wi[..., 1] + wo[..., 1])

    text = "".join(
        beam(180 - theta, phi, lambda wi, wo: skewed(wi * over, wo * over), "BSDF", head="#upphi 90\n")
        for theta in (0, 40)
        for phi in (range(0, 360, 30) if theta else (0,))
    )
    table = loaded(text)
    assert table.symmetry == "none"
    for phi_i, phi_o in ((0, 60), (120, 225), (120, 15)):
        wi, wo = direction(np.radians(40), np.radians(phi_i)), direction(np.radians(36), np.radians(phi_o))
        np.testing.assert_allclose(table.eval(wi, wo)[0], skewed(wi, wo), rtol=2e-3)


def test_up_is_at_90_degrees(loaded: Loaded) -> None:
    """The same specimen, measured with up at 0 (the default) and at 90, is the same table."""
    tables = []
    for up, head in ((0, ""), (90, "#upphi 90\n")):
        turned = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]) if up == 0 else np.eye(3)

        def f(wi, wo, turned=turned):
            return brushed(wi @ turned.T, wo @ turned.T)

        phis = (np.arange(0, 360, 30) + up) % 360
        text = "".join(beam(40, phi, f, "BSDF", head=head) for phi in phis) + beam(0, 17, f, "BSDF", head=head)
        tables.append(loaded(text))
    for wi, wo in ((direction(np.radians(40), a), direction(np.radians(36), b)) for a, b in ((0, 1), (np.pi / 2, 2.5))):
        for table in tables:
            assert table.symmetry == "none"
            np.testing.assert_allclose(table.eval(wi, wo)[0], brushed(wi, wo), rtol=2e-3)


def test_half_a_turn_is_mirrored_as_in_radiance(loaded: Loaded) -> None:
    def lopsided(wi, wo):  # its own mirror image at x = 0, not turned by 180 degrees
        return 0.2 + 0.1 * wi[..., 1] + 0.05 * wo[..., 1] * wi[..., 1] ** 2

    # up at 90: the files' phi are the table's; incident directions from -90 to 90 degrees
    text = "".join(beam(40, phi, lopsided, "BSDF", head="#upphi 90") for phi in (270, 315, 0, 45, 90))
    table = loaded(text)
    assert any("mirrored at phi = 270" in note for note in table.info.notes)
    for phi_i in np.radians((45, 135, 180, 225, 315)):
        wi, wo = direction(np.radians(40), phi_i), direction(*np.radians([36, 120]))
        np.testing.assert_allclose(table.eval(wi, wo)[0], lopsided(wi, wo), rtol=1e-4)
    quarter = "".join(beam(40, phi, brushed, "BSDF", head="#upphi 90") for phi in (0, 45, 90))
    assert loaded(quarter).symmetry == "quadrant"


def test_xyz(loaded: Loaded) -> None:
    white = " ".join(f"{0.3 * v:.6f}" for v in (0.95047, 1.0, 1.08883))
    rows = "".join(f"{t} {p} {white}\n" for t in range(0, 90, 15) for p in range(0, 360, 30))
    head = "#colorimetry: CIE-XYZ\n#format: theta phi BSDF\n#intheta 20\n#inphi 180\n"
    table = loaded(head + rows)
    np.testing.assert_allclose(table.eval(direction(np.radians(20), 0), direction(0.5, 2)), [0.3] * 3, rtol=2e-3)


def test_what_the_next_file_looks_like(loaded: Loaded) -> None:
    """CRLF, a mark of the byte order, Latin-1, tabs, comments among the rows, motors that stop a little off."""
    text = beam(0, 180) + beam(30.002, 179.998) + beam(60, 180)
    text = text.replace("#format: theta phi DSF", "#format: theta\tphi\tDSF").replace("felt", "Gläser")
    lines = text.split("\n")
    lines.insert(200, "# a pause of the lamp")
    table = loaded(b"\xef\xbb\xbf" + "\r\n".join(lines).encode("latin-1"))
    assert table.info.sizes["theta_i"] == 3 and table.info.isotropic
    wi, wo = direction(np.radians(30), 0), direction(np.radians(30), np.pi)
    np.testing.assert_allclose(table.eval(wi, wo)[0], glossy(wi, wo), rtol=1e-3)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("#incident_angle 30 0\n#format: theta phi intensity\n0 0 1\n", "format is unknown; found theta phi intensity"),
        ("#intheta 30\n#format: theta phi DSF\n0 0 1\n", "inphi is not an angle; found nothing"),
        ("#intheta inf\n#incident_angle 3 0\n#inphi 0\n#format: theta phi DSF\n0 0 1\n", "intheta is not an angle"),
        ("#incident_angle 30 0\n#format: theta phi DSF\n0 0 1 2\n", "rows do not match"),
        ("#incident_angle 30 0\n#format: theta phi DSF\n#colorimetry: CIE-XYZ\n0 0 1\n", "5 per row"),
        ("#incident_angle 30 0\n#format: theta phi DSF\n#colorimetry: RGB\n0 0 1\n", "colorimetry is unknown"),
        ("#incident_angle 30 0\n#format: theta phi DSF\n0 0 1\n#incident_angle 150 0\n#format: theta phi DSF\n0 0 1\n",
         "both sides"),
        ("#incident_angle 30 0\n#format: theta phi DSF\n0 0 1\n#incident_angle 40 0\n#format: theta phi BSDF\n0 0 1\n",
         "different formats"),
    ],
)  # fmt: skip
def test_refusals(loaded: Loaded, text: str, said: str) -> None:
    with pytest.raises(UserError, match=said):
        loaded(text)
