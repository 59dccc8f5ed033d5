"""An offset surface light field: incident light at many points just above the surface of one object.

Spec: thesis R, "Offset surface light fields", chapter 3. What a store holds of it is in `store.contract`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats

Sky = Callable[[Floats], Floats]  # radiance (n, 3) of directions (n, 3) in which nothing is hit
NO_POINT = 0xFFFF  # in a sample map: no further point
NO_EXIT = -1.0  # in place of a distance: no face is behind
CANDIDATES = 4  # points that a texel of the sample map names at most
MOST_POINTS = NO_POINT  # indices are 16 bits wide
# By the bits of `LightField.cover`, the share of a texel that is sky while it has the light of a surface.
SKY_SHARE = np.array([0.0, *[1 - bits.bit_count() / 4 for bits in range(1, 16)]])
LEAST_TEXELS, MOST_TEXELS = 8, 1024  # along a side of a map


class Maps(Protocol):
    """Maps of all points, (P, E, E) or (P, E, E, C): an array, or what is decoded where it is read."""

    @property
    def shape(self) -> tuple[int, ...]: ...

    @property
    def dtype(self) -> np.dtype[Any]: ...

    @property
    def size(self) -> int: ...

    @property
    def nbytes(self) -> int: ...

    def __getitem__(self, key: Any, /) -> Any: ...

    def __array__(self) -> NDArray[Any]: ...


@dataclass(frozen=True, eq=False)
class Glass:
    """The second interface that light passes, which enters a thin piece of glass: thesis R, "Thin Lens Refractions".

    Parameters
    ----------
    exits : (h, w, 4) float16, by texel of the sample map: the normal of the face behind it, out of the glass, times the
        share of light that further faces of the object let pass at normal incidence; and its distance along the
        normal of the surface, in metres. The distance is -1 where no face is behind: the surface is a sheet.
    eta : index of refraction, inside over outside.
    tint : the share of light that an interface lets pass at normal incidence, RGB.
    power : of the cosine, by which an interface lets less pass at others (`materials.clear`).
    """

    exits: NDArray[np.float16]
    eta: float
    tint: tuple[float, float, float]
    power: float


@dataclass(frozen=True, eq=False)
class LightField:
    """Points above an object, what each sees, and which of them are near a place on the surface.

    Parameters
    ----------
    points : (P, 3) float32, world space, metres: where the light was taken, off the surface.
    normals : (P, 3) float32, unit: the surface's normal below each point, along which it was moved out.
    radiance : (P, E, E, 3) float32 or float16: octahedral maps (core.octahedral) of incident radiance in world axes, in
        units of the scene's `unit`.
    inverse_distance : (P, E, E) float16, 1/m, at the texels' centres along unit directions; 0 where nothing is hit.
    sample_map : (h, w, 4) uint16: the nearest points that a place on the surface has above its horizon, nearest first,
        then NO_POINT.
    corner : row and column of the sample map's first texel in a grid of `grid` (rows, columns) over the light map's uv2
        in [0, 1]: texel (row, column) has its centre at uv2 = ((column + 1/2)/columns, (row + 1/2)/rows).
    offset_m : how far off the surface the points are.
    own_diffuse : whether the maps show the object itself without its lobes.
    volume : whether points fill a box that the object stands in, and maps are without it, so that another may stand
        there. `normals` point away from the middle of the box.
    cover : (P, E, E) uint8, or None: bit 2 i + j is set where the quarter (row i, column j) of a texel shows a surface;
        others show the sky, whatever the texel's distance is. A texel with a surface has its light and its distance.
    glass : what refracts the light that the object transmits, or None; maps are then without the object.
    blocks : (P, B, B, 4) uint32, or None: where a store has the radiance so, as `core.light_field_blocks` makes it.
    distances : (P, R, B, 2) uint32, or None: where a store has inverse_distance and cover so, as
        `core.light_field_blocks` makes it.
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
    own_diffuse: bool = False
    volume: bool = False
    glass: Glass | None = None
    cover: Maps | None = None
    distances: NDArray[np.uint32] | None = None

    @property
    def without_object(self) -> bool:
        """Whether the maps are without the object."""
        return self.volume or self.glass is not None
