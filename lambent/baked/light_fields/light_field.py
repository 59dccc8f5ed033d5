"""An offset surface light field: incident light at many points just above the surface of one object.

Spec: thesis R, "Offset surface light fields", chapter 3. `store.contract` documents the stored form.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats

Sky = Callable[[Floats], Floats]  # radiance (n, 3) of directions (n, 3) in which rays hit nothing
NO_POINT = 0xFFFF  # in a sample map: no further point
NO_EXIT = -1.0  # instead of a distance: no face behind
CANDIDATES = 4  # points per texel of the sample map, at most
# Sky share of a texel that has the light of a surface, by the bits of `LightField.cover`.
SKY_SHARE = np.array([0.0, *[1 - bits.bit_count() / 4 for bits in range(1, 16)]])


class Maps(Protocol):
    """Maps of all points, (P, E, E) or (P, E, E, C): an array, or what is decoded where it is read."""

    @property
    def shape(self) -> tuple[int, ...]: ...

    @property
    def dtype(self) -> np.dtype[Any]: ...

    def __getitem__(self, key: Any, /) -> Any: ...

    def __array__(self) -> NDArray[Any]: ...


@dataclass(frozen=True, eq=False)
class Glass:
    """The second interface of a thin piece of glass: thesis R, "Thin Lens Refractions".

    Parameters
    ----------
    exits : (h, w, 4) float16, by texel of the sample map: the normal of the face behind it, out of the glass, times the
        transmittance of further faces of the object at normal incidence; and the distance to the face along the normal
        of the surface, in metres. The distance is -1 if there is no face behind: the surface is a sheet.
    eta : index of refraction, inside over outside.
    tint : transmittance of one interface at normal incidence, RGB.
    power : exponent of the cosine by which transmittance falls off at other angles (`materials.clear`).
    """

    exits: NDArray[np.float16]
    eta: float
    tint: tuple[float, float, float]
    power: float


@dataclass(frozen=True, eq=False)
class LightField:
    """Points above an object, the light and distances they see, and a map of the points near each place on the surface.

    Parameters
    ----------
    points : (P, 3) float32, world space, metres: origins of the maps, off the surface.
    normals : (P, 3) float32, unit: the surface's normal below each point, along which it was moved out.
    radiance : (P, E, E, 3) float32 or float16: octahedral maps (core.octahedral) of incident radiance in world axes, in
        units of the scene's `unit`.
    inverse_distance : (P, E, E) float16, 1/m, at the texels' centres along unit directions; 0 where nothing is hit.
    sample_map : (h, w, 4) uint16: the nearest points above the horizon of a place on the surface, nearest first, padded
        with NO_POINT.
    corner : row and column of the sample map's first texel in a grid of `grid` (rows, columns) over the light map's uv2
        in [0, 1]: texel (row, column) has its centre at uv2 = ((column + 1/2)/columns, (row + 1/2)/rows).
    offset_m : distance of the points from the surface.
    volume : whether points fill the bounding box of the object and maps leave it out, so that another object may stand
        there. `normals` then point away from the centre of the box.
    cover : (P, E, E) uint8, or None: bit 2 i + j is set where the quarter (row i, column j) of a texel shows a surface;
        other quarters show the sky, whatever the texel's distance. A texel with a surface has its light and its
        distance.
    glass : the refraction of the object's transmitted light, or None; with it, maps leave the object out.
    blocks : (P, B, B, 4) uint32, or None: radiance as stored in blocks, by `baked.light_fields.blocks.blocks`.
    distances : (P, R, B, 2) uint32, or None: inverse_distance and cover as stored in blocks, by
        `baked.light_fields.blocks.blocks`.
    """

    points: NDArray[np.float32]
    normals: NDArray[np.float32]
    radiance: Maps
    inverse_distance: Maps
    sample_map: NDArray[np.uint16]
    corner: tuple[int, int]
    grid: tuple[int, int]
    offset_m: float
    blocks: NDArray[np.uint32] | None = None
    volume: bool = False
    glass: Glass | None = None
    cover: Maps | None = None
    distances: NDArray[np.uint32] | None = None

    @property
    def without_object(self) -> bool:
        """Whether the maps leave the object out."""
        return self.volume or self.glass is not None
