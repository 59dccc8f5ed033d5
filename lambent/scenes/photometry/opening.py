"""The luminous opening of a luminaire: the shape that its light leaves.

Luminaire axes are those of type C photometry: x towards horizontal angle 0, y towards 90, z along the luminaire's axis,
away from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from lambent.core.arrays import Floats

Shape = Literal["point", "box", "cylinder", "ellipsoid"]
Size = tuple[float, float, float]
X, Y, Z = range(3)


@dataclass(frozen=True)
class Opening:
    """A shape centred on the photometric centre.

    Attributes
    ----------
    shape : Shape
        A box without extent in one direction is a rectangle, such a cylinder a disc, an ellipsoid of equal extents a
        sphere. Cross-sections of cylinders are ellipses.
    size_m : (x, y, z)
        Extents along the luminaire's axes, not negative; diameters where the shape is round.
    axis : int
        0, 1 or 2: of a cylinder, the luminaire's axis along which it lies.
    """

    shape: Shape = "point"
    size_m: Size = (0.0, 0.0, 0.0)
    axis: int = Z

    def projected_m2(self, towards: Floats) -> Floats:
        """Area of the shape's silhouette (...) seen from unit directions (..., 3) in luminaire axes, in m^2.

        Exact: the shapes are convex, so projected areas of the faces that are seen add up; an ellipsoid of half axes
        a, b, c has pi |(bc x, ca y, ab z)|.
        """
        w, size = np.abs(np.asarray(towards, float)), np.array(self.size_m)
        faces = w * [size[Y] * size[Z], size[Z] * size[X], size[X] * size[Y]]
        if self.shape == "ellipsoid":
            return np.asarray(np.pi / 4 * np.linalg.norm(faces, axis=-1))
        if self.shape != "cylinder":
            return np.asarray(faces.sum(axis=-1))
        sides = np.delete(faces, self.axis, axis=-1)
        return np.asarray(np.pi / 4 * faces[..., self.axis] + np.linalg.norm(sides, axis=-1))

    def __str__(self) -> str:
        if self.shape == "point":
            return "point"
        flat = self.size_m.count(0) == 1
        name = {"box": "rectangle", "cylinder": "disc"}.get(self.shape, self.shape) if flat else self.shape
        along = f" along {'xyz'[self.axis]}" * (self.shape == "cylinder" and not flat and self.axis != Z)
        return f"{name}{along}, {' x '.join(f'{x:g}' for x in self.size_m)} m"


POINT = Opening()


def opening_of_signs(width_m: float, length_m: float, height_m: float, ellipsoids: bool = False) -> Opening:
    """The opening that an IES file describes by signs: negative numbers are diameters.

    ANSI/IESNA LM-63-2002 and ANSI/IES LM-63-19, table of luminous opening shapes: none negative is a rectangle or box,
    two a cylinder along the third, all an ellipsoid. The length is measured along horizontal angle 0, the width along
    90. Files up to 1995 leave the second diameter of a circle out (0); in them, a negative height beside a negative
    width or length makes `ellipsoids`.
    """
    given, size = (length_m, width_m, height_m), [abs(length_m), abs(width_m), abs(height_m)]
    if not any(given):
        return POINT
    round_, straight = [k for k in range(3) if given[k] < 0], [k for k in range(3) if given[k] >= 0]
    if not round_:
        return Opening("box", _triple(size))
    if len(round_) == 1:  # up to 1995
        (known,) = round_
        axis = Z if known != Z else X if size[X] else Y
        other = 3 - axis - known
        size[other] = size[other] or size[known]
        return Opening("cylinder", _triple(size), axis)
    if len(round_) == 3 or (ellipsoids and Z in round_):
        return Opening("ellipsoid", _triple([extent or max(size) for extent in size]))
    return Opening("cylinder", _triple(size), straight[0])


def _triple(size: Sequence[float]) -> Size:
    x, y, z = map(float, size)
    return x, y, z
