"""Parts of BSDF files with answers known by hand; hostile files give one line, in time, with memory in proportion."""

from __future__ import annotations

import re
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import Floats, direction
from lambent.core.geometry.sequences import r2
from lambent.materials.measured import load
from lambent.materials.measured.lbnl_xml import NAME, LbnlTable
from lambent.materials.measured.parts.klems import BUILT_IN, KLEMS_FULL, AngleBasis, PatchMatrix
from lambent.materials.measured.parts.tensor_tree import Malformed, disk_of, parse_tree, square_of
from lambent.materials.measured.registry import HEAD_BYTES, readers
from tests.materials.measured.lbnl_files import angle_basis, lbnl_xml, random_tree, words
from tests.materials.measured.measured_files import Loaded
from tests.materials.measured.sound_files import seeds

FIXED_BYTES = 8 << 20
HANGS_S = 10.0  # far beyond what any of these takes on a busy machine
WI, WO = np.array([[0.6, 0.0, 0.8]]), np.array([[-0.6, 0.0, 0.8]])


SOUND = seeds()["LBNL BSDF XML"][0]  # a matrix on a basis of its own


def attempt(path: Path, content: bytes, tuples: int = 1000) -> str:
    """The one-line `UserError` for `content`, or "" for a usable table, in time and memory in proportion."""
    path.write_bytes(content)
    said = ""
    start = time.perf_counter()
    tracemalloc.start()
    try:
        table = load(path)
        peak = tracemalloc.get_traced_memory()[1]
        assert np.isfinite(table.eval(WI, WO)).all() and np.isfinite(table.albedo(WI)).all()
        if tuples:
            assert np.isfinite(table.samples(tuples).f).all()
    except UserError as error:
        said = str(error)
        peak = tracemalloc.get_traced_memory()[1]
        assert "\n" not in said and path.name in said
    finally:
        tracemalloc.stop()
    assert time.perf_counter() - start < HANGS_S
    assert peak < 10 * len(content) + FIXED_BYTES
    return said


@pytest.fixture(scope="module")
def target(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("broken") / "broken.xml"
    path.write_bytes(SOUND)
    load(path).samples(10)  # imports are warm, and the sound file is sound
    return path


BOMB = '<!DOCTYPE x [<!ENTITY a "ha">' + "".join(
    f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (
            lambda s: s.replace("<WindowElement", BOMB + "]><WindowElement", 1).replace("made up", "&i;"),
            "document type",
        ),
        (
            lambda s: s.replace("<WindowElement", '<!DOCTYPE x SYSTEM "file:///etc/passwd"><WindowElement', 1),
            "document type",
        ),
        (lambda s: s.replace("made up", "&xxe;"), "not well-formed"),
        (lambda s: s.replace("<nPhis>4", "<nPhis>4000000000"), "wrong number of values"),
        (lambda s: s.replace("<nPhis>4", "<nPhis>" + "9" * 6000), "not all numbers"),
        (lambda s: s.replace("<nPhis>4", "<nPhis>1"), "a ring of 1"),
        (lambda s: s.replace("<UpperTheta>60", "<UpperTheta>nan"), "theta does not rise"),
        (lambda s: s.replace("<LowerTheta>30", "<LowerTheta>20"), "theta does not rise"),
        (lambda s: s.replace("<AngleBasisName>mine", "<AngleBasisName>yours"), "unknown angle basis"),
        (lambda s: s.replace("Columns", "Diagonals"), "IncidentDataStructure"),
        (lambda s: s.replace("BTDF", "BRRF"), "ScatteringDataType"),
        (lambda s: s.replace("Visible", "Infrared"), "Wavelength"),
        (lambda s: s.replace("Reflection Back", "Up").replace("Transmission Front", "Down"), "no block has a side"),
        (lambda s: s.replace("<ScatteringData>0.", "<ScatteringData>nan 0."), "wrong number of values"),
        (lambda s: s.replace("<ScatteringData>0.", "<ScatteringData>1e999"), "not finite"),
        (lambda s: s.replace("<ScatteringData>0.", "<ScatteringData>x"), "not a number"),
        (lambda s: s.replace("<ScatteringData>", "<ScatteringData><!-- 0.1 -->").replace("0.", "-0."), "above zero"),
        (lambda s: s.replace("<WindowElement ", "<Window ").replace("/WindowElement>", "/Window>"), "known format"),
        (lambda s: s.replace("<Optical>", "<Optics>").replace("</Optical>", "</Optics>"), "IncidentDataStructure"),
        (lambda s: s.replace("nobody", "x" * 20000), "too long"),
        (lambda s: s.replace("nobody", "<a>" * 100 + "</a>" * 100), "deeper"),
        (lambda s: s.replace("nobody", "<a/>" * 100000), "more or deeper elements"),
        (
            lambda s: s.replace("<Material", "<Material " + " ".join(f"a{k}=''" for k in range(100000)), 1),
            "tag of over",
        ),
        (lambda s: s.replace("UTF-8", "no-such-code"), "well-formed|encoding"),
    ],
)
def test_hostile_matrices(target: Path, change, expected: str) -> None:
    content = change(SOUND.decode())
    assert content != SOUND.decode()
    said = attempt(target, content.encode())
    assert re.search(expected, said), said


@pytest.mark.parametrize(
    "content",
    [
        SOUND.replace(b"nobody", b"caf\xe9"),
        SOUND.decode().replace("UTF-8", "UTF-16").encode("utf-16"),
        b"\xef\xbb\xbf<WindowElement>" + b"\xff" * 100,
        b"<WindowElement>",
        b"<WindowElement/>",
    ],
)
def test_not_utf8_or_nearly_empty(target: Path, content: bytes) -> None:
    assert attempt(target, content)


@pytest.mark.parametrize(
    "tree", ["{" * 300_000, "}" * 300_000, "{}" * 300_000, "{1}" * 300_000, "1 " * 500_000, "," * 10**6]
)
def test_hostile_trees(target: Path, tree: str) -> None:
    said = attempt(target, lbnl_xml("TensorTree4", [("Visible", "Reflection Back", tree)]).encode())
    assert "tensor tree is malformed" in said


def test_dense_trees_stay_in_proportion(target: Path) -> None:
    """The highest cost per letter: leaves of one digit, and branches of those."""
    leaf = "{1}"
    for _ in range(4):
        leaf = "{" + leaf * 16 + "}"
    assert attempt(target, lbnl_xml("TensorTree4", [("Visible", "Reflection Back", leaf)]).encode(), tuples=0) == ""
    grid = "{" + "1 " * 16**4 + "}"
    assert attempt(target, lbnl_xml("TensorTree4", [("Visible", "Reflection Back", grid)]).encode(), tuples=0) == ""
    matrix = lbnl_xml("Columns", [("Visible", "Reflection Back", "1 " * 145**2)] * 8)
    assert attempt(target, matrix.encode(), tuples=0) == ""


def test_prefixes_byte_order_mark_and_order_change_nothing(target: Path) -> None:
    plain = SOUND.decode()
    target.write_text(plain)
    expected = load(target).eval(WI, WO * (1, 1, -1))
    prefixed = plain.replace("xmlns=", "xmlns:w=").replace("</", "</w:")
    for tag in ("WindowElement", "Optical", "Layer", "DataDefinition", "ScatteringData", "Material"):
        prefixed = prefixed.replace(f"<{tag}>", f"<w:{tag}>").replace(f"<{tag} ", f"<w:{tag} ")
    prefixed = re.sub(r"<(\w+)([ >])", r"<w:\1\2", prefixed)
    definition = re.search("<DataDefinition>.*</DataDefinition>\n", plain, re.S)[0]
    later = plain.replace(definition, "").replace("</Layer>", definition + "</Layer>")
    for content in (prefixed.encode(), b"\xef\xbb\xbf" + plain.encode(), later.encode()):
        target.write_bytes(content)
        np.testing.assert_array_equal(load(target).eval(WI, WO * (1, 1, -1)), expected)


def test_a_second_layer_is_ignored_with_a_note(target: Path) -> None:
    plain = SOUND.decode()
    start, end = plain.index("<Layer>"), plain.index("</Layer>") + 8
    layer = plain[start:end]
    target.write_text(plain[:end] + layer.replace("mine", "other").replace("0.", "9.") + plain[end:])
    table = load(target)
    assert any("first layer" in note for note in table.info.notes)
    for text in (plain, plain[:start] + "<Layer><Material><Name>glass</Name></Material></Layer>" + plain[start:]):
        target.write_text(text)
        np.testing.assert_array_equal(load(target).eval(WI, WO), table.eval(WI, WO))


RECOVER = b"Recover using: genBSDF -recover /tmp/genBSDF.4711\n"


@pytest.mark.parametrize("lines", [RECOVER, RECOVER.replace(b"\n", b"\r\n"), b"\n\n", b"\xef\xbb\xbf" + RECOVER * 16])
@pytest.mark.parametrize("declared", [True, False])
def test_lines_before_the_xml_are_skipped_and_noted(target: Path, lines: bytes, declared: bool) -> None:
    """genBSDF's own output begins with one."""
    plain = SOUND
    if not declared:
        plain = plain[plain.index(b"<WindowElement") :]
    target.write_bytes(plain)
    expected = load(target).eval(WI, WO * (1, 1, -1))
    assert attempt(target, lines + plain) == ""
    table = load(target)
    np.testing.assert_array_equal(table.eval(WI, WO * (1, 1, -1)), expected)
    assert any("genBSDF -recover" in note for note in table.info.notes) == (b"Recover" in lines)
    claims = [r.NAME for r in readers() if r.recognise((lines + plain)[:HEAD_BYTES], len(lines + plain))]
    assert claims == [NAME]


@pytest.mark.parametrize(
    "lines", [RECOVER * 17, b"x" * 1025 + b"\n", b"Recover\0using\n", b"<svg/>\n", b"<!-- a -->\n<!DOCTYPE a>\n"]
)
def test_other_beginnings_are_refused(target: Path, lines: bytes) -> None:
    """Too many lines, too long a line, a binary line, and markup that hides a document type."""
    assert attempt(target, lines + SOUND)


def test_a_document_type_after_the_lines_is_refused(target: Path) -> None:
    hidden = SOUND.replace(b"<WindowElement ", b"<!DOCTYPE a><WindowElement ", 1)
    assert "document type" in attempt(target, RECOVER + hidden)


def test_klems_bases() -> None:
    assert [basis.count for basis in BUILT_IN] == [145, 77, 41]
    for basis in BUILT_IN:
        np.testing.assert_allclose(basis.projected_sr.sum(), np.pi)
        np.testing.assert_array_equal(basis.index(basis.centres), np.arange(basis.count))
        np.testing.assert_array_equal(basis.opposite[basis.opposite], np.arange(basis.count))
    # Patch 2 of the second ring: theta 10, phi 45 degrees.
    np.testing.assert_allclose(KLEMS_FULL.centres[2], direction(np.radians(10), np.radians(45)), atol=1e-15)
    edges = np.radians([14.99, 15.01])
    assert KLEMS_FULL.index(direction(edges, 0)).tolist() == [1, 9]
    around = KLEMS_FULL.index(direction(np.radians(10), np.radians([22.4, 22.6, 337.4, 337.6])))
    assert around.tolist() == [1, 2, 8, 1]


@pytest.mark.parametrize("basis", [*BUILT_IN, AngleBasis("", (0, 20, 50, 80), (3, 5, 7))])
def test_points_fill_their_patches_evenly(basis: AngleBasis) -> None:
    """Even in projected solid angle: the mean of cos^2 over a ring is the mean of its bounds."""
    patch, u = np.repeat(np.arange(basis.count), 64), np.tile(r2(64), (basis.count, 1))
    w = basis.points(patch, u)
    np.testing.assert_array_equal(basis.index(w), patch)
    squares = np.cos(np.radians(basis.edges_deg)) ** 2
    expected = np.repeat((squares[1:] + squares[:-1]) / 2, basis.n_phis)
    np.testing.assert_allclose((w[:, 2] ** 2).reshape(-1, 64).mean(axis=1), expected, atol=0.01)


def test_disk_map_is_its_own_inverse_and_keeps_areas() -> None:
    square = r2(4096)
    disk = disk_of(square)
    np.testing.assert_allclose(square_of(disk), square, atol=1e-12)
    for radius in (0.3, 0.6, 0.9):
        inside = np.hypot(*disk.T) < radius
        np.testing.assert_allclose(inside.mean(), radius**2, atol=2e-3)
    corners = disk_of(np.array([[1.0, 0.5], [1.0, 1.0], [0.5, 1.0], [0.5, 0.5]]))
    half = np.sqrt(0.5)
    np.testing.assert_allclose(corners, [[1, 0], [half, half], [0, 1], [0, 0]], atol=1e-12)


def test_tree_syntax_by_hand() -> None:
    """First coordinate: lowest bit of a branch, slowest of a grid."""
    tree = parse_tree(b"{ {1},{2} {3} {4} {5} {6} {7} {10,11 12 13 14 15 16 17} }", 3)
    places = np.array([[0.1, 0.1, 0.1], [0.6, 0.1, 0.1], [0.1, 0.6, 0.1], [0.1, 0.1, 0.6], [0.9, 0.6, 0.6]])
    value, side = tree.look_up(places)
    assert value.tolist() == [1, 2, 3, 5, 14] and side.tolist() == [0.5, 0.5, 0.5, 0.5, 0.25]
    assert tree.look_up(np.array([[0.6, 0.6, 0.9], [1.0, 1.0, 1.0]]))[0].tolist() == [11, 17]


@pytest.mark.parametrize("rank", [3, 4])
def test_walk_meets_every_leaf_once(rank) -> None:
    tree = parse_tree(
        f"{{{' '.join(random_tree(np.random.default_rng(0), rank, 2) for _ in range(1 << rank))}}}".encode(), rank
    )
    cells = tree.walk((), np.zeros((1, 0)))
    np.testing.assert_allclose((cells.side**rank).sum(), 1)
    value, side = tree.look_up(cells.middle)
    np.testing.assert_array_equal(value, cells.value)
    np.testing.assert_array_equal(side, cells.side)
    place = np.random.default_rng(1).random((7, rank))
    for fixed in ((0,), (0, 1), (rank - 2, rank - 1)):
        cells = tree.walk(fixed, place[:, list(fixed)])
        np.testing.assert_allclose(np.bincount(cells.query, cells.side ** (rank - len(fixed))), 1)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "no braces"),
        ("{ 1", "after the last"),
        ("{ {1} {2}", "not closed"),
        ("{ 1 } }", "too many"),
        ("{ 1 } { 2 }", "after the last"),
        ("{ 1 2 3 }", "power of 8"),
        ("{ {1} {2} }", "8 branches"),
        ("{" + "{1} " * 9 + "}", "more than 8"),
        ("{ 1 {2} }", "outside"),
        ("{" + "{1} " * 8 + "2 }", "beside"),
        ("{ x }", "not a number"),
        ("{" * 100000, "levels"),
    ],
)
def test_broken_trees(text: str, why: str) -> None:
    with pytest.raises(Malformed, match=why):
        parse_tree(text.encode(), 3)


def lambertian(structure: str, albedo: float, direction_: str = "Reflection Back") -> str:
    if structure.startswith("Tensor"):
        return lbnl_xml(structure, [("Visible", direction_, f"{{ {albedo / np.pi:.9g} }}")])
    return lbnl_xml(structure, [("Visible", direction_, words(np.full((145, 145), albedo / np.pi)))])


@pytest.mark.parametrize("structure", ["Columns", "TensorTree3", "TensorTree4"])
def test_lambertian_sheet(loaded: Loaded, structure: str) -> None:
    """A white wall of albedo .8 from all directions; its tuples integrate to that."""
    table = loaded(lambertian(structure, 0.8))
    wi = direction(np.radians([0, 20, 50, 85]), 1.0)
    np.testing.assert_allclose(table.reflectivity(wi), 0.8, rtol=1e-6)
    assert (table.transmissivity(wi) == 0).all() and not table.info.transmits
    assert table.info.isotropic == (structure != "TensorTree4")
    assert (table.eval(wi, wi * (1, 1, -1)) == 0).all() and (table.albedo(wi * (1, 1, -1)) == 0).all()
    np.testing.assert_allclose(table.eval(wi, wi), 0.8 / np.pi, rtol=1e-6)
    samples = table.samples()
    assert samples.left_out.total == samples.left_out.grazing and (samples.wi[:, 2] > 0).all()
    integral = (samples.weight * samples.p[:, 0]).sum() / (samples.weight * samples.wo[:, 2]).sum()
    np.testing.assert_allclose(integral, 0.8 / np.pi, rtol=1e-6)


def test_a_single_lit_patch(loaded: Loaded) -> None:
    """Light that comes from phi 225 travels towards phi 45: patch 2 of the incident basis. It leaves by patch 1."""
    values = np.zeros((145, 145))
    values[1, 2] = 4.0
    table = loaded(lbnl_xml("Columns", [("Visible", "Transmission Back", words(values))]))
    wi, wo = direction(np.radians(10), np.radians(225)), direction(np.radians(170), 0)
    assert table.eval(wi, wo) == 4 and table.eval(wo, wi) == 4 and table.eval(wi * (-1, -1, 1), wo) == 0
    projected = np.pi * (np.cos(np.radians(5)) ** 2 - np.cos(np.radians(15)) ** 2) / 8
    np.testing.assert_allclose(table.transmissivity(wi), 4 * projected)
    np.testing.assert_allclose(table.transmissivity(wo), 4 * projected)
    assert (table.reflectivity(wi) == 0).all()


def sums_by_direction(table: LbnlTable) -> tuple[Floats, Floats, Floats]:
    """Incident directions of the tuples, and the sums of their reflected and transmitted tuples."""
    samples = table.samples()
    wi, number = np.unique(samples.wi.round(9), axis=0, return_inverse=True)
    power = samples.weight * samples.p[:, 0]
    far = samples.transmitted
    return wi, np.bincount(number[~far], power[~far], len(wi)), np.bincount(number[far], power[far], len(wi))


@pytest.mark.long
@pytest.mark.parametrize("structure", ["Columns", "TensorTree3", "TensorTree4"])
@pytest.mark.parametrize("transmission", ["Front", "Back"])
def test_tuples_sum_to_the_albedos(loaded: Loaded, structure: str, transmission: str) -> None:
    """Front alone is reversed for the back."""
    random = np.random.default_rng(8)
    blocks = []
    for way in (f"Transmission {transmission}", "Reflection Back"):
        rank = int(structure[-1]) if structure.startswith("Tensor") else 0
        tree = "{" + " ".join(random_tree(random, rank, 1) for _ in range(1 << rank)) + "}" if rank else ""
        blocks.append(("Visible", way, tree or words(random.random((145, 145)) * 0.2)))
    table = loaded(lbnl_xml(structure, blocks))
    wi, r, t = sums_by_direction(table)
    keep = wi[:, 2] > 0.3
    tolerance = 0.06  # what a fit leaves out near the horizon is missing from the sums
    np.testing.assert_allclose(r[keep], table.reflectivity(wi)[keep, 0], rtol=tolerance)
    np.testing.assert_allclose(t[keep], table.transmissivity(wi)[keep, 0], rtol=tolerance)
    samples = table.samples(max_count=1000)
    assert len(samples) == 1000
    np.testing.assert_allclose(table.eval(samples.wi, samples.wo), samples.f, rtol=1e-9)


@pytest.mark.parametrize("backwards", [False, True])
def test_tuples_of_a_matrix_sum_to_its_hemispherical_values(backwards: bool) -> None:
    """Exact, including the horizon: nine pieces of a patch make up the patch."""
    random = np.random.default_rng(9)
    part = PatchMatrix(BUILT_IN[2], BUILT_IN[1], random.random((77, 41, 1)) * 0.2)
    entering, leaving, f, weight = part.tuples_reversed() if backwards else part.tuples()
    into = part.outgoing if backwards else part.incident
    number = into.index(entering * (-1, -1, 1) if backwards else entering)
    total = np.bincount(number, weight * f[:, 0] * leaving[:, 2])
    expected = part.hemispherical_reversed(into.centres) if backwards else part.hemispherical(into.centres)
    np.testing.assert_allclose(total, expected[:, 0], rtol=1e-12)
    back = np.array((-1, -1, 1))
    again = part.at(leaving * back, entering * back) if backwards else part.at(entering, leaving)
    np.testing.assert_array_equal(again, f)


def test_a_file_of_light_from_behind_is_turned_over_for_a_fit(loaded: Loaded) -> None:
    table = loaded(lambertian("Columns", 0.5, "Reflection Front"))
    assert (table.reflectivity(direction(0.3, 0)) == 0).all()
    np.testing.assert_allclose(table.reflectivity(direction(np.pi - 0.3, 0)), 0.5, rtol=1e-6)
    samples = table.samples()
    assert (samples.wi[:, 2] > 0).all() and (samples.wo[:, 2] > 0).all()
    np.testing.assert_allclose(samples.f, 0.5 / np.pi, rtol=1e-6)
    assert any("turned over" in note for note in table.info.notes)


def test_a_basis_of_the_file_replaces_the_builtin_of_that_name(loaded: Loaded) -> None:
    """The Klems half basis of older tools had 73 patches."""
    edges, counts = (0, 6.5, 19.5, 32.5, 46.5, 61.5, 76.5, 90), (1, 8, 12, 16, 20, 12, 4)
    rings = list(zip(edges, edges[1:], counts, strict=False))
    blocks = [("Visible", "Reflection Back", words(np.full((73, 73), 0.1)))]
    table = loaded(lbnl_xml("Columns", blocks, angle_basis("LBNL/Klems Half", rings), "LBNL/Klems Half"))
    np.testing.assert_allclose(table.reflectivity(direction(0.2, 0)), 0.1 * np.pi)
    assert any("Klems Half" in note for note in table.info.notes)


def test_anisotropy_of_matrices() -> None:
    """A function of theta_i, theta_o and phi_i - phi_o does not change when the sheet is turned; one of phi_i does."""
    i, o = KLEMS_FULL.centres[None, :], KLEMS_FULL.centres[:, None]
    isotropic = 0.1 + 0.1 * np.sum(i * o, axis=-1)
    assert PatchMatrix(KLEMS_FULL, KLEMS_FULL, isotropic[..., None]).anisotropy < 1e-12
    brushed = np.broadcast_to(0.2 + 0.1 * i[..., 0], isotropic.shape)
    assert PatchMatrix(KLEMS_FULL, KLEMS_FULL, brushed[..., None]).anisotropy > 0.05
