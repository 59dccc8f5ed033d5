"""Written MERL, RGL, gonio and Klems files hold a subject's values: by hand, by our readers, Mitsuba and Radiance."""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.core.geometry.directions import Floats, direction
from lambent.core.geometry.sequences import r2
from lambent.core.light.colour import luminance
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.export import gonio_text, lbnl_xml, merl, rgl
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.measured.inspecting.synthetic import ISOTROPIC, record
from lambent.materials.measured.lbnl_xml import LbnlTable, read
from lambent.materials.measured.merl import directions_of
from lambent.materials.measured.parts.klems import KLEMS_FULL
from lambent.materials.measured.parts.spectral import equal_energy_of_rgb
from lambent.materials.measured.parts.tensor_file import read_tensors
from tests.materials.export.export_materials import FOIL
from tests.materials.export.formula_table import FormulaTable, lopsided
from tests.materials.measured.lbnl_files import angles_away_from_borders, ask_radiance, needs_radiance, words
from tests.materials.measured.lbnl_files import lbnl_xml as file_of
from tests.materials.measured.measured_files import merl_bytes
from tests.tools.in_mitsuba import f_cos

BRUSHED = Material(name="brushed", kd=(0.05,) * 3, lobes=(Lobe(mx=0.25, my=0.12, r0=(0.9,) * 3, k=(0.8, 0.7, 0.6)),))
GLOSSY = Material(name="glossy", kd=(0.3, 0.2, 0.1), lobes=(Lobe(k=0.4, mx=0.2, my=0.2, r0=0.3),))
SHEET = Material(name="foil", kd=(0.3,) * 3, kt_d=(0.2,) * 3)
COARSE = replace(ISOTROPIC, noise=0.0, floor=0.0, step_deg=10, fine_deg=5, sector_deg=0)


@pytest.fixture
def small_rgl(monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter of the nodes, for speed."""
    monkeypatch.setattr(rgl, "NODES", {"isotropic": 32, "other": 32})
    monkeypatch.setattr(rgl, "THETA_I_DEG", np.array([0, 7, 14, 22, 30, 38, 46, 53, 60, 66, 71, 76, 80, 83, 86.0]))


@pytest.fixture
def small_merl(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fewer bins, for a fortieth of the time."""
    monkeypatch.setattr(merl, "SHAPE", (40, 20, 30))
    monkeypatch.setattr(merl, "TURNS", 8)


def test_merl_is_written_once_more_as_it_was(tmp_path: Path, small_merl: None) -> None:
    cost = merl.write(GLOSSY, tmp_path / "a.binary")
    assert cost.lost == () and set(cost.errors) == set(METRICS) and 0 < cost.share["cuberoot"] < 0.02
    assert merl.write(load(tmp_path / "a.binary"), tmp_path / "b.binary").share["l1"] < 1e-9


def test_merl_reports_its_losses(tmp_path: Path, small_merl: None) -> None:
    """An anisotropic material becomes the mean over its azimuths, a non-reciprocal one the mean of both orders."""
    cost = merl.write(BRUSHED, tmp_path / "a.binary")
    assert any("anisotropy" in line for line in cost.lost) and cost.share["cuberoot"] > 0.05
    table, wi = load(tmp_path / "a.binary"), direction(0.4, 0.0)
    turns = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    wi, wo = direction(0.4, turns), direction(0.5, turns + 2.8)
    np.testing.assert_allclose(table.eval(wi[0], wo[0]), MaterialBSDF(BRUSHED).eval(wi, wo).mean(axis=0), rtol=0.02)
    assert any("transmission" in line for line in merl.write(SHEET, tmp_path / "a.binary").lost)

    def lopsided(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return (0.2 + wi[:, 2:]) * np.ones(1)

    cost = merl.write(record(lopsided, "lopsided", COARSE), tmp_path / "a.binary")
    assert any("order of wi and wo" in line for line in cost.lost)
    wi, wo = direction(np.array([0.2, 1.0]), 0.0), direction(np.array([1.0, 0.2]), 2.0)
    f = load(tmp_path / "a.binary").eval(wi, wo)[:, 0]
    assert f == pytest.approx(0.2 + (np.cos(0.2) + np.cos(1.0)) / 2, rel=0.03)


@pytest.mark.parametrize("material", [GLOSSY, BRUSHED], ids=["isotropic", "anisotropic"])
def test_rgl_is_what_mitsuba_reads(tmp_path: Path, small_rgl: None, mi: Any, material: Material) -> None:
    """The written file in our reader and in Mitsuba's `measured` plugin: the same, and close to the material."""
    path = tmp_path / "a.bsdf"
    cost = rgl.write(material, path)
    assert cost.lost == () and cost.share["l1"] < 0.03 and cost.share["cuberoot"] < 0.06
    table = load(path)
    assert table.info.isotropic == (material is GLOSSY) and table.info.format == "RGL tensor file"
    u = np.random.default_rng(1).random((4000, 4))
    wi, wo = (direction(np.arccos(1 - 0.85 * u[:, k]), 2 * np.pi * u[:, k + 1]) for k in (0, 2))
    plugin = f_cos({"type": "measured", "filename": str(path)}, wo, wi)
    mine = table.eval(wi, wo) * wo[:, 2:]
    off = np.abs(mine - plugin) / (np.abs(plugin) + 1e-3)
    assert np.quantile(off, 0.99) < 5e-3 and np.median(off) < 1e-4


@pytest.mark.long
def test_rgl_keeps_a_narrow_lobe_and_reports_lost_transmission(tmp_path: Path, small_rgl: None, monkeypatch) -> None:
    monkeypatch.setitem(rgl.NODES, "isotropic", 64)
    mirrorlike = Material(name="mirror", lobes=(Lobe(mx=0.01, my=0.01, r0=(0.9,) * 3, k=(1.0,) * 3),))
    cost = rgl.write(mirrorlike, tmp_path / "a.bsdf")
    wi = direction(np.radians([0.0, 33.0, 61.0]), 0.0)
    np.testing.assert_allclose(
        load(tmp_path / "a.bsdf").reflectivity(wi), MaterialBSDF(mirrorlike).albedo(wi), rtol=0.03
    )
    assert cost.share["l1"] < 0.1
    assert any("transmission" in line for line in rgl.write(SHEET, tmp_path / "a.bsdf").lost)


GREY = (0.4, 0.4, 0.4)
MIRROR = Material(name="mirror", lobes=(Lobe(k=(0.98,) * 3, mx=0.0068, my=0.0297, r0=0.84, alpha=0.49),))
THIN = Material(
    name="a foil, red & <thin>",
    kd=(0.3, 0.2, 0.1),
    kt_d=(0.05, 0.1, 0.15),
    lobes=(
        Lobe(k=(0.5, 0.5, 0.5), mx=0.5, my=0.25, r0=0.3),
        Lobe(side="transmission", k=(0.3, 0.3, 0.2), mx=0.6, my=0.3, r0=0.0, distribution="ggx"),
    ),
)
BACK = np.array((-1, -1, 1))


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few directions, for results that are exact with any number of them."""
    monkeypatch.setattr(lbnl_xml, "LOBES_LOG2", 5)


@pytest.fixture(scope="module")
def foil(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, LbnlTable]:
    path = tmp_path_factory.mktemp("foil") / "foil.xml"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lbnl_xml, "LOBES_LOG2", 11)  # its lobes are wide
        lbnl_xml.write(THIN, path)
    return path, read(path)


@pytest.fixture(scope="module")
def mirror(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, LbnlTable]:
    """The cost reports that ten-degree patches cannot hold a one-degree lobe."""
    path = tmp_path_factory.mktemp("mirror") / "mirror.xml"
    cost = lbnl_xml.write(MIRROR, path)
    assert any("highlight" in lost for lost in cost.lost) and cost.share["l2_ngan"] > 0.5
    return path, read(path)


def patch_albedo(material: Material, patch: int, n: int = 128) -> tuple[Floats, Floats]:
    """r and t (3,) over a patch of incident light, by the material's sampler instead of the writer's quadrature."""
    wi = KLEMS_FULL.points(np.full(n, patch), r2(n)) * BACK
    bsdf, u = MaterialBSDF(material), np.random.default_rng(patch).random((n, 256, 3))
    every = np.broadcast_to(wi[:, None], u.shape)
    wo = bsdf.sample(every, u)
    pdf = bsdf.pdf(wo, every)
    share = np.divide(np.abs(wo[..., 2]), pdf, out=np.zeros_like(pdf), where=pdf > 0)[..., None] * bsdf.eval(every, wo)
    far = wo[..., 2:] < 0
    return np.where(far, 0, share).mean(axis=(0, 1)), np.where(far, share, 0).mean(axis=(0, 1))


@pytest.mark.parametrize("patch", [0, 4, 50, 100, 130, 140])
def test_energy_is_kept(foil, mirror, patch: int) -> None:
    """The mirror's lobe is a degree wide and the patches ten: values at their middles would be a hundred times off."""
    wi = KLEMS_FULL.centres[patch] * BACK
    r, t = patch_albedo(THIN, patch)
    np.testing.assert_allclose(foil[1].reflectivity(wi), r, rtol=0.015)
    np.testing.assert_allclose(foil[1].transmissivity(wi), t, rtol=0.015)
    r, _ = patch_albedo(MIRROR, patch)
    np.testing.assert_allclose(mirror[1].reflectivity(wi), r[:1], rtol=0.01)


@needs_radiance
def test_radiance_reads_it(foil, tmp_path: Path) -> None:
    """Luminance and integrals as from our reader; colour to the precision Radiance keeps."""
    path, table = foil
    asked = angles_away_from_borders(600)
    answers = ask_radiance(path, tmp_path, asked, asked[:100, :2])
    wi, wo = (direction(*np.radians(asked[:, k : k + 2].T)) for k in (0, 2))
    f = table.eval(wi, wo)
    np.testing.assert_allclose(luminance(f), answers["xyz"][:, 1], rtol=5e-4, atol=1e-9)
    hemi = luminance(np.stack([table.reflectivity(wi[:100]), table.transmissivity(wi[:100])], axis=1))
    np.testing.assert_allclose(hemi, answers["hemi"], rtol=4e-4)
    x, _, z = np.moveaxis(equal_energy_of_rgb(f), -1, 0)
    assert np.corrcoef(x - z, answers["xyz"][:, 0] - answers["xyz"][:, 2])[0, 1] > 0.99


def test_materials_stay_reciprocal(foil, mirror) -> None:
    random = angles_away_from_borders(2000, seed=4)
    wi, wo = (direction(*np.radians(random[:, k : k + 2].T)) for k in (0, 2))
    for _, table in (foil, mirror):
        np.testing.assert_allclose(table.eval(wi, wo), table.eval(wo, wi), rtol=2e-6)


@pytest.mark.long
def test_a_matrix_is_written_as_it_was_read(tmp_path: Path, hasty: None) -> None:
    """A matrix is constant over patches, so its means are its values, on both sides."""
    random = np.random.default_rng(1)
    blocks = [
        ("Visible", d, words(random.random((145, 145)) * 0.2))
        for d in ("Transmission Front", "Transmission Back", "Reflection Front", "Reflection Back")
    ]
    source = tmp_path / "a.xml"
    source.write_text(file_of("Columns", blocks))
    table = read(source)
    cost = lbnl_xml.write(table, tmp_path / "b.xml")
    again = read(tmp_path / "b.xml")
    for where, part in table.parts.items():
        np.testing.assert_allclose(again.parts[where].values, part.values, rtol=2e-6)
    assert max(cost.share.values()) < 1e-5
    assert not any("behind" in lost for lost in cost.lost)


@pytest.mark.long
def test_a_measured_table(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Grey and glossy, known from one side alone; the cost has every metric and names the missing back."""
    glossy = Material(name="glossy", kd=GREY, lobes=(Lobe(k=(0.5, 0.5, 0.5), mx=0.2, my=0.2, r0=0.3),))
    theta_h, theta_d, phi_d = np.meshgrid(*((np.arange(n) + 0.5) / n * np.pi / 2 for n in (40, 40, 40)), indexing="ij")
    wi, wo = directions_of(theta_h**2 * 2 / np.pi, theta_d, 2 * phi_d)
    f = np.where((wi[..., 2:] > 0) & (wo[..., 2:] > 0), MaterialBSDF(glossy).eval(wi, wo), np.nan)
    (tmp_path / "g.binary").write_bytes(merl_bytes(f))
    table = load(tmp_path / "g.binary")
    monkeypatch.setattr(lbnl_xml, "LOBES_LOG2", 11)
    cost = lbnl_xml.write(table, tmp_path / "g.xml")
    written = read(tmp_path / "g.xml")
    for patch in (0, 20, 80):
        u = r2(16)
        wi = KLEMS_FULL.points(np.full(16, patch), u) * BACK
        np.testing.assert_allclose(written.reflectivity(wi[:1])[0], table.reflectivity(wi).mean(axis=0), rtol=0.02)
    assert set(cost.share) == set(METRICS) and 0 < cost.share["l1"] < 0.3
    assert any("behind" in lost for lost in cost.lost)


SPACE = "{http://windows.lbl.gov}"
KLEMS_EDGES_DEG = (0, 5, 15, 25, 35, 45, 55, 65, 75, 90)
KLEMS_COUNTS = (1, 8, 16, 20, 24, 24, 24, 16, 12)


def about(v: Floats, axis: int, angle: Floats) -> Floats:
    """v (N, 3) turned about y (1) or z (2)."""
    c, s = np.cos(angle), np.sin(angle)
    x, y, z = v.T
    return np.stack([c * x + s * z, y, c * z - s * x] if axis == 1 else [c * x - s * y, s * x + c * y, z], axis=-1)


def test_merl(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rusinkiewicz 1998: wi is the difference vector, turned by theta_h about the binormal; wo is its mirror image.

    The scales are those of MERL's own reader.
    """
    assert merl.SHAPE == (90, 90, 180)
    monkeypatch.setattr(merl, "SHAPE", (30, 15, 36))
    merl.write(GLOSSY, tmp_path / "a.binary")
    content = (tmp_path / "a.binary").read_bytes()
    assert struct.unpack_from("<3i", content) == (30, 15, 36)
    planes = np.frombuffer(content, "<f8", offset=12).reshape(3, 30, 15, 36)
    h, d, p = (x.ravel() for x in np.indices((30, 15, 36)))
    theta_h, theta_d, phi_d = ((h + 0.5) / 30) ** 2 * np.pi / 2, (d + 0.5) / 15 * np.pi / 2, (p + 0.5) / 36 * np.pi
    wi, wo = (about(direction(theta_d, phi), 1, theta_h) for phi in (phi_d, phi_d + np.pi))
    f = np.moveaxis(planes, 0, -1).reshape(-1, 3) * np.array([1.0, 1.15, 1.66]) / 1500
    above = (wi[:, 2] > 1e-3) & (wo[:, 2] > 1e-3)
    np.testing.assert_allclose(f[above], MaterialBSDF(GLOSSY).eval(wi[above], wo[above]), rtol=1e-6)
    assert (f[(wi[:, 2] < -1e-3) | (wo[:, 2] < -1e-3)] < 0).all() and above.sum() > 5000


@pytest.mark.long
def test_gonio_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every row is the material's f at its angles; theta_o over 90 degrees is below the sheet."""
    monkeypatch.setitem(gonio_text.THETA_I_DEG, "other", (0, 35, 70))
    monkeypatch.setattr(gonio_text, "STEP_DEG", 9.0)
    gonio_text.write(FOIL, tmp_path / "a.txt")
    lines = (tmp_path / "a.txt").read_text().splitlines()
    assert "# name: 4 % foil" in lines and "# symmetry: quadrant" in lines
    names, *rows = (line.split() for line in lines if not line.startswith("#"))
    assert names[:4] == ["theta_i", "phi_i", "theta_o", "phi_o"] and names[4:] in (["f_r", "f_g", "f_b"], ["f"])
    values = np.array(rows, dtype=float)
    seen = np.isfinite(values[:, 4])
    wi, wo = (direction(*np.radians(values[seen, k : k + 2].T)) for k in (0, 2))
    expected = MaterialBSDF(FOIL).eval(wi, wo)
    np.testing.assert_allclose(values[seen, 4:], expected, rtol=2e-4, atol=1e-6)
    assert set(values[:, 0]) == {0, 35, 70} and set(values[:, 1]) == {0, 15, 30, 45, 60, 75, 90}
    assert seen.mean() > 0.9 and (values[:, 2] > 90).any()


def test_rgl(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Even samples of the warped square carry the light evenly: the mean of `luminance` is the albedo (plus a floor).

    Matt paint: f cos theta_o per channel is its coefficient / pi times a cosine of at most 1.
    """
    monkeypatch.setattr(rgl, "THETA_I_DEG", np.array([0, 30, 60, 80.0]))
    for material in (GLOSSY, Material(name="matt", kd=(0.6, 0.3, 0.2))):
        rgl.write(material, tmp_path / "a.bsdf")
        found = read_tensors(tmp_path / "a.bsdf")
        np.testing.assert_allclose(found["theta_i"], np.radians([0, 30, 60, 80]), rtol=1e-6)
        assert found["description"].tobytes().decode().startswith(material.name)
        assert found["jacobian"].tolist() == [0] and found["rgb"].shape[:3] == (1, 4, 3)
        light = found["luminance"][0].astype(float)
        inner = np.trapezoid(np.trapezoid(light, dx=1 / 63), dx=1 / 63)
        floor = 0.02 * light.mean(axis=(1, 2)) / 1.02
        wi = direction(np.radians([0, 30, 60.0, 80]), 0.0)
        albedo = MaterialBSDF(material).albedo(wi, samples=1 << 15) @ (0.2126, 0.7152, 0.0722)
        np.testing.assert_allclose(inner - floor, albedo, rtol=0.03)
    rgb = found["rgb"].astype(float)
    np.testing.assert_allclose(rgb[0, :, 0] / rgb[0, :, 1], 2, rtol=1e-5)
    np.testing.assert_allclose(rgb[0, :, 1] / rgb[0, :, 2], 1.5, rtol=1e-5)
    assert rgb.max() == pytest.approx(0.6 / np.pi, rel=0.01)


@pytest.mark.long
def test_klems_rings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The angle basis in the file is Klems's, and matt colour is XYZ of the equal-energy white."""
    monkeypatch.setattr(lbnl_xml, "LOBES_LOG2", 4)
    lbnl_xml.write(Material(name="red", kd=(0.6, 0.2, 0.1), kt_d=(0.1, 0.1, 0.2)), tmp_path / "a.xml")
    rings = list(ET.parse(tmp_path / "a.xml").getroot().iter(f"{SPACE}AngleBasisBlock"))
    assert [int(ring.findtext(f"{SPACE}nPhis")) for ring in rings] == list(KLEMS_COUNTS)
    bounds = [float(ring.findtext(f"{SPACE}ThetaBounds/{SPACE}UpperTheta")) for ring in rings]
    assert bounds == list(KLEMS_EDGES_DEG[1:])
    middles = [float(ring.findtext(f"{SPACE}Theta")) for ring in rings]
    assert middles == [0, *np.convolve(bounds, [0.5, 0.5], "valid")]
    lower = [float(ring.findtext(f"{SPACE}ThetaBounds/{SPACE}LowerTheta")) for ring in rings]
    assert lower == list(KLEMS_EDGES_DEG[:-1])
    values = [float(v) for v in ET.parse(tmp_path / "a.xml").getroot().findtext(f".//{SPACE}ScatteringData").split()]
    assert values[0] == pytest.approx((0.4124 * 0.6 + 0.3576 * 0.2 + 0.1805 * 0.1) / 0.9505 / np.pi, rel=2e-5)  # X
    table, wi = read(tmp_path / "a.xml"), direction(np.radians([20.0, 160.0]), 0.3)
    np.testing.assert_allclose(table.eval(wi, wi), np.tile([0.6, 0.2, 0.1], (2, 1)) / np.pi, rtol=2e-5)
    np.testing.assert_allclose(table.eval(wi, -wi), np.tile([0.1, 0.1, 0.2], (2, 1)) / np.pi, rtol=2e-5)


@pytest.mark.long
def test_klems_order_and_sides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A formula without symmetry: each patch holds its value near the patch's middle, incident ones from phi + 180."""
    monkeypatch.setattr(lbnl_xml, "LOBES_LOG2", 8)
    lbnl_xml.write(FormulaTable(lopsided, transmits=True), tmp_path / "a.xml")
    theta = np.repeat([0, *np.convolve(KLEMS_EDGES_DEG[1:], [0.5, 0.5], "valid")], KLEMS_COUNTS)
    phi = np.concatenate([360 * np.arange(n) / n for n in KLEMS_COUNTS])
    middles = direction(np.radians(theta), np.radians(phi))[theta < 60]
    table = read(tmp_path / "a.xml")
    for side_i, side_o in np.ndindex(2, 2):
        wi, wo = middles[None] * (1, 1, 1 - 2 * side_i), middles[:, None] * (1, 1, 1 - 2 * side_o)
        np.testing.assert_allclose(table.eval(wi, wo), lopsided(*np.broadcast_arrays(wi, wo)), rtol=0.06)
