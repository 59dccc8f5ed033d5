"""OpenEXR pictures; decoding requires a header within the size limit and a file with every chunk.

OpenEXR reports damaged files on stderr and stdout; both are silenced while it reads.
"""

from __future__ import annotations

import errno
import os
import threading
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.arrays import Image
from lambent.core.ceilings import PIXELS, Ceiling
from lambent.core.colour import REC_709, from_primaries, xyz_to_rgb
from lambent.core.errors import UserError
from lambent.core.outputs import MARK

MAGIC = b"v/1\x01"
_STDERR = 2
_silencing = threading.Lock()


def decode(file: Path, ceiling: Ceiling = PIXELS) -> Image:
    """Linear Rec.709 RGB (H, W, 3) of the data window, from RGB of other primaries or from X, Y, Z as well.

    Luminance alone becomes grey. A picture in layers is that of its only layer with colour, or of the one that Blender
    calls `Combined`.

    Raises
    ------
    UserError
        If the file is damaged, truncated, deep or multi-part, larger than a `ceiling` of four channels, or has no
        colour, or several layers with colour.
    """
    with _opened(file, header_only=True) as exr:
        header = exr.header()
        (x0, y0), (x1, y1) = (corner.tolist() for corner in header["dataWindow"])
        height, width, channels = y1 - y0 + 1, x1 - x0 + 1, len(header["channels"])
        flat = len(exr.parts) == 1 and "deep" not in str(header["type"])
        chromaticities = header.get("chromaticities")  # the library empties the header when it closes
    if not flat:
        raise UserError("deep and multi-part EXR files are not supported", file=file, hint="save it as one flat part")
    said = f"{width} x {height}, {channels} channels"
    if not (height > 0 and width > 0):
        raise UserError("picture has no pixels", file=file, got=said)
    ceiling.check(height * width * max(4, channels) // 4, file=file, got=said)
    with _opened(file, separate_channels=True) as exr:
        planes = {name: np.asarray(channel.pixels) for name, channel in exr.channels().items()}
    names = _colour_channels(planes, file)
    if {planes[c].shape for c in names} != {(height, width)}:
        raise UserError("channels differ in size", file=file)
    image = np.empty((height, width, 3), np.float32)
    for channel, name in enumerate(names):
        image[..., channel] = planes[name]
    return _as_rec_709(image, names, chromaticities, file)


def _colour_channels(planes: Collection[str], file: Path) -> tuple[str, ...]:
    """Three names of channels that hold R, G, B, or X, Y, Z, or luminance three times."""
    for wanted in ("RGB", "XYZ", "YYY"):
        layers = [c.removesuffix(wanted[0]) for c in planes if c == wanted[0] or c.endswith(f".{wanted[0]}")]
        layers = [layer for layer in layers if all(layer + c in planes for c in wanted)]
        chosen = layers if len(layers) < 2 else [x for x in layers if x == ""] or [
            x for x in layers if x.endswith("Combined.")
        ]  # fmt: skip
        if len(chosen) == 1:
            return tuple(chosen[0] + c for c in wanted)
        if layers:
            raise UserError(
                "EXR has several layers with colour", file=file, got=", ".join(x.rstrip(".") for x in sorted(layers)),
                hint="save one of them as a flat picture",
            )  # fmt: skip
    expected = "R, G, B; X, Y, Z; or Y"
    raise UserError("EXR has no picture channels", file=file, got=", ".join(sorted(planes)), expected=expected)


def _as_rec_709(image: Image, names: Sequence[str], chromaticities: Sequence[float] | None, file: Path) -> Image:
    """Linear Rec.709 of the values (H, W, 3) of channels; `chromaticities` are the header's, of R, G, B and white."""
    if names[0].endswith("X"):
        return xyz_to_rgb(image)
    if chromaticities is None or names[0] == names[1] or np.allclose(chromaticities, REC_709, atol=2e-3):
        return image
    to_rgb = from_primaries(np.reshape(chromaticities, (4, 2)))
    if to_rgb is None:
        raise UserError("primaries span no colours", file=file, field="chromaticities", got=str(chromaticities))
    for row in image:
        row[:] = row @ to_rgb.T
    return image


def encode(image: Image, path: Path) -> None:
    """Write linear RGB (H, W, 3) as 32-bit float with lossless ZIP compression; raises OSError on failure."""
    import OpenEXR

    header: dict[str, Any] = {
        "compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, "comments": MARK,
    }  # fmt: skip
    try:
        OpenEXR.File(header, {"RGB": np.ascontiguousarray(image, np.float32)}).write(str(path))
    except RuntimeError as error:  # the library's only exception; its text ends with the system's message
        code = errno.ENOSPC if os.strerror(errno.ENOSPC) in str(error) else errno.EIO
        raise OSError(code, str(error).rsplit('". ', 1)[-1].rstrip("."), str(path)) from error


@contextmanager
def _opened(file: Path, **kind: bool) -> Iterator[Any]:
    """Open with OpenEXR; read pixels only if the file is complete, because OpenEXR allocates before it reads."""
    import OpenEXR

    damaged = UserError("EXR is damaged or cut off", file=file, hint="copy or download it again")
    try:
        with _silence():
            if not kind.get("header_only") and not OpenEXR.InputFile(str(file)).isComplete():
                raise damaged
            with OpenEXR.File(str(file), **kind) as exr:
                yield exr
    except (OSError, RuntimeError, ValueError, KeyError) as error:
        raise damaged from error


@contextmanager
def _silence() -> Iterator[None]:
    """Drop output to the file descriptor of stderr and to Python's stdout."""
    with _silencing, open(os.devnull, "w") as nowhere, redirect_stdout(nowhere):
        try:
            kept = os.dup(_STDERR)
        except OSError:  # a process without stderr
            yield
            return
        os.dup2(nowhere.fileno(), _STDERR)
        try:
            yield
        finally:
            os.dup2(kept, _STDERR)
            os.close(kept)
