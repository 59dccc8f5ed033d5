"""One object of a scene in a view, with its light fields: the test case for the bench of light fields.

The scene is lit by its baked light map, for both maps and truth.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lambent.baked.light_fields.light_field import NO_POINT, LightField
from lambent.baked.light_fields.lookup import Place
from lambent.baking.quality import Quality
from lambent.bench.measuring.bake_context import context_of
from lambent.bench.measuring.reference import Reference
from lambent.core.arrays import Floats, Indices, sums_of
from lambent.core.geometry.cubemap import sample
from lambent.core.geometry.triangles import triangle_areas
from lambent.core.light.colour import rgb_to_lab
from lambent.core.pictures import metrics
from lambent.core.progress import Progress, silent
from lambent.core.views.camera import Camera
from lambent.realtime.sun.sun_disc import sky_without
from lambent.scenes.scene import Scene
from lambent.store.contract import sun_left_out

if TYPE_CHECKING:
    from lambent.baking.context import BakeContext
    from lambent.baking.reference.mirrored import MirrorTracer, Shown

SEED = 1
TRUE_PATHS = 16  # for each place of the truth: glossy surfaces scatter light, and one path leaves 1.5 % of a* and b*


@dataclass(frozen=True)
class Compared:
    """Pixels of an object in a view, cropped to it, against a reference; radiance is compared as displayed."""

    pixel: Indices
    shape: tuple[int, int]
    reference: Reference

    @classmethod
    def of(cls, pixel: Indices, size: tuple[int, int], truth: Floats) -> Compared:
        """Places (k,) by pixel number in an image of `size` (width, height), and their radiance (k, 3)."""
        row, column = pixel // size[0], pixel % size[0]
        row, column = row - row.min(), column - column.min()
        shape = int(row.max()) + 1, int(column.max()) + 1
        at = row * shape[1] + column
        shown = np.bincount(at, minlength=shape[0] * shape[1]).reshape(shape) > 0
        return cls(at, shape, Reference.of(_means(at, shape, truth), shown))

    def image(self, radiance: Floats) -> Floats:
        """Radiance (k, 3) as an image: the mean of each pixel's places, black elsewhere."""
        return _means(self.pixel, self.shape, radiance)

    def errors(self, radiance: Floats) -> dict[str, Any]:
        """flip, psnr and worst_tile over the object's pixels; rmse_rgb and rmse_lab, L* / 100, at equal exposure."""
        image, shown = self.image(radiance), self.reference.shown
        found = self.reference.errors(image)
        both = self.reference.radiance[shown], image[shown]
        exposed = [np.clip(of * 2.0**self.reference.exposure_ev, 0, 1) for of in both]
        lab = [rgb_to_lab(of) / 100 for of in exposed]
        return {
            "flip": found["flip_shown"],
            "psnr": found["psnr"],
            "worst_tile": found["flip_worst_tile"],
            "rmse_lab": [round(float(v), 5) for v in metrics.rmse_rgb(lab[0][None], lab[1][None])],
            "rmse_rgb": [round(float(v), 5) for v in metrics.rmse_rgb(exposed[0][None], exposed[1][None])],
        }


def _means(at: Indices, shape: tuple[int, int], radiance: Floats) -> Floats:
    """Image (H, W, 3) of the means of radiance (k, 3) in pixels (k,)."""
    count = np.maximum(np.bincount(at, minlength=shape[0] * shape[1]), 1)
    return (sums_of(radiance, at, len(count)) / count[:, None]).reshape(*shape, 3)


class LightFieldView:
    """An object of a scene, lit and traced.

    Attributes
    ----------
    shown : Shown
        Places of the object that pixels show, several per pixel.
    truth, surface : (k, 3) radiance in its mirror direction, and of the object itself without lobes.
    distance_m : (k,) distance in the mirror direction, infinite for the sky.
    """

    def __init__(
        self, scene: Scene, name: str, camera: int, size: tuple[int, int], paths: int, folder: Path,
        quality: Quality, progress: Progress = silent,
    ) -> None:  # fmt: skip
        self._context = _lit(scene, folder, quality, progress)
        self._name, self.size = name, size
        chosen: Camera = self._context.scene.cameras[camera]
        progress(0, 1, "truth")
        self.shown: Shown = self._tracer.shown(chosen, *size, paths, SEED)
        self.truth, self.surface = self._truth(), self._tracer.surface(self.shown)
        self.distance_m = self._tracer.distance_m(self.shown)

    def _truth(self) -> Floats:
        """Mean radiance (k, 3) of TRUE_PATHS paths from each place."""
        total = np.zeros_like(self.shown.x)
        for n in range(TRUE_PATHS):
            total += self._tracer.mirrored(self.shown, SEED + n)
        return total / TRUE_PATHS

    @cached_property
    def _tracer(self) -> MirrorTracer:
        from lambent.baking.artefacts.light_map import finished_maps
        from lambent.baking.reference.mirrored import MirrorTracer

        return MirrorTracer(self._context.traced, finished_maps(self._context), self._name)

    @cached_property
    def _sky(self) -> Floats:
        store, sun = self._context.store, sun_left_out(self._context.store)
        array = store.artefact("environment/radiance")
        cube = store.read(array.name).astype(np.float32) * float(array.meta.get("unit", 1.0))
        return cube if sun is None else sky_without(cube, sun)

    def sky(self, w: Floats) -> Floats:
        """Radiance (k, 3) of the environment along w (k, 3), without the sun's disc."""
        return np.asarray(sample(self._sky, w), float)

    def field(self, points: int, texels: int, strata: int) -> LightField:
        """A light field of the object; points that no pixel shows stay black, which halves the time."""
        from lambent.baking.light_fields.placing import Placing
        from lambent.baking.light_fields.sample_map import sample_map

        traced, context = self._context.traced, self._context
        mesh = context.scene.object(self._name).mesh
        placing = Placing(traced.builder(diffuse=False), traced.whole(diffuse=False))
        placed = placing.points(mesh, points, SEED)
        at = placed.positions.astype(np.float32)
        first = np.cumsum([0, *(len(o.mesh.faces) for o in traced.scene.objects)])
        number = [o.name for o in traced.scene.objects].index(self._name)
        spacing_m = float(np.sqrt(triangle_areas(mesh.corners).sum() / len(at)))
        size = context.atlas.width, context.atlas.height
        found = sample_map(context.geometry, np.arange(*first[number : number + 2]), size, at, spacing_m)
        radiance = np.zeros((len(at), texels, texels, 3), np.float16)
        nearness = np.zeros((len(at), texels, texels), np.float16)
        cover = np.zeros((len(at), texels, texels), np.uint8)
        field = LightField(
            at, placed.normals.astype(np.float32), radiance, nearness, found.entries, found.corner, found.grid,
            placed.offset_m, cover=cover,
        )  # fmt: skip
        near = self.place(field)
        used = np.unique(near.points[near.known])
        radiance[used], nearness[used], cover[used] = self._tracer.maps(at[used], texels, strata, SEED)
        return field

    def single(self, texels: int, strata: int) -> LightField:
        """One map from the object's centre, without the object: reflection mapping as a light field of one point."""
        middle, radiance, nearness = self._tracer.map_from_middle(texels, strata, SEED)
        nothing = np.full((1, 1, 4), NO_POINT, np.uint16)
        at = middle.astype(np.float32)
        return LightField(at, 0 * at, radiance, nearness, nothing, (0, 0), (1, 1), 0.0)

    def place(self, field: LightField) -> Place:
        """The pixels' places, with the nearby points of a light field."""
        return Place.at(field, self.shown.x, self.shown.n, self.shown.uv2)


def _lit(scene: Scene, folder: Path, quality: Quality, progress: Progress) -> BakeContext:
    """The context of a bake of the scene's light map."""
    from lambent.baking.bake import bake

    store = bake(scene, folder, quality=quality, only=("light_map", "environment"), progress=progress)
    return context_of(store, scene, quality, progress)
