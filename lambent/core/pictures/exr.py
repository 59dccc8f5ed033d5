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
from lambent.core.errors import UserError
from lambent.core.light.colour import REC_709, from_primaries, xyz_to_rgb
from lambent.core.outputs import MARK

MAGIC = b"v/1\x01"
_STDERR = 2
_silencing = threading.Lock()


def decode(file: Path, ceiling: Ceiling = PIXELS) -> Image:
    """Linear Rec.709 RGB (H, W, 3) of the data window, from RGB of other primaries or from X, Y, Z as well.

    Luminance alone becomes grey. A picture in layers is that of its only layer with colour, or of the one that Blender
    calls `Combined`; a picture in parts that of the first part with colour.

    Raises
    ------
    UserError
        If the file is damaged, truncated or deep, larger than a `ceiling` of four channels, or has no colour, or
        several layers with colour.
    """
    with _opened(file, header_only=True) as exr:
        headers = [exr.header(number) for number in range(len(exr.parts))]
        channels = [[channel.name for channel in header["channels"]] for header in headers]
        number = next((n for n, names in enumerate(channels) if _layers(names)[1]), 0)
        sizes = [np.ptp(header["dataWindow"], axis=0) + 1 for header in headers]
        (width, height), chosen = sizes[number].tolist(), headers[number]
        flat = not any("deep" in str(header["type"]) for header in headers)
        chromaticities = chosen.get("chromaticities")  # the library empties the header when it closes
    if not flat:
        raise UserError("deep EXR files are not supported", file=file, hint="save it as a flat picture")
    said = f"{width} x {height}, {len(channels[number])} channels"
    if not (height > 0 and width > 0):
        raise UserError("picture has no pixels", file=file, got=said)
    values = [int(w) * int(h) * len(names) for (w, h), names in zip(sizes, channels, strict=True)]
    ceiling.check(max(height * width, sum(values) // 4), file=file, got=said)  # the library decodes all parts
    with _opened(file, separate_channels=True) as exr:
        planes = {name: np.asarray(channel.pixels) for name, channel in exr.channels(number).items()}
    names = _colour_channels(planes, file)
    if {planes[c].shape for c in names} != {(height, width)}:
        raise UserError("channels differ in size", file=file)
    image = np.empty((height, width, 3), np.float32)
    for channel, name in enumerate(names):
        image[..., channel] = planes[name]
    return _as_rec_709(image, names, chromaticities, file)


def _layers(names: Collection[str]) -> tuple[str, list[str]]:
    """Last letters of the channels with colour, R, G, B, or X, Y, Z, or luminance alone; the layers that have them."""
    for wanted in ("RGB", "XYZ", "YYY"):
        layers = [c.removesuffix(wanted[0]) for c in names if c == wanted[0] or c.endswith(f".{wanted[0]}")]
        if layers := [layer for layer in layers if all(layer + c in names for c in wanted)]:
            return wanted, layers
    return "", []


def _colour_channels(planes: Collection[str], file: Path) -> tuple[str, ...]:
    """Three names of channels that hold R, G, B, or X, Y, Z, or luminance three times."""
    wanted, layers = _layers(planes)
    if not layers:
        expected = "R, G, B; X, Y, Z; or Y"
        raise UserError("EXR has no picture channels", file=file, got=", ".join(sorted(planes)), expected=expected)
    chosen = layers if len(layers) < 2 else [x for x in layers if x == ""] or [
        x for x in layers if x.endswith("Combined.")
    ]  # fmt: skip
    if len(chosen) != 1:
        raise UserError(
            "EXR has several layers with colour", file=file, got=", ".join(x.rstrip(".") for x in sorted(layers)),
            hint="save one of them as a flat picture",
        )  # fmt: skip
    return tuple(chosen[0] + c for c in wanted)


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
