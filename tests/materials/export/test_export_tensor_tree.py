"""Written tensor trees: values, energy, peaks, colour and sides, by our reader and by Radiance."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import Floats, direction, normalize
from lambent.core.geometry.sequences import r2
from lambent.core.light.colour import luminance
from lambent.core.progress import Cancelled
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.export import lbnl_xml, tensor_tree
from lambent.materials.export.resampling import tree_growth
from lambent.materials.measured.lbnl_xml import read
from lambent.materials.measured.parts.tensor_tree import Rank, disk_of
from lambent.materials.measured.parts.tree_part import on_sphere
from tests.materials.export.export_materials import PLASTIC
from tests.materials.export.formula_table import FormulaTable, lopsided
from tests.materials.measured.lbnl_files import angles_away_from_borders, ask_radiance, random_tree
from tests.materials.measured.lbnl_files import lbnl_xml as file_of

GLOSSY = Material(name="glossy & grey", kd=0.2, lobes=(Lobe(k=0.6, mx=0.06, my=0.06, r0=0.4),))
BRUSHED = Material(name="brushed", kd=0.1, kt_d=0.2, lobes=(Lobe(k=0.8, mx=0.5, my=0.2, r0=0.6),))
WAYS = {"Reflection Back": (1, 1), "Transmission Back": (1, -1), "Reflection Front": (-1, -1)}
WAYS |= {"Transmission Front": (-1, 1)}


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Trees of so many cells, for speed."""

    def limit(log2_cells: int, scouts_log2: int = 15) -> None:
        monkeypatch.setattr(tree_growth, "MOST_CELLS", {3: 1 << log2_cells, 4: 1 << log2_cells})
        monkeypatch.setattr(tensor_tree, "SCOUTS_LOG2", scouts_log2)
        monkeypatch.setattr(lbnl_xml, "LOBES_LOG2", 5)

    limit(15)
    return limit


def steep_pairs(n: int, seed: int) -> tuple[Floats, Floats]:
    """Random pairs (n, 3) of the upper side, theta below 75 degrees."""
    u = np.random.default_rng(seed).random((4, n))
    wi, wo = (direction(np.arcsin(np.sin(np.radians(75)) * np.sqrt(u[k])), 2 * np.pi * u[k + 1]) for k in (0, 2))
    return wi, wo


def within_tolerance(written: Floats, f: Floats) -> None:
    """A cell's mean is off by at most the cell's range, which is limited by the value and by the mean of all."""
    assert (np.abs(written - f) <= tree_growth.TOLERANCE * (f + f.mean())).all()


@pytest.mark.long
def test_every_convention(tmp_path: Path, small: Callable[[int], None]) -> None:
    """Order of dimensions, headings, sides: each shows, as the formula is different in all of them."""
    small(16)
    cost = tensor_tree.write(FormulaTable(lopsided, transmits=True), tmp_path / "a.xml")
    text, table = (tmp_path / "a.xml").read_text(), read(tmp_path / "a.xml")
    assert table.info.sizes["rank"] == 4 and len(table.parts) == 4 and cost.verdict.word == "faithful"
    for name, (side_i, side_o) in WAYS.items():
        wi, wo = (w * (1, 1, side) for w, side in zip(steep_pairs(300, 1), (side_i, side_o), strict=True))
        within_tolerance(table.eval(wi, wo)[:, 0], lopsided(wi, wo)[:, 0])
        kind = "BRDF" if name.startswith("Reflection") else "BTDF"
        assert re.search(f"{name}</W[^/]*<AngleBasis>[^<]*</AngleBasis>[^/]*<ScatteringDataType>{kind}<", text)
        x = on_sphere(disk_of(r2(1024))) * (1, 1, side_i)
        share = table.reflectivity(x) if side_i == side_o else table.transmissivity(x)
        mean = lopsided(x, np.array([0, 0, side_o])).mean()  # the odd terms of wo vanish over the disk
        assert share.mean() / np.pi == pytest.approx(mean, rel=2e-3)


def test_rank_3_turns_with_the_light(tmp_path: Path, small: Callable[[int], None]) -> None:
    """An isotropic formula that is brighter to the left of the plane of incidence than to its right."""

    def f(wi: Floats, wo: Floats) -> Floats:
        across = wi[..., 0] * wo[..., 1] - wi[..., 1] * wo[..., 0]
        along = wi[..., 0] * wo[..., 0] + wi[..., 1] * wo[..., 1]
        return np.asarray((wi[..., 2] * wo[..., 2] > 0) * (0.2 + 0.1 * across - 0.05 * along))[..., None]

    tensor_tree.write(FormulaTable(f, isotropic=True), tmp_path / "a.xml")
    table, (wi, wo) = read(tmp_path / "a.xml"), steep_pairs(300, 2)
    assert table.info.sizes["rank"] == 3 and ("reflection", -1) in table.parts
    within_tolerance(table.eval(wi, wo)[:, 0], f(wi, wo)[:, 0])


@pytest.mark.long
def test_the_peak_and_the_energy_are_kept(tmp_path: Path, small: Callable[[int], None]) -> None:
    """A lobe 7 degrees wide, along the mirror direction, where Klems patches lose two thirds of it."""
    small(16)
    cost = tensor_tree.write(GLOSSY, tmp_path / "a.xml")
    table, wi = read(tmp_path / "a.xml"), direction(np.radians(np.arange(5, 76, 5)), 0.7)
    wo = wi * (-1, -1, 1)
    off = np.abs(table.eval(wi, wo)[:, 0] / MaterialBSDF(GLOSSY).eval(wi, wo)[:, 0] - 1)
    assert table.info.sizes["rank"] == 3
    assert off.max() < 2 * tree_growth.TOLERANCE and off.mean() < tree_growth.TOLERANCE / 2
    asked = on_sphere(disk_of(r2(256)))
    expected = MaterialBSDF(GLOSSY).albedo(asked)[:, 0].mean()
    assert table.reflectivity(asked).mean() == pytest.approx(expected, rel=0.005)
    assert cost.verdict.word == "faithful" and cost.share["l2_ngan"] < 0.1


@pytest.mark.long
@pytest.mark.parametrize(("rank", "log2_cells"), [(3, 11), (4, 13)])
def test_an_unresolved_peak_keeps_its_energy_and_is_reported(
    tmp_path: Path, small: Callable[[int], None], rank: Rank, log2_cells: int
) -> None:
    """A lobe far narrower than the cells: by even places alone its light would be 1.5 and 59 times too much."""
    small(log2_cells)
    mirror = Material(name="mirror", lobes=(Lobe(k=1, mx=0.002, my=0.002, r0=0.9),))
    cost = tensor_tree.write(mirror, tmp_path / "a.xml", rank=rank)
    asked = on_sphere(disk_of(r2(512)))
    expected = MaterialBSDF(mirror).albedo(asked)[:, 0].mean()
    assert read(tmp_path / "a.xml").reflectivity(asked).mean() == pytest.approx(expected, rel=0.03)
    assert any("the peak" in line for line in cost.lost) and any("vary by more" in line for line in cost.lost)
    assert cost.verdict.word == "unusable"


@pytest.mark.long
def test_a_peak_in_an_unusual_place_is_found(tmp_path: Path, small: Callable[[int], None]) -> None:
    """Light that goes back where it came from, which no lobe of the search expects, 4 degrees wide."""

    def retro(wi: Floats, wo: Floats) -> Floats:
        off = np.linalg.norm(wo - wi, axis=-1)
        return np.asarray((wi[..., 2] * wo[..., 2] > 0) * (0.1 + 50 * np.exp(-((off / 0.07) ** 2))))[..., None]

    small(15)
    u = np.random.default_rng(3).random((2, 10000))
    wi = direction(np.radians(80 * u[0]), 2 * np.pi * u[1])
    wo = normalize(wi + 0.02 * np.random.default_rng(4).normal(size=wi.shape))
    above = wo[:, 2] > 0.02
    tensor_tree.write(FormulaTable(retro, isotropic=True, pairs=(wi[above], wo[above])), tmp_path / "a.xml")
    table, asked = read(tmp_path / "a.xml"), direction(np.radians([10.0, 35.0, 60.0]), 1.0)
    np.testing.assert_allclose(table.eval(asked, asked)[:, 0], 50.1, rtol=3 * tree_growth.TOLERANCE)


def test_colour_by_hand(tmp_path: Path, small: Callable[[int], None]) -> None:
    """Y is the luminance; u' and v' are those of equal-energy XYZ: X over .9505 and Z over 1.089 of D65's white."""
    tensor_tree.write(Material(name="red", kd=(0.6, 0.2, 0.1)), tmp_path / "a.xml")
    table = read(tmp_path / "a.xml")
    x = (0.4124 * 0.6 + 0.3576 * 0.2 + 0.1805 * 0.1) / 0.9505
    y = 0.2126 * 0.6 + 0.7152 * 0.2 + 0.0722 * 0.1
    z = (0.0193 * 0.6 + 0.1192 * 0.2 + 0.9505 * 0.1) / 1.089
    whole = x + 15 * y + 3 * z
    for part in table.parts.values():
        found = [float(tree.look_up(np.array([[0.3, 0.2, 0.9]]))[0][0]) for tree in part.trees]
        assert found == pytest.approx([y / np.pi, 4 * x / whole, 9 * y / whole], rel=2e-5)
        assert len(part.trees[0].values) <= 16  # nothing varies, so nothing is divided
    wi, wo = steep_pairs(50, 3)
    np.testing.assert_allclose(table.eval(wi, wo), np.tile([0.6, 0.2, 0.1], (50, 1)) / np.pi, rtol=1e-4)


def same_trees(one: Path, other: Path) -> bool:
    """Whether two files have the same cells and values, to the last digit, each side with its own."""
    before, after = read(one).parts, read(other).parts
    pairs = [(a, b) for where in before for a, b in zip(before[where].trees, after[where].trees, strict=True)]
    names = ("children", "starts", "logs", "values")
    same = all(np.array_equal(getattr(a, name), getattr(b, name)) for a, b in pairs for name in names)
    return same and before.keys() == after.keys()


@pytest.mark.long
@pytest.mark.parametrize("rank", [3, 4])
def test_trees_that_were_read_are_written_as_they_are(tmp_path: Path, rank: int) -> None:
    random = np.random.default_rng(rank)
    scales = {"Visible": 0.2, "CIE-u": 0.3, "CIE-v": 0.5}
    blocks = [
        (name, way, "{" + " ".join(random_tree(random, rank, 2, scale) for _ in range(1 << rank)) + "}")
        for way in WAYS
        for name, scale in scales.items()
    ]
    (tmp_path / "a.xml").write_text(file_of(f"TensorTree{rank}", blocks))
    cost = tensor_tree.write(read(tmp_path / "a.xml"), tmp_path / "b.xml")
    assert same_trees(tmp_path / "a.xml", tmp_path / "b.xml") and cost.lost == () and max(cost.share.values()) == 0


@pytest.mark.long
@pytest.mark.parametrize("name", ["t3", "simple_tensor_d3_t3_refl", "simple_tensor_spot_refl"])
def test_real_trees_come_back_and_radiance_agrees(shared_data: Path, tmp_path: Path, name: str) -> None:
    source, written = shared_data / "measured" / "lbnl" / f"{name}.xml", tmp_path / "written.xml"
    cost = tensor_tree.write(read(source), written)
    assert same_trees(source, written) and max(cost.share.values()) == 0
    asked = angles_away_from_borders(500)
    answers = [ask_radiance(path, tmp_path, asked, asked[:100, :2]) for path in (source, written)]
    for key in ("xyz", "hemi"):
        np.testing.assert_array_equal(answers[0][key], answers[1][key])


@pytest.mark.long
@pytest.mark.parametrize("material", [PLASTIC, BRUSHED], ids=["rank 3", "rank 4"])
def test_radiance_reads_what_was_grown(tmp_path: Path, small: Callable[[int], None], material: Material) -> None:
    small(14)
    tensor_tree.write(material, tmp_path / "a.xml")
    table, asked = read(tmp_path / "a.xml"), angles_away_from_borders(600)
    answers = ask_radiance(tmp_path / "a.xml", tmp_path, asked, asked[:100, :2])
    wi, wo = (direction(*np.radians(asked[:, k : k + 2].T)) for k in (0, 2))
    f, r, t = table.eval(wi, wo), table.reflectivity(wi[:100]), table.transmissivity(wi[:100])
    f, r, t = (luminance(v) if v.shape[1] == 3 else v[:, 0] for v in (f, r, t))
    np.testing.assert_allclose(f, answers["xyz"][:, 1], rtol=5e-4, atol=1e-9)
    np.testing.assert_allclose(np.stack([r, t], axis=1), answers["hemi"], rtol=1e-3, atol=1e-9)


def test_rank_3_is_for_isotropic_sheets(tmp_path: Path, small: Callable[[int], None]) -> None:
    with pytest.raises(UserError, match="isotropic"):
        tensor_tree.write(BRUSHED, tmp_path / "a.xml", rank=3)


@pytest.mark.parametrize("writer", [tensor_tree, lbnl_xml], ids=lambda writer: writer.NAME)
def test_what_cannot_be_written_leaves_no_file(tmp_path: Path, small: Callable[[int], None], writer) -> None:
    def stop(done: float, total: float, what: str) -> None:
        if done > 0.02 * total:
            raise Cancelled

    with pytest.raises(UserError, match="no light"):
        writer.write(Material(name="hole"), tmp_path / "a.xml")
    with pytest.raises(Cancelled):
        writer.write(GLOSSY, tmp_path / "a.xml", stop)
    assert not list(tmp_path.iterdir())
