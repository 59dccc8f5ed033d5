"""The numbers of written MERL, RGL, gonio and Klems files, parsed by hand, are a material's own values."""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from lambent.core.geometry.directions import Floats, direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.export import gonio_text, lbnl_xml, merl, rgl
from lambent.materials.export.resampling import patch_mean
from tests.materials.export.export_materials import FOIL
from tests.materials.export.formula_table import FormulaTable, lopsided

GLOSSY = Material(name="glossy", kd=(0.3, 0.2, 0.1), lobes=(Lobe(k=0.4, mx=0.2, my=0.2, r0=0.3),))
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


def tensors_by_hand(content: bytes) -> dict[str, np.ndarray]:
    assert content[:14] == b"tensor_file\0\1\0"
    (count,), at, found = struct.unpack_from("<I", content, 14), 18, {}
    for _ in range(count):
        (length,) = struct.unpack_from("<H", content, at)
        name = content[at + 2 : at + 2 + length].decode()
        dimensions, kind, offset = struct.unpack_from("<HBQ", content, at + 2 + length)
        shape = struct.unpack_from(f"<{dimensions}Q", content, at + 13 + length)
        at += 13 + length + 8 * dimensions
        found[name] = np.frombuffer(content, {1: "u1", 10: "<f4"}[kind], int(np.prod(shape)), offset).reshape(shape)
    return found


def test_rgl(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Even samples of the warped square carry the light evenly: the mean of `luminance` is the albedo (plus a floor).

    Matt paint: f cos theta_o per channel is its coefficient / pi times a cosine of at most 1.
    """
    monkeypatch.setattr(rgl, "THETA_I_DEG", np.array([0, 30, 60, 80.0]))
    for material in (GLOSSY, Material(name="matt", kd=(0.6, 0.3, 0.2))):
        rgl.write(material, tmp_path / "a.bsdf")
        found = tensors_by_hand((tmp_path / "a.bsdf").read_bytes())
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


def blocks_by_hand(path: Path) -> dict[tuple[str, str], np.ndarray]:
    """Matrices (outgoing, incident): with structure Columns, each line holds all incident patches."""
    root = ET.parse(path).getroot()
    assert root.findtext(f".//{SPACE}IncidentDataStructure") == "Columns"
    found = {}
    for data in root.iter(f"{SPACE}WavelengthData"):
        block = data.find(f"{SPACE}WavelengthDataBlock")
        way = block.findtext(f"{SPACE}WavelengthDataDirection")
        kind = "BRDF" if way.startswith("Reflection") else "BTDF"
        assert block.findtext(f"{SPACE}ScatteringDataType") == kind
        rows = block.findtext(f"{SPACE}ScatteringData").strip().splitlines()
        found[data.findtext(f"{SPACE}Wavelength"), way] = np.array([row.split() for row in rows], dtype=float)
    return found


def test_klems_rings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The angle basis in the file is Klems's, and matt colour is XYZ of the equal-energy white."""
    monkeypatch.setattr(patch_mean, "LOBES_LOG2", 4)
    lbnl_xml.write(Material(name="red", kd=(0.6, 0.2, 0.1), kt_d=(0.1, 0.1, 0.2)), tmp_path / "a.xml")
    rings = list(ET.parse(tmp_path / "a.xml").getroot().iter(f"{SPACE}AngleBasisBlock"))
    assert [int(ring.findtext(f"{SPACE}nPhis")) for ring in rings] == list(KLEMS_COUNTS)
    bounds = [float(ring.findtext(f"{SPACE}ThetaBounds/{SPACE}UpperTheta")) for ring in rings]
    assert bounds == list(KLEMS_EDGES_DEG[1:])
    middles = [float(ring.findtext(f"{SPACE}Theta")) for ring in rings]
    assert middles == [0, *np.convolve(bounds, [0.5, 0.5], "valid")]
    lower = [float(ring.findtext(f"{SPACE}ThetaBounds/{SPACE}LowerTheta")) for ring in rings]
    assert lower == list(KLEMS_EDGES_DEG[:-1])
    blocks = blocks_by_hand(tmp_path / "a.xml")
    for way, (r, g, b) in {"Reflection": (0.6, 0.2, 0.1), "Transmission": (0.1, 0.1, 0.2)}.items():
        expected = {
            "CIE-X": (0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505,
            "Visible": 0.2126 * r + 0.7152 * g + 0.0722 * b,
            "CIE-Z": (0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.089,
        }
        for name, value in expected.items():
            for side in ("Front", "Back"):
                np.testing.assert_allclose(blocks[name, f"{way} {side}"], value / np.pi, rtol=2e-5)
    assert len(blocks) == 12


def test_klems_order_and_sides(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A formula without symmetry: each patch holds its value near the patch's middle, incident ones from phi + 180."""
    monkeypatch.setattr(patch_mean, "LOBES_LOG2", 8)
    lbnl_xml.write(FormulaTable(lopsided, transmits=True), tmp_path / "a.xml")
    theta = np.repeat([0, *np.convolve(KLEMS_EDGES_DEG[1:], [0.5, 0.5], "valid")], KLEMS_COUNTS)
    phi = np.concatenate([360 * np.arange(n) / n for n in KLEMS_COUNTS])
    steep = np.flatnonzero(theta < 60)
    towards, from_where = (direction(np.radians(theta), np.radians(phi + turn)) for turn in (0, 180))
    for (_, way), values in blocks_by_hand(tmp_path / "a.xml").items():
        side = 1 if way.endswith("Back") else -1
        far = -side if way.startswith("Transmission") else side
        wi, wo = from_where[steep] * (1, 1, side), towards[steep] * (1, 1, far)
        expected = lopsided(*np.broadcast_arrays(wi[None], wo[:, None]))[..., 0]
        np.testing.assert_allclose(values[np.ix_(steep, steep)], expected, rtol=0.06)
