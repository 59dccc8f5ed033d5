"""Pictures, and comparisons of them."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.light.colour import shown, srgb_encode
from lambent.core.light.exposure import metered
from lambent.core.pictures.images import HDR_SUFFIXES, read_image, to_bytes, write_image, write_shown


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture of linear light.

    Attributes
    ----------
    radiance : (H, W, 3) float32
        Linear, Rec.709 primaries, row 0 on top; W/(sr m^2) for pictures of a store.
    exposure_ev : float
        Exposure of the displayed picture, in stops.
    view : {"filmic", "neutral", "linear"}
        View transform of the displayed picture.
    is_radiance : bool
        Whether values are scene light; False for PNG and JPEG, which are shown as they are.
    """

    radiance: Floats
    exposure_ev: float = 0.0
    view: str = "filmic"
    is_radiance: bool = True
    details: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def read(cls, file: str | Path) -> Picture:
        """Read an image (.exr, .hdr, .png, .jpg)."""
        image, is_radiance = read_image(Path(file)), Path(file).suffix.lower() in HDR_SUFFIXES
        return cls(image, (metered(image) or 0.0) if is_radiance else 0.0, is_radiance=is_radiance)

    @property
    def shown(self) -> NDArray[np.uint8]:
        """(H, W, 3): as a display shows it, after exposure and view transform."""
        if not self.is_radiance:
            return to_bytes(srgb_encode(self.radiance))
        return to_bytes(shown(self.radiance, self.view, self.exposure_ev))

    def save(self, file: str | Path) -> None:
        """Write radiance (.exr, .hdr), or the picture as displayed (.png)."""
        if Path(file).suffix.lower() == ".png":
            write_shown(Path(file), self.shown)
        else:
            write_image(Path(file), self.radiance)

    def facts(self) -> dict[str, Any]:
        """Size and range of the linear values, by name."""
        from lambent.core.light.colour import luminance

        image = self.radiance
        return {
            "is": "picture",
            "size": [image.shape[1], image.shape[0]],
            "luminance_mean": float(luminance(image).mean()),
            "lowest": float(image.min()),
            "highest": float(image.max()),
            "mean_rgb": image.mean(axis=(0, 1), dtype=float),
        }

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Floats:
        return np.array(self.radiance, dtype, copy=bool(copy) or None)

    def __repr__(self) -> str:
        height, width = self.radiance.shape[:2]
        how = f", {self.exposure_ev:+.2f} EV, {self.view}" if self.is_radiance else ""
        return f"Picture({width} x {height}{how})"

    def _repr_png_(self) -> bytes:
        return png_of(self.shown)


@dataclass(frozen=True, eq=False)
class Comparison:
    """The difference of two pictures: `figures` by name, and FLIP in false colours (H, W, 3), encoded."""

    figures: dict[str, Any]
    difference: Floats

    @property
    def psnr_db(self) -> float:
        return float(self.figures["psnr_db"])

    @property
    def flip(self) -> float:
        """Mean FLIP."""
        return float(self.figures["flip_mean"])

    def __repr__(self) -> str:
        worst = self.figures["flip_worst_tile"]
        return f"Comparison(PSNR {self.psnr_db:.2f} dB, FLIP {self.flip:.4f}, worst 16x16 tile {worst:.4f})"

    def _repr_png_(self) -> bytes:
        return png_of(to_bytes(self.difference))


def compare(reference: Picture | Floats | str | Path, test: Picture | Floats | str | Path) -> Comparison:
    """Compare two pictures: PSNR, RMSE in RGB and CIELAB, FLIP with its worst 16x16 tile.

    Where both are radiance, PSNR and FLIP compare clip(e L)^(1/2.2), with e such that the reference has a mean of .3,
    and RMSE compares radiance; otherwise all compare the pictures as a display shows them. Arrays are radiance.

    Raises
    ------
    UserError
        If a file cannot be read, or the sizes differ.
    """
    from lambent.core.pictures import metrics

    pictures = [_picture(one) for one in (reference, test)]
    sizes = ["{1}x{0}".format(*one.radiance.shape) for one in pictures]
    if sizes[0] != sizes[1]:
        file = test if isinstance(test, str | Path) else None
        whose = f"{sizes[0]}, the size of {reference if isinstance(reference, str | Path) else 'the reference'}"
        raise UserError("differs in size", file=file, got=sizes[1], expected=whose)
    radiance = all(one.is_radiance for one in pictures)
    return Comparison(*metrics.compare(*(one.radiance for one in pictures), radiance=radiance))


def _picture(one: Picture | Floats | str | Path) -> Picture:
    if isinstance(one, Picture):
        return one
    return Picture.read(one) if isinstance(one, str | Path) else Picture(np.asarray(one, np.float32))


def png_of(picture: NDArray[np.uint8]) -> bytes:
    """An image (H, W, 3 or 4) as the bytes of a PNG file."""
    from PIL import Image

    made = io.BytesIO()
    Image.fromarray(picture).save(made, "png")
    return made.getvalue()


def jpeg_of(picture: NDArray[np.uint8]) -> bytes:
    """An image (H, W, 3 or 4), opaque, as the bytes of a JPEG file."""
    from PIL import Image

    made = io.BytesIO()
    Image.fromarray(picture[..., :3]).save(made, "jpeg", quality=90)
    return made.getvalue()


def png_of_plot(plot: Callable[[Path], None]) -> bytes:
    """What `plot` draws into a file, as the bytes of a PNG file."""
    with tempfile.TemporaryDirectory() as folder:
        plot(file := Path(folder) / "plot.png")
        return file.read_bytes()
