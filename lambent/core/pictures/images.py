"""Reading and writing pictures: float32, linear Rec.709, (H, W, 3), row 0 at the top.

Reading detects the format from the content: EXR, Radiance HDR, PNG and JPEG (8 or 16 bit, taken as sRGB). A header that
promises more than `PIXELS`, or more than its file can hold, is refused before anything is allocated. Writing follows
the suffix: .exr and .hdr keep linear values, .png encodes them as 8-bit sRGB.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Image
from lambent.core.ceilings import PICTURE_BYTES, PIXELS, Ceiling
from lambent.core.errors import UserError
from lambent.core.files import atomic_path
from lambent.core.inputs import read_bytes
from lambent.core.light.colour import srgb_decode, srgb_encode
from lambent.core.outputs import MARK, check_output
from lambent.core.pictures import exr, rgbe

ROWS_AT_ONCE = 64
HALF_MAX = 65504.0
MENDED = 0.01  # largest share of values that are not finite which can be replaced
HDR_SUFFIXES = (".exr", ".hdr")
WRITABLE = (".exr", ".hdr", ".png")


def read_image(path: Path, ceiling: Ceiling = PIXELS, *, mend: bool = False) -> Image:
    """Linear RGB (H, W, 3) float32 of an EXR, HDR, PNG or JPEG file; an alpha channel is dropped.

    `ceiling` limits the pixels of EXR and HDR files; PNG and JPEG have at most `PIXELS`. If `mend`, values that are not
    finite, in at most `MENDED` of the pixels, are replaced: see `_mended`.

    Raises
    ------
    UserError
        If the file is missing, of another kind, truncated, too large, or has values that are not finite.
    """
    path = Path(path)
    data = read_bytes(path, PICTURE_BYTES)
    if data.startswith(exr.MAGIC):
        image = exr.decode(path, ceiling)
    elif data.startswith(rgbe.MAGICS):
        image = rgbe.decode(data, path, ceiling)
    elif data.startswith((b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff")):
        image = _linear(_stored(path))
    else:
        raise UserError("unknown picture format", file=path, got=repr(data[:4]), expected="EXR, HDR, PNG or JPEG")
    bad = image.size - np.count_nonzero(np.isfinite(image))
    if mend and 0 < bad <= MENDED * image.size:
        return _mended(image)
    if bad:
        raise UserError("picture has values that are not finite", file=path, got=f"{bad} of {image.size} values")
    return image


def read_encoded(path: Path) -> Image:
    """Values (H, W, 3 or 4) in [0, 1] of a PNG or JPEG as stored, undecoded: for normal maps, masks and alpha."""
    return _values(_stored(path))


def _stored(path: Path) -> NDArray[Any]:
    """Integers of a PNG or JPEG as stored: (H, W, 3 or 4) of 8 bits, or (H, W) of 16."""
    from PIL import Image as Pillow

    data = read_bytes(Path(path), PICTURE_BYTES)
    try:
        with Pillow.open(io.BytesIO(data), formats=("PNG", "JPEG")) as picture:
            PIXELS.check(picture.width * picture.height, file=path, got=f"{picture.width} x {picture.height}")
            if picture.mode.startswith("I"):  # 16-bit grey
                return np.asarray(picture)
            alpha = picture.mode in ("RGBA", "LA", "PA") or "transparency" in picture.info
            return np.asarray(picture.convert("RGBA" if alpha else "RGB"))
    except (OSError, SyntaxError, ValueError, Pillow.DecompressionBombError) as error:
        raise UserError("picture is damaged or cut off", file=path, hint="copy or export it again") from error


def _mended(image: Image) -> Image:
    """A picture whose infinite values become the largest of half floats, or its own; others that are not finite, black.

    A sun that is brighter than half floats can say is written as infinity.
    """
    largest = max(HALF_MAX, float(image[np.isfinite(image)].max()))
    return np.nan_to_num(image, nan=0.0, posinf=largest, neginf=0.0)


def write_image(path: Path, image: NDArray[Any], view: str | None = None) -> None:
    """Write linear RGB (H, W, 3), atomically, in the format of the suffix: .exr, .hdr or .png.

    PNG values are clipped to [0, 1] and sRGB-encoded: apply `colour.filmic` first to scene radiance. `view`, Radiance's
    view options, goes into the header of an .hdr file.
    """
    path = Path(path)
    rgb = np.asarray(image, np.float32)
    assert rgb.ndim == 3 and rgb.shape[2] == 3, f"not (H, W, 3): {rgb.shape}"
    check_writable(path)
    with atomic_path(path) as temporary:
        if path.suffix.lower() == ".exr":
            exr.encode(rgb, temporary)
        elif path.suffix.lower() == ".hdr":
            temporary.write_bytes(rgbe.encode(rgb, view))
        else:
            _save_png(temporary, to_bytes(srgb_encode(rgb)))


def write_shown(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write display values, (H, W, 3) uint8 encoded, as PNG, atomically."""
    check_writable(path, (".png",))
    with atomic_path(path) as temporary:
        _save_png(temporary, picture)


def _save_png(path: Path, picture: NDArray[np.uint8]) -> None:
    from PIL import Image as Pillow
    from PIL.PngImagePlugin import PngInfo

    info = PngInfo()
    info.add_text("Software", MARK)
    Pillow.fromarray(picture).save(path, format="PNG", pnginfo=info)


def check_writable(path: Path, suffixes: tuple[str, ...] = WRITABLE) -> None:
    """Raise `UserError` if no picture with one of `suffixes` can be written at `path`; called before long work."""
    check_output(Path(path), suffixes, force=True)


def to_bytes(encoded: NDArray[Any]) -> NDArray[np.uint8]:
    """Encoded values in [0, 1] as rounded bytes; NaN becomes 0."""
    return np.asarray(np.clip(np.nan_to_num(encoded), 0, 1) * 255 + 0.5, np.uint8)


def _values(stored: NDArray[Any]) -> Image:
    """Stored integers as (..., 3 or 4) float32 in [0, 1]."""
    values = stored.astype(np.float32)
    values /= np.float32(65535 if stored.ndim == 2 else 255)
    return np.repeat(values[..., None], 3, axis=-1) if stored.ndim == 2 else values


def _linear(stored: NDArray[Any]) -> Image:
    """Linear RGB of sRGB integers, a few rows at a time: temporaries of a whole large picture would not fit."""
    image = np.empty((*stored.shape[:2], 3), np.float32)
    for top in range(0, len(image), ROWS_AT_ONCE):
        rows = slice(top, top + ROWS_AT_ONCE)
        image[rows] = srgb_decode(_values(stored[rows])[..., :3])
    return image
