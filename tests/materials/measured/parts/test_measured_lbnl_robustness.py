"""Hostile BSDF files: one line, in time, with memory in proportion."""

from __future__ import annotations

import re
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.materials.measured import load
from lambent.materials.measured.lbnl_xml import NAME
from lambent.materials.measured.registry import HEAD_BYTES, readers
from tests.materials.measured.lbnl_files import angle_basis, lbnl_xml, words

FIXED_BYTES = 8 << 20
HANGS_S = 10.0  # far beyond what any of these takes on a busy machine
WI, WO = np.array([[0.6, 0.0, 0.8]]), np.array([[-0.6, 0.0, 0.8]])


def sound() -> bytes:
    """A matrix on a basis of its own."""
    random = np.random.default_rng(0)
    basis = angle_basis("mine", [(0, 30, 1), (30, 60, 4), (60, 90, 4)])
    blocks = [("Visible", d, words(random.random((9, 9)) * 0.3)) for d in ("Reflection Back", "Transmission Front")]
    return lbnl_xml("Columns", blocks, basis, "mine").encode()


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
    path.write_bytes(sound())
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
    content = change(sound().decode())
    assert content != sound().decode()
    said = attempt(target, content.encode())
    assert re.search(expected, said), said


@pytest.mark.parametrize(
    "content",
    [
        sound().replace(b"nobody", b"caf\xe9"),
        sound().decode().replace("UTF-8", "UTF-16").encode("utf-16"),
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
    plain = sound().decode()
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
    plain = sound().decode()
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
    plain = sound()
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
    assert attempt(target, lines + sound())


def test_a_document_type_after_the_lines_is_refused(target: Path) -> None:
    hidden = sound().replace(b"<WindowElement ", b"<!DOCTYPE a><WindowElement ", 1)
    assert "document type" in attempt(target, RECOVER + hidden)
