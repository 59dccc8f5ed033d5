"""Create materials and textures from the surfaces that files describe.

Images are read once, and reduced to a size that a scene with many of them can hold.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
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
from lambent.core.plain import Triple
from lambent.materials.document import COEFFICIENT_MAX, Distribution, Lobe, Material
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.scenes.loaders.surfaces.surface import ROUGHNESS_MIN, Surface, rgb
from lambent.scenes.loaders.surfaces.textured import Textured, relative
from lambent.scenes.scene import IDENTITY, MaterialTextures, Texture, UvTransform

ROUGHNESS_MAX = 4.0  # slope, of a material's document
# Slope roughness; exponent of (cos_i cos_o) and coefficient of the lobe nearest to the same distribution with Smith's
# masking, by least difference of f cos and of the albedo, weighted by the cosine. The albedo of a white lobe stays
# below 1 up to 82 degrees and is at most 1.1 at 87.
MASKED = {
    "ggx": (
        (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0, 1.4),
        (0.5, 0.5, 0.488, 0.471, 0.441, 0.413, 0.388, 0.351, 0.322, 0.278, 0.236, 0.182, 0.137, 0.002),
        (1.0, 1.007, 1.022, 1.039, 1.062, 1.084, 1.102, 1.116, 1.112, 1.113, 1.106, 1.081, 1.043, 0.958),
    ),
    "beckmann": (
        (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0, 1.4, 2.0),
        (0.5, 0.502, 0.507, 0.509, 0.487, 0.464, 0.441, 0.391, 0.344, 0.309, 0.277, 0.241, 0.217, 0.201, 0.148),
        (1.0, 1.001, 1.002, 1.011, 1.022, 1.038, 1.061, 1.135, 1.215, 1.261, 1.305, 1.349, 1.361, 1.255, 1.077),
    ),
}  # fmt: skip
SIDE_MAX = 2048  # texels; larger images are reduced, with a note
FORMATS = ("PNG", "JPEG", "BMP", "TGA", "TIFF", "WEBP", "GIF")
_LINEAR_OF_BYTE = srgb_decode(np.arange(256, dtype=np.float32) / 255)


class MaterialBuilder:
    """The materials of one file, each created at its first use."""

    def __init__(self, notes: list[str] | None = None) -> None:
        self.materials: dict[str, Material] = {}
        self.textures: dict[str, MaterialTextures] = {}
        self.emission: dict[str, Triple] = {}
        self.notes = [] if notes is None else notes

    def make(self, name: str, surface_of: Callable[[list[str]], Surface]) -> None:
        """Create the material of a name, unless it exists; `surface_of` takes a list for its notes."""
        if name in self.materials:
            return
        notes: list[str] = []
        surface = surface_of(notes)
        self.materials[name], textures = finished(name, surface, notes)
        if textures is not None:
            self.textures[name] = textures
        self.emission[name] = surface.emission
        self.notes += [f"material {name}: {text}" for text in dict.fromkeys(notes)]


def finished(name: str, surface: Surface, notes: list[str]) -> tuple[Material, MaterialTextures | None]:
    """Material document and textures of a surface; None if nothing varies.

    The document has the means, so that it is right without its textures. Lobes share one texture of coefficients and
    one of roughness: if they differ, the first is used and a note is added.
    """
    kd, diffuse = relative(surface.kd, surface.opacity)
    kt_d, through = relative(surface.kt_d, surface.opacity)
    if max(*kd, *kt_d) > 1:
        notes.append(f"reflects more light than arrives ({max(*kd, *kt_d):.3g}): clipped to 1")
        kd, kt_d = np.minimum(kd, 1), np.minimum(kt_d, 1)
    if diffuse is not None and through is not None and not _same(diffuse, through):
        notes.append("its diffuse transmission follows the texture of its diffuse reflection")
    lobes, shades, slopes = [], [], []
    for lobe in surface.lobes:
        k, shade = relative(lobe.k, surface.opacity)
        m, slope = relative(lobe.m, surface.opacity)
        shades.append(shade)
        slopes.append(slope)
        mx, my = (min(max(float(v), ROUGHNESS_MIN), ROUGHNESS_MAX) for v in (m[0], m[0] * lobe.aspect))
        alpha, share = masking(mx, my, lobe.distribution) if lobe.masked else (0.5, 1.0)
        if lobe.masked and lobe.m.is_texture:  # at the smoothest place, the albedo must not exceed 1
            least = float(lobe.m.values.min())
            share = min(share, masking(least, least * lobe.aspect, lobe.distribution)[1])
        alpha = min(max(alpha - lobe.falloff / 2, 0.0), 1.0)
        lobes.append(
            Lobe(
                side=lobe.side,
                distribution=lobe.distribution,
                k=rgb(np.minimum(k * share, COEFFICIENT_MAX)),
                mx=mx,
                my=my,
                r0=rgb(np.clip(lobe.r0, 0, 1)),
                alpha=alpha,
            )
        )
    textures = MaterialTextures(
        diffuse=_rgb(diffuse or through),
        specular=_rgb(_shared(shades, "colours", notes)),
        roughness=_shared(slopes, "roughness", notes),
        normal=surface.normal,
        direction=surface.direction,
        opacity=surface.opacity,
        cutoff=surface.cutoff,
    )
    coupled = surface.coupled and any(kd)
    material = Material(name=name, kd=rgb(kd), kd_coupled=coupled, kt_d=rgb(kt_d), lobes=tuple(lobes))
    varies = textures != MaterialTextures(cutoff=textures.cutoff)
    return material, textures if varies else None


def masking(mx: float, my: float, distribution: Distribution) -> tuple[float, float]:
    """Exponent of (cos_i cos_o) and coefficient of the lobe that replaces a masked one with these slopes."""
    m, alpha, k = MASKED[distribution]
    return float(np.interp([mx, my], m, alpha).mean()), float(np.interp([mx, my], m, k).mean())


def _shared(found: Sequence[Texture | None], what: str, notes: list[str]) -> Texture | None:
    """One texture for all lobes."""
    textures = [t for t in found if t is not None]
    if not textures:
        return None
    if any(t is None or not _same(t, textures[0]) for t in found):
        notes.append(f"the {what} of its lobes have different textures: all use the first")
    return textures[0]


def _rgb(texture: Texture | None) -> Texture | None:
    if texture is None or texture.texels.shape[-1] == 3:
        return texture
    return replace(texture, texels=np.repeat(texture.texels, 3, axis=-1))


def _same(a: Texture, b: Texture) -> bool:
    if a.uv_transform != b.uv_transform or a.texels.shape != b.texels.shape:
        return False
    return a.texels is b.texels or bool(np.array_equal(a.texels, b.texels))


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
