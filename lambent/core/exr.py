"""OpenEXR pictures. The header is checked here before the library sees the file.

The library allocates what the header says, and prints its own warnings on damaged files; both are avoided by reading
the header (openexr.com, "OpenEXR file layout") and the chunk table first.
"""

from __future__ import annotations

import errno
import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.errors import UserError

Image = NDArray[np.float32]
MAGIC = b"v/1\x01"
_TILED, _DEEP, _MULTIPART = 0x200, 0x800, 0x1000
_ROWS_PER_CHUNK = {0: 1, 1: 1, 2: 1, 3: 16, 4: 32, 5: 16, 6: 32, 7: 32, 8: 32, 9: 256}  # by compression


@dataclass(frozen=True)
class _Header:
    attributes: dict[str, bytes]
    end: int
    flags: int

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) of the data window."""
        x0, y0, x1, y1 = struct.unpack("<4i", self.attributes["dataWindow"])
        return y1 - y0 + 1, x1 - x0 + 1

    @property
    def channels(self) -> int:
        # Each entry: name, 0, pixel type (4), linear flag and padding (4), two sampling rates (8).
        value, count, at = self.attributes["channels"], 0, 0
        while at < len(value) and value[at] != 0:
            at, count = value.index(b"\0", at) + 17, count + 1
        return count


def decode(data: bytes, file: Path, max_pixels: int) -> Image:
    """Linear RGB (H, W, 3) of the data window; a picture of luminance alone becomes grey. `file` is read again."""
    try:
        header = _header(data)
        height, width = header.size
        channels = header.channels
        if header.flags & (_DEEP | _MULTIPART):
            raise UserError("deep and multi-part EXR files are not read", file=file, hint="save it as one flat part")
        if not (height > 0 and width > 0 and height * width * max(1, channels / 4) <= max_pixels):
            got = f"{width}x{height}, {channels} channels"
            raise UserError("picture size", file=file, got=got, expected=f"at most {max_pixels} pixels of RGBA")
        _check_chunks(data, header, file)
    except (struct.error, KeyError, ValueError, IndexError) as error:
        raise UserError(f"EXR header is damaged or cut off ({error})", file=file) from error
    return _pixels(file)


def encode(image: Image, path: Path) -> None:
    """Write linear RGB (H, W, 3) as 32-bit float, ZIP compressed (without loss); OSError where that cannot be."""
    import OpenEXR

    header: dict[str, Any] = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    try:
        OpenEXR.File(header, {"RGB": np.ascontiguousarray(image, np.float32)}).write(str(path))
    except RuntimeError as error:  # the library's only kind: its text ends with what the system says
        full = os.strerror(errno.ENOSPC) in str(error)
        raise OSError(
            errno.ENOSPC if full else errno.EIO, str(error).rsplit('". ', 1)[-1].rstrip("."), str(path)
        ) from error


def _header(data: bytes) -> _Header:
    flags = struct.unpack_from("<I", data, 4)[0]
    attributes: dict[str, bytes] = {}
    at = 8
    while data[at] != 0:
        name_end = data.index(b"\0", at, at + 256)
        type_end = data.index(b"\0", name_end + 1, name_end + 257)
        size = struct.unpack_from("<I", data, type_end + 1)[0]
        value = data[type_end + 5 : type_end + 5 + size]
        if len(value) < size:
            raise ValueError("attribute is cut off")
        attributes[data[at:name_end].decode("latin-1")] = value
        at = type_end + 5 + size
    return _Header(attributes, at + 1, flags)


def _check_chunks(data: bytes, header: _Header, file: Path) -> None:
    """Every chunk the table names lies within the file; a bound on the table stops absurd pictures early."""
    for offset in _offsets(data, header):
        front = 20 if header.flags & _TILED else 8
        # An offset of 0 is a chunk that was never written.
        if offset < header.end or offset + front > len(data):
            break
        packed = struct.unpack_from("<i", data, offset + front - 4)[0]
        if packed < 0 or offset + front + packed > len(data):
            break
    else:
        return
    raise UserError("file is truncated", file=file, got=f"{len(data)} bytes", hint="copy or download it again")


def _offsets(data: bytes, header: _Header) -> Iterator[int]:
    height, width = header.size
    if header.flags & _TILED:
        tile_width, tile_height, _ = struct.unpack("<IIB", header.attributes["tiles"])
        # The full-size level comes first, so its share of the table is enough whatever the level mode is.
        count = -(-width // max(1, tile_width)) * -(-height // max(1, tile_height))
    else:
        count = -(-height // _ROWS_PER_CHUNK[header.attributes["compression"][0]])
    if header.end + 8 * count > len(data):
        raise ValueError("chunk table is cut off")
    yield from struct.unpack_from(f"<{count}Q", data, header.end)


def _pixels(file: Path) -> Image:
    import OpenEXR

    try:
        with OpenEXR.File(str(file), separate_channels=True) as exr:
            planes = {name: np.asarray(channel.pixels) for name, channel in exr.channels().items()}
    except (RuntimeError, ValueError) as error:
        raise UserError(f"EXR data is damaged ({error})", file=file) from error
    names = "RGB" if all(c in planes for c in "RGB") else "YYY"
    if names[0] not in planes:
        raise UserError("no picture in the EXR", file=file, got=", ".join(sorted(planes)), expected="R, G, B or Y")
    if len({planes[c].shape for c in names}) > 1:
        raise UserError("channels differ in size", file=file)
    return np.stack([planes[c] for c in names], axis=-1).astype(np.float32)
