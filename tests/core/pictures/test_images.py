"""Pictures survive the round trip; damaged ones end in one clear error and never in a large allocation."""

from __future__ import annotations

import struct
import tracemalloc
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lambent.core.errors import UserError
from lambent.core.light import colour
from lambent.core.pictures import exr, rgbe
from lambent.core.pictures.images import check_writable, read_image, write_image

RNG = np.random.default_rng(7)
PICTURE = (RNG.random((20, 37, 3)) ** 4 * 50).astype(np.float32)


def test_exr_keeps_every_bit(tmp_path: Path) -> None:
    write_image(tmp_path / "a.exr", PICTURE)
    np.testing.assert_array_equal(read_image(tmp_path / "a.exr"), PICTURE)


def test_rgbe_known_pixels() -> None:
    """(128, 64, 32, 129) is 128 2^-7, 64 2^-7, 32 2^-7; exponent 0 is black."""
    data = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" + bytes([128, 64, 32, 129, 9, 9, 9, 0])
    np.testing.assert_array_equal(rgbe.decode(data, Path("x")), [[[1, 0.5, 0.25], [0, 0, 0]]])


def test_rgbe_run_lengths_new_and_old() -> None:
    """A row of 8: red in one run, green in a literal, blue and exponent in runs. And the scheme before 1991."""
    row = bytes([2, 2, 0, 8, 136, 128, 8, *range(128, 136), 136, 0, 136, 129])
    image = rgbe.decode(b"#?RADIANCE\n\n-Y 1 +X 8\n" + row, Path("x"))
    np.testing.assert_array_equal(image[0, :, 0], np.ones(8))
    np.testing.assert_array_equal(image[0, :, 1], np.arange(128, 136) / 128)
    old = bytes([128, 0, 0, 129, 1, 1, 1, 3])
    image = rgbe.decode(b"#?RADIANCE\n\n-Y 2 +X 2\n" + old, Path("x"))
    np.testing.assert_array_equal(image[..., 0], np.ones((2, 2)))
    digits = bytes([128, 0, 0, 129, 1, 1, 1, 3, 1, 1, 1, 1, 64, 0, 0, 129])  # 3 + 256 more of the first
    image = rgbe.decode(b"#?RADIANCE\n\n-Y 1 +X 261\n" + digits, Path("x"))
    np.testing.assert_array_equal(image[0, :, 0], [*np.ones(260), 0.5])


def test_rgbe_rows_from_below_and_exposure() -> None:
    data = b"#?RADIANCE\nEXPOSURE=2\n\n+Y 2 +X 1\n" + bytes([128, 0, 0, 129, 0, 128, 0, 129])
    np.testing.assert_array_equal(rgbe.decode(data, Path("x")), [[[0, 0.5, 0]], [[0.5, 0, 0]]])
    columns = b"#?RADIANCE\n\n{}X 2 {}Y 3\n" + b"".join(bytes([n, 0, 0, 136]) for n in (1, 2, 3, 4, 5, 6))
    for x, y in (("+", "-"), ("+", "+"), ("-", "-"), ("-", "+")):  # a scanline is a column
        turned = rgbe.decode(columns.replace(b"{}X", f"{x}X".encode()).replace(b"{}Y", f"{y}Y".encode()), Path("x"))
        assert turned[:: 1 if y == "-" else -1, :: 1 if x == "+" else -1, 0].tolist() == [[1, 4], [2, 5], [3, 6]]
    from_the_right = data.replace(b"EXPOSURE=2\n", b"").replace(b"+Y 2 +X 1", b"-Y 1 -X 2")
    np.testing.assert_array_equal(rgbe.decode(from_the_right, Path("x")), [[[0, 1, 0], [1, 0, 0]]])


def test_rgbe_of_xyz_becomes_rgb() -> None:
    """An even spectrum, X = Y = Z, is warmer than white under D65; Y stays the luminance."""
    data = b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n" + bytes([128, 128, 128, 129])
    (r, g, b) = rgbe.decode(data, Path("x"))[0, 0]
    assert r > 1.1 > 1 > g > b and 0.2126 * r + 0.7152 * g + 0.0722 * b == pytest.approx(1, abs=1e-3)


def _refused(path: Path) -> str:
    with pytest.raises(UserError) as caught:
        read_image(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("suffix", [".exr", ".hdr", ".png"])
def test_every_truncation_is_refused(tmp_path: Path, suffix: str, capfd: pytest.CaptureFixture[str]) -> None:
    whole = tmp_path / f"whole{suffix}"
    write_image(whole, PICTURE)
    data, cut = whole.read_bytes(), tmp_path / f"cut{suffix}"
    # A PNG may lose its end marker (12 bytes) and checksum and still hold every pixel.
    for length in np.unique(np.linspace(0, len(data) - (1 if suffix != ".png" else 40), 24).astype(int)):
        cut.write_bytes(data[:length])
        _refused(cut)
    assert capfd.readouterr() == ("", "")


@settings(max_examples=30)
@given(at=st.integers(0, 400), value=st.integers(0, 255), suffix=st.sampled_from([".exr", ".hdr", ".png"]))
def test_a_wrong_byte_is_read_or_refused(tmp_path: Path, at: int, value: int, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    write_image(path, PICTURE)
    data = bytearray(path.read_bytes())
    data[at] = value
    path.write_bytes(data)
    try:
        assert np.isfinite(read_image(path)).all()
    except UserError as error:
        assert "\n" not in str(error)


def _png_header(width: int, height: int) -> bytes:
    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")


def _exr_with_window(width: int, height: int, path: Path) -> bytes:
    write_image(path, PICTURE)
    data = bytearray(path.read_bytes())
    at = data.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    data[at : at + 16] = struct.pack("<4i", 0, 0, width - 1, height - 1)
    return bytes(data)


def test_absurd_headers_cost_no_memory(tmp_path: Path) -> None:
    path = tmp_path / "huge"
    huge = [
        b"#?RADIANCE\n\n-Y 999999999 +X 999999999\n" + bytes(64),
        b"#?RADIANCE\n\n-Y 8000 +X 8000\n" + bytes(64),
        b"#?RADIANCE\n\n-Y 8000 +X 8000\n\x02\x02\x1f\x40" + bytes(64),
        _png_header(2_000_000_000, 2_000_000_000),
        _png_header(20_000, 20_000),
        _exr_with_window(2_000_000_000, 2_000_000_000, tmp_path / "a.exr"),
        _exr_with_window(8000, 8000, tmp_path / "a.exr"),
        _exr_with_window(-5, 10, tmp_path / "a.exr"),
    ]
    tracemalloc.start()
    for data in huge:
        path.write_bytes(data)
        _refused(path)
    assert tracemalloc.get_traced_memory()[1] < 10 << 20
    tracemalloc.stop()


def test_not_finite_and_not_a_picture(tmp_path: Path) -> None:
    bad = PICTURE.copy()
    bad[3, 4, 1] = np.nan
    write_image(tmp_path / "nan.exr", bad)
    assert "1 of 2220 values" in _refused(tmp_path / "nan.exr")
    (tmp_path / "text.exr").write_text("hello")
    assert "expected EXR, HDR, PNG or JPEG" in _refused(tmp_path / "text.exr")
    assert "cannot be read" in _refused(tmp_path / "absent.exr")
    assert "cannot be read" in _refused(tmp_path)


def _exr_of(path: Path, kind: int, **channels: Any) -> Path:
    OpenEXR.File({"compression": kind, "type": OpenEXR.scanlineimage}, channels).write(str(path))
    return path


def test_exr_of_every_compression_and_of_luminance_alone(tmp_path: Path) -> None:
    grey = np.repeat(PICTURE[..., :1], 3, axis=-1)
    np.testing.assert_array_equal(
        read_image(_exr_of(tmp_path / "y.exr", OpenEXR.RLE_COMPRESSION, Y=PICTURE[..., 0].copy())), grey
    )
    for kind in (OpenEXR.NO_COMPRESSION, OpenEXR.PIZ_COMPRESSION, OpenEXR.HTJ2K32_COMPRESSION):
        half = PICTURE.astype(np.float16)
        np.testing.assert_array_equal(read_image(_exr_of(tmp_path / f"{int(kind)}.exr", kind, RGB=half)), half)


def test_exr_files_that_are_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """No colour, a limit on all parts: told from the header, and the library prints nothing of its own."""
    parts = [OpenEXR.Part({"type": OpenEXR.scanlineimage}, {"RGB": PICTURE.copy()}, name=n) for n in "abcd"]
    OpenEXR.File(parts).write(str(tmp_path / "parts.exr"))
    with pytest.raises(UserError, match="at most 1480 pixels"):
        exr.decode(tmp_path / "parts.exr", replace(exr.PIXELS, most=20 * 37 * 2))
    assert "found Z" in _refused(_exr_of(tmp_path / "z.exr", OpenEXR.ZIP_COMPRESSION, Z=PICTURE[..., 0].copy()))
    monkeypatch.setattr(exr, "PIXELS", replace(exr.PIXELS, most=20 * 37 - 1))
    with pytest.raises(UserError, match="found 37 x 20, 1 channels; expected at most 739 pixels"):
        exr.decode(tmp_path / "z.exr", exr.PIXELS)
    assert capfd.readouterr() == ("", "")


def test_a_place_is_tried_before_long_work(tmp_path: Path) -> None:
    check_writable(tmp_path / "new/folder/a.png")
    assert not list(tmp_path.iterdir())
    (tmp_path / "file").write_text("")
    (tmp_path / "folder.png").mkdir()
    for place, word in (("file/a.png", "cannot be written"), ("folder.png", "is a folder")):
        with pytest.raises(UserError, match=word):
            check_writable(tmp_path / place)


ACES = (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767)  # AP1: red, green, blue, white


def test_exr_of_other_primaries_becomes_rec_709(tmp_path: Path) -> None:
    """ACEScg's white becomes white; its red lies outside Rec.709, with published coordinates."""
    path = tmp_path / "a.exr"

    def write(*chromaticities: float) -> None:
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "chromaticities": chromaticities}
        OpenEXR.File(header, {"RGB": np.float32([[[1, 1, 1], [1, 0, 0], [0, 1, 0]]])}).write(str(path))

    write(*ACES)
    expected = [[1, 1, 1], [1.7051, -0.1302, -0.0240], [-0.6218, 1.1408, -0.1290]]
    np.testing.assert_allclose(read_image(path)[0], expected, atol=2e-3)
    write(*(0.3, 0.3) * 4)
    assert "chromaticities: primaries span no colours" in _refused(path)


def test_exr_in_layers_and_in_xyz(tmp_path: Path) -> None:
    """A layer alone, Blender's combined one among others, and XYZ; two equal layers are a question for the user."""
    r, g, b = (PICTURE[..., c].copy() for c in range(3))
    zip_of = OpenEXR.ZIP_COMPRESSION

    def layer(name: str, shade: float = 1.0) -> dict[str, Any]:
        return {f"{name}.R": r * np.float32(shade), f"{name}.G": g, f"{name}.B": b}

    for channels in (
        layer("sky"),
        {**layer("v.Combined"), **layer("v.Diffuse", 2)},
        {"R": r, "G": g, "B": b, **layer("x", 3)},
    ):
        np.testing.assert_array_equal(read_image(_exr_of(tmp_path / "a.exr", zip_of, **channels)), PICTURE)
    found = _refused(_exr_of(tmp_path / "a.exr", zip_of, **layer("sky"), **layer("v")))
    assert "several layers with colour; found sky, v; save one of them" in found
    x, y, z = np.moveaxis(colour.rgb_to_xyz(PICTURE), -1, 0)
    stored = _exr_of(tmp_path / "a.exr", zip_of, X=x.copy(), Y=y.copy(), Z=z.copy())
    np.testing.assert_allclose(read_image(stored), PICTURE, rtol=1e-4, atol=1e-3)
    assert "found G, R; expected R, G, B" in _refused(_exr_of(tmp_path / "a.exr", zip_of, R=r, G=g))
