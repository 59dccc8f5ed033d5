"""LBNL BSDF XML against Radiance: values and direct-hemispherical integrals, all sides, all storage orders."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.geometry.directions import Floats, direction
from lambent.core.light.colour import WHITE_XYZ, luminance, rgb_to_xyz
from lambent.materials.measured import load
from lambent.materials.measured.lbnl_xml import LbnlTable, read
from lambent.materials.measured.parts.klems import KLEMS_FULL, KLEMS_HALF, KLEMS_QUARTER, AngleBasis
from tests.materials.measured.lbnl_files import (
    angle_basis,
    angles_away_from_borders,
    ask_radiance,
    lbnl_xml,
    needs_radiance,
    random_tree,
    words,
)

# Radiance varies its answers by place so that sampling finds no seams: matrices by up to 3e-4, trees by up to 2e-4.
JITTER = 4e-4
REAL = (
    "SingleClear",
    "blinds_20deg_noGlazing_Klems",
    "sawtooth",
    "simple_klems_through_refl_trans",
    "simple_tensor_d3_t3_refl",
    "simple_tensor_spot_refl",
    "t3",
)


def towards(theta_phi_deg: np.ndarray) -> Floats:
    return direction(*np.radians(np.moveaxis(theta_phi_deg, -1, 0)))


def grey(values: Floats) -> Floats:
    return values[..., 0] if values.shape[-1] == 1 else luminance(values)


def agree(path: Path, folder: Path, n: int = 1000, tolerance: float = JITTER, unhandled: bool = False) -> LbnlTable:
    """The table, after every value and integral agreed with Radiance's.

    `unhandled`: Radiance does not integrate what it evaluates when a rank 3 tree is used backwards; it says 0.
    """
    table = load(path)
    asked = angles_away_from_borders(n)
    answers = ask_radiance(path, folder, asked, asked[:300, :2])
    f = grey(table.eval(towards(asked[:, :2]), towards(asked[:, 2:])))
    np.testing.assert_allclose(f, answers["xyz"][:, 1], rtol=tolerance, atol=1e-9)
    assert (f > 0).sum() > n / 100
    wi = towards(asked[:300, :2])
    below = wi[:, 2] < 0
    ours = np.column_stack([grey(table.reflectivity(wi)), grey(table.transmissivity(wi))])
    if unhandled:
        assert (answers["hemi"][below, 1] == 0).all()
        ours[below, 1] = 0
    np.testing.assert_allclose(ours, answers["hemi"], rtol=tolerance, atol=1e-9)
    return table


@needs_radiance
@pytest.mark.parametrize("name", REAL)
def test_real_files_agree_with_radiance(shared_data: Path, tmp_path: Path, name: str) -> None:
    agree(shared_data / "measured" / "lbnl" / f"{name}.xml", tmp_path, unhandled=name == "t3")


def test_check_value_of_t3(shared_data: Path) -> None:
    """Direct-hemispherical transmission at (30, 0), as Radiance's tools report it."""
    table = load(shared_data / "measured" / "lbnl" / "t3.xml")
    np.testing.assert_allclose(table.transmissivity(towards(np.array([30.0, 0.0]))), 0.0765, atol=5e-5)
    assert table.info.isotropic and table.info.transmits


def numbers_of(structure: str, random: np.random.Generator, patches: int = 145, depth: int = 2) -> str:
    """A matrix, or a tree that is cut at random."""
    if not structure.startswith("Tensor"):
        return words(random.random((patches, patches)) * 0.15)
    rank = int(structure[-1])
    return "{" + " ".join(random_tree(random, rank, depth) for _ in range(1 << rank)) + "}"


@needs_radiance
@pytest.mark.parametrize(
    ("structure", "basis"),
    [("Columns", KLEMS_FULL), ("Rows", KLEMS_FULL), ("Columns", KLEMS_HALF), ("Rows", KLEMS_QUARTER),
     ("TensorTree3", None), ("TensorTree4", None)],
)  # fmt: skip
def test_random_files_agree_with_radiance(tmp_path: Path, structure: str, basis: AngleBasis | None) -> None:
    """Both sides without any symmetry, so that every convention of index, side and order shows."""
    random = np.random.default_rng(len(structure) + (basis.count if basis else 0))
    ways = [f"{way} {side}" for way in ("Transmission", "Reflection") for side in ("Front", "Back")]
    blocks = [("Visible", way, numbers_of(structure, random, basis.count if basis else 0)) for way in ways]
    path = tmp_path / "m.xml"
    path.write_text(lbnl_xml(structure, blocks, column=basis.name if basis else ""))
    info = agree(path, tmp_path, n=800).info
    assert info.isotropic == (structure == "TensorTree3")
    assert basis is None or info.sizes == {"incident patches": basis.count, "outgoing patches": basis.count}


@needs_radiance
def test_custom_bases_agree_with_radiance(tmp_path: Path) -> None:
    """Other bases for light that enters and leaves, not square, by rows and by columns, not up to the horizon."""
    ours = angle_basis("coarse", [(0, 20, 1), (20, 55, 5), (55, 90, 7)])
    theirs = angle_basis("fine", [(0, 10, 3), (10, 30.5, 9), (30.5, 62, 11), (62, 85, 4)])
    values = np.random.default_rng(1).random((27, 13)) * 0.2
    for structure, numbers in (("Columns", values), ("Rows", values.T)):
        blocks = [("Visible", "Transmission Back", words(numbers)), ("Visible", "Reflection Back", words(numbers))]
        path = tmp_path / f"{structure}.xml"
        path.write_text(lbnl_xml(structure, blocks, ours + theirs, "coarse", "fine"))
        agree(path, tmp_path, n=800)
    a, b = (read(tmp_path / f"{s}.xml") for s in ("Columns", "Rows"))
    wi, wo = towards(angles_away_from_borders(100)[:, :2]), towards(angles_away_from_borders(100)[:, 2:])
    np.testing.assert_array_equal(a.eval(wi, wo), b.eval(wi, wo))
    assert (a.eval(direction(0.1, 0), direction(np.radians(87), 0)) == 0).all()


@needs_radiance
@pytest.mark.parametrize(
    ("structure", "only", "other"),
    [
        ("Columns", "Front", "absent"),
        ("Columns", "Back", "zero"),
        ("TensorTree3", "Front", "zero"),
        ("TensorTree4", "Back", "absent"),
    ],
)
def test_missing_transmission_follows_by_reciprocity(tmp_path: Path, structure: str, only: str, other: str) -> None:
    random = np.random.default_rng(5)
    full, zero = numbers_of(structure, random, depth=1), words(np.zeros((145, 145)))
    zero = zero if structure == "Columns" else "{ 0 }"
    missing = "Back" if only == "Front" else "Front"
    blocks = [("Visible", f"Transmission {only}", full)]
    blocks += [("Visible", f"Transmission {missing}", zero)] if other == "zero" else []
    path = tmp_path / "r.xml"
    path.write_text(lbnl_xml(structure, blocks))
    table = load(path)
    asked = angles_away_from_borders(300)
    answers = ask_radiance(path, tmp_path, asked, asked[:100, :2])
    wi, wo = towards(asked[:, :2]), towards(asked[:, 2:])
    f = table.eval(wi, wo)[:, 0]
    np.testing.assert_allclose(f, answers["xyz"][:, 1], rtol=JITTER, atol=1e-9)
    np.testing.assert_array_equal(f, table.eval(wo, wi)[:, 0])
    hemi = table.transmissivity(wi[:100])[:, 0]
    if structure == "TensorTree3":  # Radiance does not integrate these backwards
        integral = by_quadrature(table, wi[:4])
        np.testing.assert_allclose(hemi[:4], integral[:, 0], rtol=5e-3)
    else:
        np.testing.assert_allclose(hemi, answers["hemi"][:, 1], rtol=JITTER)
    assert any("reversed from the other side" in note for note in table.info.notes)


def by_quadrature(table: LbnlTable, wi: Floats, n: int = 300) -> Floats:
    """Transmissivity (N, C) by a midpoint rule over the disk, without the table's own sums."""
    line = (np.arange(n) + 0.5) / n
    r, phi = (x.ravel() for x in np.meshgrid(np.sqrt(line), 2 * np.pi * line))
    wo = np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - r * r)], axis=-1)
    return np.array([np.pi * table.eval(w, wo * (1, 1, -np.sign(w[2]))).mean(axis=0) for w in wi])


@needs_radiance
def test_colour_of_matrices_agrees_with_radiance(tmp_path: Path) -> None:
    """XYZ of colours within Rec.709. Radiance keeps Y, and the chromaticity in 16 bits: X and Z to some per cent."""
    random = np.random.default_rng(2)
    rgb = random.uniform(0.02, 0.2, (41, 41, 3))
    xyz = rgb_to_xyz(rgb) / WHITE_XYZ
    blocks = [(name, "Reflection Back", words(xyz[..., c])) for c, name in ((1, "Visible"), (2, "CIE-Z"), (0, "CIE-X"))]
    path = tmp_path / "c.xml"
    path.write_text(lbnl_xml("Columns", [*blocks, ("Solar", *blocks[0][1:])], column="LBNL/Klems Quarter"))
    table = agree(path, tmp_path, n=600, tolerance=5e-4)
    assert table.info.channels == 3
    part = table.parts[("reflection", 1)]
    i, o = np.arange(41), np.roll(np.arange(41), 7)
    np.testing.assert_allclose(part.at(KLEMS_QUARTER.centres[i], KLEMS_QUARTER.centres[o]), rgb[o, i], rtol=1e-5)
    asked = angles_away_from_borders(300)
    f = table.eval(towards(asked[:, :2]), towards(asked[:, 2:]))
    ours = rgb_to_xyz(f) / WHITE_XYZ
    theirs = ask_radiance(path, tmp_path, asked, asked[:1, :2])["xyz"]
    np.testing.assert_allclose(ours, theirs, rtol=0.06, atol=2e-3)
    assert any("Solar" in note for note in table.info.notes)


@pytest.mark.long
@needs_radiance
def test_colour_of_trees_agrees_with_radiance(tmp_path: Path) -> None:
    """Y, u' and v' with different cells; luminance is Y everywhere, and the sums are those of the values."""
    random = np.random.default_rng(3)

    def tree(low: float, high: float) -> str:
        text = random_tree(random, 4, 1, high - low)
        return " ".join(w if w in "{}" else f"{low + float(w):.6g}" for w in text.split())

    blocks = [
        ("Visible", "Transmission Back", tree(0.05, 0.2)),
        ("CIE-u", "Transmission Back", "{" + " ".join(tree(0.19, 0.23) for _ in range(16)) + "}"),
        ("CIE-v", "Transmission Back", "{" + " ".join(tree(0.45, 0.49) for _ in range(16)) + "}"),
    ]
    path = tmp_path / "c.xml"
    path.write_text(lbnl_xml("TensorTree4", blocks))
    table = agree(path, tmp_path, n=300)
    assert table.info.channels == 3
    wi = towards(angles_away_from_borders(4)[:, :2])
    np.testing.assert_allclose(table.transmissivity(wi), by_quadrature(table, wi), rtol=5e-3)
    asked = angles_away_from_borders(300)
    f = table.eval(towards(asked[:, :2]), towards(asked[:, 2:]))
    ours = rgb_to_xyz(f) / WHITE_XYZ
    theirs = ask_radiance(path, tmp_path, asked, asked[:1, :2])["xyz"]
    off = np.abs(ours - theirs) / np.maximum(theirs, 1e-3)
    assert np.quantile(off, 0.95) < 0.02  # Radiance takes a grey part out and fits u' and v' of the rest anew
