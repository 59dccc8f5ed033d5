"""Images used by textures: each read once, and reduced to a size that a scene with many of them can hold."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core.ceilings import PIXELS, TEXTURE_BYTES
from lambent.core.errors import UserError
from lambent.core.geometry.directions import Floats
from lambent.core.inputs import read_bytes
from lambent.core.light.colour import srgb_decode
from lambent.core.pictures import exr, rgbe
from lambent.core.pictures.images import read_image
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.scenes.loaders.surfaces.textured import Textured
from lambent.scenes.scene import IDENTITY, UvTransform

SIDE_MAX = 2048  # texels; larger images are reduced, with a note
FORMATS = ("PNG", "JPEG", "BMP", "TGA", "TIFF", "WEBP", "GIF")
_LINEAR_OF_BYTE = srgb_decode(np.arange(256, dtype=np.float32) / 255)


@dataclass(frozen=True)
class TextureImage:
    """Texels (H, W, 4), row 0 at the top: uint8 as encoded in the file, or float32 radiance of an EXR or HDR."""

    texels: NDArray[np.uint8] | NDArray[np.float32]
    alpha: bool
    uv_transform: UvTransform = IDENTITY

    def rgb(self, *, srgb: bool) -> Textured:
        """3 channels, float32; bytes are decoded from sRGB, or taken as linear. Radiance is unchanged."""
        if srgb and self.texels.dtype == np.uint8:
            return Textured(_LINEAR_OF_BYTE[self.texels[..., :3]], self.uv_transform)
        return Textured(_unit(self.texels[..., :3]), self.uv_transform)

    def opacity(self) -> Textured:
        """The alpha channel, float32."""
        return Textured(_unit(self.texels[..., 3:]), self.uv_transform)


class TextureImages:
    """The images of one scene; `notes` tells which ones were reduced."""

    def __init__(self, files: SceneFiles) -> None:
        self._files = files
        self._read: dict[object, TextureImage] = {}
        self.notes: list[str] = []

    def named(
        self, name: str, file: Path, field: str, note: Callable[[str], None], otherwise: str = ""
    ) -> TextureImage | None:
        """Image that `file` refers to; None if it is missing, with a note that includes the consequence `otherwise`.

        Raises
        ------
        UserError
            If it lies outside the scene's folder, is of an unknown kind, damaged, or far too large.
        """
        path = self._files.look_for("picture", name, file, field, note, otherwise)
        if path is not None and path not in self._read:
            self._read[path] = read_texture_image(path, self.notes)
        return None if path is None else self._read[path]

    def within(self, key: object, data: bytes, file: Path, field: str) -> TextureImage:
        """Image from bytes within another file; `key` identifies it."""
        if key not in self._read:
            self._read[key] = _decoded(data, file, field, field, self.notes)
        return self._read[key]


def read_texture_image(path: Path, notes: list[str]) -> TextureImage:
    """An image file as a texture; `notes` gets a line if it was reduced.

    Raises
    ------
    UserError
        If it is missing, of an unknown kind, damaged, or far too large.
    """
    data = read_bytes(path, TEXTURE_BYTES)
    if not data.startswith((exr.MAGIC, *rgbe.MAGICS)):
        return _decoded(data, path, None, path.name, notes)
    rgb = _reduced(read_image(path), path.name, notes)
    return TextureImage(np.concatenate([rgb, np.ones_like(rgb[..., :1])], axis=-1), alpha=False)


def _decoded(data: bytes, file: Path, field: str | None, name: str, notes: list[str]) -> TextureImage:
    from PIL import Image

    try:
        with Image.open(io.BytesIO(data), formats=FORMATS) as opened:
            picture: Image.Image = opened
            width, height = picture.size
            PIXELS.check(width * height, file=file, field=field, got=f"{width} x {height}")
            alpha = picture.mode in ("RGBA", "LA", "PA") or "transparency" in picture.info
            if picture.mode.startswith("I"):  # 16-bit grey, which `convert` would clip
                grey = np.asarray(picture, np.float32) / np.float32(257)
                picture = Image.fromarray(np.clip(grey + 0.5, 0, 255).astype(np.uint8))
            if max(width, height) > SIDE_MAX:
                notes.append(f"picture {name}: {width} x {height} reduced to {SIDE_MAX} texels")
                picture.draft("RGB", (SIDE_MAX, SIDE_MAX))
                picture = picture.convert("RGBA" if alpha else "RGB")
                picture.thumbnail((SIDE_MAX, SIDE_MAX))
            return TextureImage(np.asarray(picture.convert("RGBA")), alpha)
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        why = "unknown picture format" if "cannot identify" in str(error) else str(error)
        raise UserError(f"picture cannot be read ({why})", file=file, field=field) from error


def _reduced(rgb: NDArray[np.float32], name: str, notes: list[str]) -> NDArray[np.float32]:
    """Average blocks of texels until the image is small enough."""
    height, width = rgb.shape[:2]
    step = -(-max(height, width) // SIDE_MAX)
    if step == 1:
        return rgb
    notes.append(f"picture {name}: {width} x {height} reduced by {step}")
    rows, columns = max(1, height // step), max(1, width // step)
    if min(height, width) < step:
        return rgb[:rows, :columns]
    blocks = rgb[: rows * step, : columns * step].reshape(rows, step, columns, step, 3)
    return np.asarray(blocks.mean(axis=(1, 3)))


def _unit(texels: NDArray[np.uint8] | NDArray[np.float32]) -> Floats:
    """Bytes as float32 in [0, 1]; float32 unchanged."""
    return np.asarray(texels / np.float32(255) if texels.dtype == np.uint8 else texels, np.float32)
