"""Reference images, and errors of images against them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.errors import UserError
from lambent.core.light.colour import shown
from lambent.core.pictures import metrics
from lambent.core.pictures.images import HDR_SUFFIXES, read_image
from lambent.core.progress import Progress
from lambent.core.views.camera import Camera
from lambent.traced.picture import ENDED, TracedPicture

if TYPE_CHECKING:
    from lambent.baking.pictures.tracer import Tracer

COMPILING = 32, 18  # pixels


@dataclass(frozen=True)
class Reference:
    """Radiance (H, W, 3), the compared pixels (H, W), and the exposure of `metrics.display_exposure`.

    Images are compared as clip(2^exposure_ev L)^(1/2.2), black outside the compared pixels.
    """

    radiance: Floats
    shown: Flags
    exposure_ev: float
    encoded: Floats

    @classmethod
    def of(cls, radiance: Floats, shown: Flags) -> Reference:
        radiance = radiance * shown[..., None]
        exposure_ev = metrics.display_exposure(radiance)
        return cls(radiance, shown, exposure_ev, metrics.displayed(radiance, exposure_ev))

    def errors(self, image: Floats) -> dict[str, float]:
        """psnr over the compared pixels; flip: its mean over the image, over those pixels, and its worst tile."""
        test = metrics.displayed(image * self.shown[..., None], self.exposure_ev)
        flip = metrics.flip_error(self.encoded, test)
        return {
            "psnr": round(metrics.psnr(self.encoded[self.shown], test[self.shown]), 3),
            "flip": round(float(flip.mean()), 5),
            "flip_shown": round(float(flip[self.shown].mean()), 5),
            "flip_worst_tile": round(float(metrics.tile_means(flip).max()), 5),
        }


@dataclass(frozen=True)
class Truth:
    """A view as displayed: sRGB (H, W, 3) at `exposure_ev`. `noise` is the FLIP between its halves, if it has any.

    The halves are independent: the error of each is 1.4 times that of the truth, and a part of every figure.
    """

    radiance: Floats
    exposure_ev: float
    encoded: Floats
    noise: float | None

    @classmethod
    def of(cls, parts: Sequence[Floats]) -> Truth:
        """The mean of pictures (H, W, 3) of equal samples; the halves are every second one and the others."""
        radiance = np.mean(parts, axis=0)
        exposure_ev = metrics.display_exposure(radiance)
        found = cls(radiance, exposure_ev, shown(radiance, "linear", exposure_ev), None)
        halves = [found.shown(np.mean(half, axis=0)) for half in (parts[::2], parts[1::2]) if half]
        noise = round(float(metrics.flip_error(*halves).mean()), 4) if len(halves) == 2 else None
        return replace(found, noise=noise)

    def shown(self, radiance: Floats) -> Floats:
        """Radiance (H, W, 3) as displayed."""
        return shown(radiance, "linear", self.exposure_ev)

    def errors(self, radiance: Floats) -> dict[str, Any]:
        """`errors_shown` of a picture's radiance (H, W, 3)."""
        return self.errors_shown(self.shown(radiance))

    def errors_shown(self, encoded: Floats) -> dict[str, Any]:
        """flip, flip_worst_tile and psnr of a displayed picture (H, W, 3), beside the truth's noise."""
        flip = metrics.flip_error(self.encoded, encoded)
        return {
            "flip": round(float(flip.mean()), 4),
            "flip_worst_tile": round(float(metrics.tile_means(flip).max()), 4),
            "psnr": round(metrics.psnr(self.encoded, encoded), 2),
            "reference_flip": self.noise,
        }


def compile_kernels(tracer: Tracer, camera: Camera, *, path: bool) -> None:
    """Trace a tiny picture with samples of all kinds; its kernels serve all sizes."""
    with_samples(TracedPicture(tracer, camera, COMPILING, path=path), ENDED + 1).denoised()


def path_traced_parts(
    tracer: Tracer, camera: Camera, size: tuple[int, int], samples: int, count: int, progress: Progress
) -> list[Floats]:
    """`count` independent pictures of a view, with a number of whole paths per pixel in all."""
    parts: list[Floats] = []
    for seed in range(count):
        parts.append(path_traced(tracer, camera, size, samples // count, seed + 1).mean())
        progress(seed + 1, count + 1, "truth")
    return parts


def finished(paths: Sequence[Path], inputs: Sequence[Path]) -> list[Floats]:
    """Radiance (H, W, 3) of path traced pictures of the first view of the only input.

    Raises
    ------
    UserError
        If there are several inputs or none, or if a file cannot be read, holds display values, is black, or differs in
        size from the first.
    """
    if paths and len(inputs) != 1:
        got, expected = f"{len(inputs)} inputs", "one store, of whose first camera it is a picture"
        raise UserError("a reference belongs to one store", field="--reference", got=got, expected=expected)
    found: list[Floats] = []
    for path in paths:
        if path.suffix.lower() not in HDR_SUFFIXES:
            hint = "lambent render STORE --integrator path -o reference.exr"
            raise UserError("a reference must hold radiance", file=path, expected=".exr or .hdr", hint=hint)
        picture = read_image(path)
        if found and picture.shape != found[0].shape:
            size, first = (f"{shape[1]}x{shape[0]}" for shape in (picture.shape, found[0].shape))
            raise UserError("references differ in size", file=path, got=size, expected=first)
        if not picture.any():
            raise UserError("reference is black", file=path)
        found.append(picture)
    return found


def path_traced(tracer: Tracer, camera: Camera, size: tuple[int, int], samples: int, seed: int) -> TracedPicture:
    """A view by a number of whole paths per pixel."""
    return with_samples(TracedPicture(tracer, camera, size, seed=seed, path=True), samples)


def with_samples(picture: TracedPicture, samples: int) -> TracedPicture:
    """The picture, when it has a number of samples per pixel."""
    while picture.samples < samples:
        picture.sample(samples - picture.samples)
    return picture


def mean(digits: int) -> Callable[[list[float]], float]:
    """A rounding mean, for `by_n`."""
    return lambda values: round(float(np.mean(values)), digits)


def by_n(
    rows: Iterable[Mapping[str, Any]], name: str, key: str, of: Callable[[list[float]], float]
) -> dict[str, dict[str, float]]:
    """{row[name]: {n: `of` all row[key]}}."""
    groups: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        groups[row[name]][str(row["n"])].append(row[key])
    return {name: {n: of(values) for n, values in series.items()} for name, series in groups.items()}
