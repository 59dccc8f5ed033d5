"""Radiance pictures (.hdr): shared-exponent RGB, flat or run-length encoded.

Source: G. Ward, "Real pixels", Graphics Gems II (1991), and Radiance's file format notes. A pixel (m, e) stands for
m 2^(e - 136); rows run from the top unless the resolution line says otherwise.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Image
from lambent.core.ceilings import PIXELS, Ceiling
from lambent.core.errors import UserError
from lambent.core.light.colour import xyz_to_rgb
from lambent.core.outputs import MARK
from lambent.core.plain import is_number

MAGICS = (b"#?RADIANCE", b"#?RGBE")
PRIMARIES = ".64 .33 .30 .60 .15 .06 .3127 .3290"  # x and y of red, green, blue and white of Rec.709
_RESOLUTION = re.compile(rb"([-+])([XY]) (\d{1,9}) ([-+])([XY]) (\d{1,9})\r?\n")
_HEADER_END = re.compile(rb"\n\r?\n")
_HEADER_MAX = 1 << 16
FORWARD = {b"Y": b"-", b"X": b"+"}  # signs for rows from the top and columns from the left
_MIN_RUN_WIDTH, _MAX_RUN_WIDTH = 8, 0x7FFF  # other widths are never run-length encoded per channel


def decode(data: bytes, file: Path, ceiling: Ceiling = PIXELS) -> Image:
    """Linear RGB (H, W, 3) of a whole file's bytes, within a `ceiling` of pixels; errors name `file`."""
    header_end = _HEADER_END.search(data, 0, _HEADER_MAX)
    match = None if header_end is None else _RESOLUTION.match(data, header_end.end())
    if header_end is None or match is None or match[2] == match[5]:
        raise UserError("Radiance header has no '-Y height +X width' line", file=file)
    height, width = int(match[3]), int(match[6])  # of scanlines, which are columns if X comes first
    ceiling.check(width * height, file=file, got=f"{width} x {height}")
    if width * height == 0:
        raise UserError("picture has no pixels", file=file, got=f"{width} x {height}")
    header = data[: header_end.start()]
    pixels = _pixels(data, match.end(), height, width, file)
    image = np.empty((height, width, 3), np.float32)
    for row, into in zip(pixels, image, strict=True):  # row by row: float64 of a whole picture takes twice its memory
        scale = np.ldexp(1.0, row[:, 3].astype(np.int32) - 136) * (row[:, 3] > 0)
        into[:] = row[:, :3] * scale[:, None]
    for exposure in re.findall(r"^EXPOSURE=\s*([-+.\deE]+)\s*$", header.decode("latin-1"), re.MULTILINE):
        if not (is_number(exposure) and 0 < float(exposure) < float("inf")):
            raise UserError("not a positive number", file=file, field="EXPOSURE", got=exposure)
        image /= float(exposure)
    if b"32-bit_rle_xyze" in header:
        image = xyz_to_rgb(image).astype(np.float32)
    steps = {match[2]: 1 if match[1] == FORWARD[match[2]] else -1, match[5]: 1 if match[4] == FORWARD[match[5]] else -1}
    upright = image if match[2] == b"Y" else image.transpose(1, 0, 2)
    return np.ascontiguousarray(upright[:: steps[b"Y"], :: steps[b"X"]])


def header_lines(data: bytes) -> list[str]:
    """Header lines of a picture's bytes; empty if the header does not end."""
    end = _HEADER_END.search(data, 0, _HEADER_MAX)
    return [] if end is None else data[: end.start()].decode("latin-1").splitlines()


def encode(image: Image, view: str | None = None) -> bytes:
    """Bytes of a flat (not run-length encoded) file of linear RGB (H, W, 3); negative values become 0.

    `view` holds Radiance's view options. Values are W/(sr m^2) unscaled, so EXPOSURE is 1. The primaries are Rec.709's,
    which other programs assume for every .hdr, but Radiance does not.
    """
    rgb = np.maximum(image, 0)
    _, exponent = np.frexp(rgb.max(axis=-1))
    mantissa = np.minimum(np.rint(np.ldexp(rgb, 8 - exponent[..., None])), 255)
    exponent = np.clip(np.where(rgb.max(axis=-1) > 0, exponent + 128, 0), 0, 255)
    pixels = np.concatenate([mantissa, exponent[..., None]], axis=-1).astype(np.uint8)
    height, width = image.shape[:2]
    seen = f"VIEW= {view}\n" if view else ""
    about = f"SOFTWARE={MARK}\n{seen}EXPOSURE=1\nPRIMARIES= {PRIMARIES}\n"
    header = f"#?RADIANCE\n{about}FORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n"
    return header.encode("ascii") + pixels.tobytes()


def _pixels(data: bytes, at: int, height: int, width: int, file: Path) -> NDArray[np.uint8]:
    """(H, W, 4) bytes; checks sizes against the file before allocating."""
    truncated = UserError("file is truncated", file=file, got=f"{len(data)} bytes", hint="copy or download it again")
    marked = data[at : at + 2] == b"\x02\x02" and data[at + 2 : at + 3] < b"\x80"
    run_length = marked and _MIN_RUN_WIDTH <= width <= _MAX_RUN_WIDTH
    # A run takes 2 bytes and covers at most 127: a shorter file cannot hold the picture.
    if run_length and len(data) - at < height * (4 + 4 * 2 * -(-width // 127)):
        raise truncated
    if not run_length and b"\x01\x01\x01" not in data[at:]:  # flat
        if len(data) - at < height * width * 4:
            raise truncated
        return np.frombuffer(data, np.uint8, height * width * 4, at).reshape(height, width, 4)
    try:
        if run_length:
            return _run_length(data, at, height, width)
        return _old_run_length(data, at, height * width).reshape(height, width, 4)
    except IndexError:
        raise truncated from None
    except ValueError as error:
        raise UserError(f"run-length data is damaged ({error})", file=file) from error


def _run_length(data: bytes, at: int, height: int, width: int) -> NDArray[np.uint8]:
    rows = np.empty((height, 4, width), np.uint8)
    for row in rows:
        if data[at : at + 2] != b"\x02\x02" or (data[at + 2] << 8 | data[at + 3]) != width:
            raise ValueError("row does not begin with its width")
        at += 4
        for channel in row:
            column = 0
            while column < width:
                count = data[at]
                run = count > 128
                count = count - 128 if run else count
                end = column + count
                if count == 0 or end > width:
                    raise ValueError("run leaves its row")
                if run:
                    channel[column:end] = data[at + 1]
                    at += 2
                else:
                    if at + 1 + count > len(data):
                        raise IndexError
                    channel[column:end] = np.frombuffer(data, np.uint8, count, at + 1)
                    at += 1 + count
                column = end
    return rows.transpose(0, 2, 1)


def _old_run_length(data: bytes, at: int, count: int) -> NDArray[np.uint8]:
    """The scheme before 1991: a pixel (1, 1, 1, n) repeats the last one n times; consecutive ones are digits of n."""
    pixels = np.empty((count, 4), np.uint8)
    done, digit = 0, 0
    while done < count:
        if at + 4 > len(data):
            raise IndexError
        if data[at : at + 3] == b"\x01\x01\x01":
            repeat = data[at + 3] << (8 * digit)
            if done == 0 or done + repeat > count:
                raise ValueError("run leaves the picture")
            pixels[done : done + repeat] = pixels[done - 1]
            done, digit = done + repeat, digit + 1
        else:
            pixels[done] = np.frombuffer(data, np.uint8, 4, at)
            done, digit = done + 1, 0
        at += 4
    return pixels
