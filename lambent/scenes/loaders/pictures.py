"""Pictures on surfaces: read once, in a size that a scene full of them can bear."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core import exr, rgbe
from lambent.core.colour import srgb_decode
from lambent.core.directions import Floats
from lambent.core.errors import UserError
from lambent.core.files import read_bytes
from lambent.core.images import read_image

PIXELS_MAX = 1 << 26
SIDE_MAX = 2048  # texels; larger pictures are reduced, which is said
LIMIT_BYTES = 1 << 30
FORMATS = ("PNG", "JPEG", "BMP", "TGA", "TIFF", "WEBP", "GIF")
_LINEAR_OF_BYTE = srgb_decode(np.arange(256, dtype=np.float32) / 255)


@dataclass(frozen=True)
class Picture:
    """Texels (H, W, 4), row 0 at the top: uint8 as encoded in the file, or float32 radiance of an EXR or HDR."""

    texels: NDArray[np.uint8] | Floats
    alpha: bool

    def rgb(self, *, srgb: bool) -> Floats:
        """(H, W, 3) float32; bytes are decoded from sRGB, or taken as linear. Radiance stays as it is."""
        texels = self.texels[..., :3]
        if texels.dtype != np.uint8:
            return texels
        return _LINEAR_OF_BYTE[texels] if srgb else texels.astype(np.float32) / np.float32(255)

    def opacity(self) -> Floats:
        """(H, W, 1) float32 of the alpha channel."""
        a = self.texels[..., 3:]
        return a.astype(np.float32) / np.float32(255) if a.dtype == np.uint8 else a


class Pictures:
    """The pictures of one scene, each read once; `said` is what had to be done to them."""

    def __init__(self) -> None:
        self._read: dict[object, Picture] = {}
        self.said: list[str] = []

    def of_file(self, path: Path) -> Picture:
        """Picture of a file.

        Raises
        ------
        UserError
            Where it is missing, of an unknown kind, damaged, or absurdly large.
        """
        if path not in self._read:
            data = read_bytes(path, LIMIT_BYTES)
            if data.startswith(exr.MAGIC) or data.startswith(rgbe.MAGICS):
                rgb = self._reduced(read_image(path), path.name)
                self._read[path] = Picture(np.concatenate([rgb, np.ones_like(rgb[..., :1])], axis=-1), alpha=False)
            else:
                self._read[path] = self._decoded(data, path, None, path.name)
        return self._read[path]

    def of_bytes(self, key: object, data: bytes, file: Path, field: str) -> Picture:
        """Picture within another file; `key` tells it from the others."""
        if key not in self._read:
            self._read[key] = self._decoded(data, file, field, field)
        return self._read[key]

    def _decoded(self, data: bytes, file: Path, field: str | None, name: str) -> Picture:
        from PIL import Image, UnidentifiedImageError

        try:
            with Image.open(io.BytesIO(data), formats=FORMATS) as picture:
                width, height = picture.size
                if width * height > PIXELS_MAX:
                    got, most = f"{width} x {height}", f"at most {PIXELS_MAX} pixels"
                    raise UserError("picture is too large", file=file, field=field, got=got, expected=most)
                alpha = picture.mode in ("RGBA", "LA", "PA") or "transparency" in picture.info
                if picture.mode.startswith("I"):  # 16-bit grey, which `convert` would clip
                    grey = np.asarray(picture, np.float32) / np.float32(257)
                    picture = Image.fromarray(np.clip(grey + 0.5, 0, 255).astype(np.uint8))
                if max(width, height) > SIDE_MAX:
                    self.said.append(f"picture {name}: {width} x {height} reduced to {SIDE_MAX} texels")
                    picture.draft("RGB", (SIDE_MAX, SIDE_MAX))
                    picture = picture.convert("RGBA" if alpha else "RGB")
                    picture.thumbnail((SIDE_MAX, SIDE_MAX))
                return Picture(np.asarray(picture.convert("RGBA")), alpha)
        except (OSError, UnidentifiedImageError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
            raise UserError(f"picture cannot be read ({_short(error)})", file=file, field=field) from error

    def _reduced(self, rgb: Floats, name: str) -> Floats:
        """Means over blocks of texels, until the picture is small enough."""
        height, width = rgb.shape[:2]
        step = -(-max(height, width) // SIDE_MAX)
        if step == 1:
            return rgb
        self.said.append(f"picture {name}: {width} x {height} reduced by {step}")
        rows, columns = max(1, height // step), max(1, width // step)
        cut = rgb[: rows * step, : columns * step] if min(height, width) >= step else rgb[:rows, :columns]
        if min(height, width) < step:
            return cut
        mean: Floats = cut.reshape(rows, step, columns, step, 3).mean(axis=(1, 3))
        return mean


def _short(error: Exception) -> str:
    text = str(error)
    return "not a picture of a known kind" if "cannot identify" in text else text
