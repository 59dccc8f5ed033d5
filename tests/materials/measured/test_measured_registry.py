"""Formats are recognised by content; unknown content and broken files give one clear line."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.inputs import UNREADABLE
from lambent.core.progress import silent
from lambent.materials.export.contract import writer_for
from lambent.materials.measured import load, registry
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.measured.registry import HEAD_BYTES, readers
from tests.materials.measured.measured_files import Loaded
from tests.materials.measured.sound_files import seeds


def test_protocol_holds_for_every_format(files: dict[str, Path], hemisphere) -> None:
    wi, wo = hemisphere(50, 1).reshape(5, 10, 3), hemisphere(50, 2).reshape(5, 10, 3)
    for path in files.values():
        table = load(path)
        f = table.eval(wi, wo)
        assert f.shape == (5, 10, table.info.channels) and np.isfinite(f).all() and (f >= 0).all()
        assert table.albedo(wi[0, :2]).shape == (2, table.info.channels)
        samples = table.samples()
        assert samples.f.shape == (len(samples), table.info.channels) and len(samples.weight) == len(samples)
        assert (samples.weight >= 0).all() and (samples.f >= 0).all()
        np.testing.assert_allclose(np.linalg.norm(samples.wi, axis=1), 1, rtol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(samples.wo, axis=1), 1, rtol=1e-9)
        few, again = table.samples(max_count=10), table.samples(max_count=10)
        assert len(few) == 10 and (few.wo == again.wo).all() and few.left_out == samples.left_out


@pytest.mark.parametrize("content", [b"", b"\0" * 100, b"hello world\n", b"\x89PNG\r\n\x1a\n" + b"\1" * 50, b"# x\n"])
def test_unknown_content(loaded: Loaded, content: bytes) -> None:
    with pytest.raises(UserError, match="empty" if not content else "known format.*MERL"):
        loaded(content, "what.bsdf")


def test_the_formats_are_listed_whole(loaded: Loaded) -> None:
    with pytest.raises(UserError) as found:
        loaded(b"hello world\n", "what.txt")
    assert str(found.value).endswith(readers()[-1].NAME) and all(r.NAME in str(found.value) for r in readers())


UNREAD = {
    "ALTA binary.*data2data": b"#DIM 3 1\n#PARAM_IN RUSIN_TH_TD_PD\n#FORMAT binary\n#BEGIN_STREAM\n\0\1\2\3\xff\n",
    "SPEOS.*export it as Zemax": b"OPTIS - brdf surface file v3.0\n0\nComment\n4\nabcd\n1 0\n",
    "SPEOS": b"OPTIS - Anisotropic BSDF surface file v7.0\r\n0\r\n",
    "SSDD.*DDR": b"VERSION 0.2\nSOFTWARE x\n\nDATA_TYPE brdf\nCOLOR_MODEL rgb\n",
    "MDL measured": b"NVIDIA ARC MBSDF V1\n\0\0\0\1",
    "VIAVI.*Zemax BSDF file.*name the columns": b"VIAVI Solutions\tEngineered Diffuser EDS-20\nAngle\tBTDF\n-30\t.1\n",
    "RPC Photonics": b"# RPC Photonics, Inc. \xb0 measured\r\nPart: EDC-10-G\r\n",
    "HDF5": b"\x89HDF\r\n\x1a\n\0\0",
    "ZIP archive.*unpack": b"PK\x03\x04\x14\0\0\0",
    "gzip archive.*unpack": b"\x1f\x8b\x08\0\0\0",
}


@pytest.mark.parametrize("said", UNREAD)
def test_known_files_that_are_not_read_say_what_they_are(tmp_path: Path, said: str) -> None:
    path = tmp_path / "vendor.dat"
    path.write_bytes(UNREAD[said])
    assert not registry.is_known(path)
    with pytest.raises(UserError, match=f"is .*{said}"):
        load(path)


def test_the_page_has_a_row_for_every_reader() -> None:
    page = (Path(__file__).parents[3] / "docs" / "formats.md").read_text(encoding="utf-8")
    rows = [line.split("|")[1].split() for line in page.split("\n") if line.startswith("| ")]
    for reader in readers():
        assert any(row and row[0] == reader.NAME.split()[0] for row in rows), reader.NAME


@pytest.mark.parametrize("reader", seeds())
def test_the_first_claim_is_the_format_s_own(reader: str) -> None:
    for content in SOUND[reader]:
        assert next(r.NAME for r in readers() if r.recognise(content[:HEAD_BYTES], len(content))) == reader


def test_missing_file_and_folder(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="cannot be read"):
        load(tmp_path / "nothing.binary")
    with pytest.raises(UserError, match="cannot be read"):
        load(tmp_path)


class Failing:
    """A reader that raises over every file, while recognising it or while reading it."""

    NAME = "made-up format"

    def __init__(self, error: Exception, recognising: bool) -> None:
        self.error, self.recognising = error, recognising

    def recognise(self, head: bytes, size: int) -> bool:
        if self.recognising:
            raise self.error
        return True

    def read(self, path: Path) -> MeasuredTable:
        raise self.error


@pytest.mark.parametrize("recognising", [True, False])
@pytest.mark.parametrize(
    "error",
    [
        OverflowError("cannot convert float infinity to integer"),
        ValueError("Exceeds the limit (4300 digits) for integer string conversion\n" + "9" * 5000),
        UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte"),
        LookupError("unknown encoding: no-such-code"),
        MemoryError(),
        RecursionError("maximum recursion depth exceeded"),
        ZeroDivisionError("division by zero"),
        AssertionError(),
    ],
    ids=lambda error: type(error).__name__,
)
def test_whatever_a_reader_raises_is_one_line(monkeypatch, tmp_path: Path, error: Exception, recognising: bool) -> None:
    monkeypatch.setattr(registry, "readers", lambda: (Failing(error, recognising),))
    (tmp_path / "a.bsdf").write_bytes(b"foreign")
    with pytest.raises(
        UserError, match=rf"a\.bsdf: cannot be read as made-up format \({type(error).__name__}"
    ) as found:
        load(tmp_path / "a.bsdf")
    assert found.value.__cause__ is error and "\n" not in str(found.value) and len(str(found.value)) < 400
    if recognising:
        with pytest.raises(UserError, match="made-up format"):
            registry.is_known(tmp_path / "a.bsdf")


def test_a_reader_that_fails_to_tell_does_not_hide_another(monkeypatch, files: dict[str, Path]) -> None:
    every = registry.readers()
    monkeypatch.setattr(registry, "readers", lambda: (Failing(OverflowError(), True), *every))
    assert load(files["merl"]).info.format.startswith("MERL") and registry.is_known(files["merl"])


SOUND = seeds()
DIGITS = b"9" * 5000


@pytest.mark.parametrize(
    "content",
    [b"inf 400 500 600\n", b"inf\n", b"-inf 1 2\n", b"nan 400\n", DIGITS, b"3 500 400 600\n"],
)
def test_numbers_that_no_reader_claims(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.txt").write_bytes(content)
    assert not registry.is_known(tmp_path / "a.txt")
    with pytest.raises(UserError, match="known format"):
        load(tmp_path / "a.txt")


@pytest.mark.long
def test_names_that_utf_8_cannot_hold_are_written_as_escapes(tmp_path: Path) -> None:
    """A file system's name of any bytes reaches Python with lone surrogates in it."""
    path = tmp_path / os.fsdecode(b"m\xe4\xdfig.bsdf")
    try:
        path.write_bytes(SOUND["Zemax BSDF text"][0])
    except OSError:
        pytest.skip("this file system takes UTF-8 names alone")
    out = tmp_path / "out"
    writer_for(out, "rgl").write(load(path), out, silent)
    assert load(out).info.channels


WI, WO = np.array([[0.6, 0.0, 0.8]]), np.array([[-0.6, 0.0, 0.8]])


@pytest.fixture(scope="module")
def target(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where broken files are written."""
    return tmp_path_factory.mktemp("broken") / "broken.bsdf"


def attempt(path: Path, content: bytes) -> None:
    """Load and use a broken file; it is a table or a `UserError` of one line, which its reader raises itself."""
    path.write_bytes(content)
    try:
        table = load(path)
        assert np.isfinite(table.eval(WI, WO)).all() and np.isfinite(table.samples(1000).f).all()
    except UserError as error:
        assert "\n" not in str(error) and UNREADABLE not in str(error), str(error)


def test_headers_that_promise_too_much(files: dict[str, Path], target: Path) -> None:
    """Dimensions of 2^31 and 2^63 values must be refused by arithmetic, before anything is allocated."""
    attempt(target, np.full(3, 2**31 - 1, "<i4").tobytes() + bytes(1000))
    rgl = bytearray(files["rgl"].read_bytes())
    for at in range(14, 400, 7):
        attempt(target, bytes(rgl[:at] + b"\xff" * 8 + rgl[at + 8 :]))
    at = rgl.index(b"ndf") + 3 + 11
    attempt(target, bytes(rgl[:at] + b"\0" * 8 + b"\xff" * 7 + b"\x7f" + rgl[at + 16 :]))  # nothing, times very much
    attempt(target, b"1000000000\n400 500 600\n" + b"0 " * 100)
    attempt(target, b"1e308 400 500 600 " + b"0 " * 100)
    attempt(target, b"theta_i phi_i theta_o phi_o p\n" + b"0 " * 100000 + b"\n")


@pytest.mark.parametrize("kind", ["cornell", "gonio"])
@pytest.mark.parametrize("ending", [b"\n", b"\r\n", b"\r"])
@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"])
def test_line_ends_and_byte_order_marks_change_nothing(
    files: dict[str, Path], target: Path, kind: str, ending: bytes, mark: bytes
) -> None:
    plain = files[kind].read_bytes()
    target.write_bytes(mark + plain.replace(b"\n", ending))
    assert np.array_equal(load(target).eval(WI, WO), load(files[kind]).eval(WI, WO))
