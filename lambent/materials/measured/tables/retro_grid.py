"""Two half-vector grids for a table with peaks about the light: one for mirrored light, one for returned light.

f is their sum, split by `back_share`, which is smooth, so that each part lies in the same cells for every viewer. A
sample comes from one of them, with probabilities by albedo; the density is that of the mixture. Transmitted light is in
the first only. Conventions and array libraries are those of half_vector_grid.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from lambent.core.progress import Progress, silent
from lambent.materials.lobes import NUMPY, ArrayOps, Vector
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.measured.tables.half_vector_grid import GridShape, HalfVectorGrid
from lambent.materials.measured.tables.half_vector_resampling import TwoSided, grid_of


@dataclass(frozen=True)
class RetroGrid:
    """The two parts; `returned` (faces, viewers) flat float32 is the probability that a sample comes from `light`."""

    ARRAYS: ClassVar[tuple[str, ...]] = (
        *(f"{part}.{name}" for part in ("mirror", "light") for name in HalfVectorGrid.ARRAYS), "returned",
    )  # fmt: skip

    mirror: HalfVectorGrid
    light: HalfVectorGrid
    returned: Any

    @property
    def sizes(self) -> tuple[int, ...]:
        return self.mirror.sizes

    @classmethod
    def of_sizes(cls, sizes: tuple[int, ...], arrays: dict[str, Any]) -> RetroGrid:
        """The inverse of `sizes` and `ARRAYS`."""
        mirror, light = (
            {name: arrays[f"{part}.{name}"] for name in HalfVectorGrid.ARRAYS} for part in ("mirror", "light")
        )
        *rest, _ = sizes
        about_light = HalfVectorGrid.of_sizes((*rest, 1), light | {"about_light": True})
        return cls(HalfVectorGrid.of_sizes(sizes, mirror), about_light, arrays["returned"])

    @property
    def anisotropic(self) -> bool:
        return self.mirror.anisotropic

    @property
    def kinds(self) -> int:
        return self.mirror.kinds

    def evaluate(self, wi: Vector, wo: Vector, ops: ArrayOps = NUMPY) -> Vector:
        """f in 1/sr per RGB channel, without the cosine."""
        parts = (grid.evaluate(wi, wo, ops) for grid in (self.mirror, self.light))
        red, green, blue = (one + other for one, other in zip(*parts, strict=True))
        return red, green, blue

    def pdf(self, wi: Vector, wo: Vector, ops: ArrayOps = NUMPY) -> Any:
        """Density of `sample` in 1/sr."""
        share = self.returned_share(wo, ops)
        return share * self.light.pdf(wi, wo, ops) + (1 - share) * self.mirror.pdf(wi, wo, ops)

    def sample(self, wo: Vector, u_select: Any, u1: Any, u2: Any, ops: ArrayOps = NUMPY) -> Vector:
        """wi; u_* uniform in [0, 1): transmitted, then towards the light, then mirrored."""
        share, across = self.returned_share(wo, ops), self.transmitted_share(wo, ops)
        back = (u_select >= across) & (u_select < across + share)
        returned = self.light.sample(wo, (u_select - across) / ops.maximum(share, 1e-9), u1, u2, ops)
        rest = ops.select(u_select < across, u_select, u_select - share) / ops.maximum(1 - share, 1e-9)
        mirrored = self.mirror.sample(wo, rest, u1, u2, ops)
        x, y, z = (ops.select(back, one, other) for one, other in zip(returned, mirrored, strict=True))
        return x, y, z

    def returned_share(self, wo: Vector, ops: ArrayOps = NUMPY) -> Any:
        """Probability that a sample comes from `light`."""
        return self.mirror.of_viewer(self.returned, wo, ops)

    def transmitted_share(self, wo: Vector, ops: ArrayOps = NUMPY) -> Any:
        """Probability of a transmitted sample."""
        return (1 - self.returned_share(wo, ops)) * self.mirror.transmitted_share(wo, ops)


def retro_grid_of(
    table: MeasuredTable | TwoSided, shape: GridShape | None = None, progress: Progress = silent
) -> RetroGrid:
    """Resample a table to two grids; `shape` as in `grid_of`, for each."""
    mirror, light = (grid_of(table, shape, progress, part=part) for part in ("mirror", "light"))
    nodes = (mirror.faces, mirror.kinds, mirror.shape.viewers)
    whole = mirror.albedo.reshape(nodes).sum(axis=1)
    returned = light.albedo.reshape(mirror.faces, -1)
    share = returned / np.maximum(whole + returned, 1e-30)
    return RetroGrid(mirror, light, share.astype(np.float32).ravel())
