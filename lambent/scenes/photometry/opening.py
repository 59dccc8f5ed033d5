"""The luminous opening of a luminaire: the shape that its light leaves.

Luminaire axes are those of type C photometry: x towards horizontal angle 0, y towards 90, z along the luminaire's axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.plain import Triple, triple

X, Y, Z = range(3)


@dataclass(frozen=True)
class Opening:
    """A shape centred on the photometric centre.

    Attributes
    ----------
    shape : str
        A box without extent in one direction is a rectangle, such a cylinder a disc, an ellipsoid of equal extents a
        sphere. Cross-sections of cylinders are ellipses.
    size_m : (x, y, z)
        Extents along the luminaire's axes, not negative; diameters where the shape is round.
    axis : int
        0, 1 or 2: of a cylinder, the luminaire's axis along which it lies.
    """

    shape: Literal["point", "box", "cylinder", "ellipsoid"] = "point"
    size_m: Triple = (0.0, 0.0, 0.0)
    axis: int = Z

    def projected_m2(self, towards: Floats) -> Floats:
        """Area in m^2 of the shape's silhouette (...) seen from unit directions (..., 3) in luminaire axes.

        Exact: the shapes are convex, so projected areas of the faces that are seen add up; an ellipsoid of half axes
        a, b, c has pi |(bc x, ca y, ab z)|.
        """
        x, y, z = self.size_m
        faces = np.abs(np.asarray(towards, float)) * (y * z, z * x, x * y)
        if self.shape == "ellipsoid":
            return np.asarray(np.pi / 4 * np.linalg.norm(faces, axis=-1))
        if self.shape != "cylinder":
            return np.asarray(faces.sum(axis=-1))
        sides = np.linalg.norm(np.delete(faces, self.axis, axis=-1), axis=-1)
        return np.asarray(np.pi / 4 * faces[..., self.axis] + sides)

    def __str__(self) -> str:
        flat = {"box": "rectangle", "cylinder": "disc"} if self.size_m.count(0) == 1 else {}
        along = f" along {'xyz'[self.axis]}" if self.shape == "cylinder" and self.axis != Z and not flat else ""
        size = f", {' x '.join(f'{x:g}' for x in self.size_m)} m" if self.shape != "point" else ""
        return flat.get(self.shape, self.shape) + along + size


POINT = Opening()


def opening_of_signs(width_m: float, length_m: float, height_m: float, ellipsoids: bool = False) -> Opening:
    """The opening that an IES file describes by signs: negative numbers are diameters.

    ANSI/IESNA LM-63-2002 and ANSI/IES LM-63-19, table of luminous opening shapes: none negative is a rectangle or box,
    two a cylinder along the third, all an ellipsoid. The length is measured along horizontal angle 0, the width along
    90. Files up to 1995 leave the second diameter of a circle out (0); in them, a negative height beside a negative
    width or length makes `ellipsoids`.
    """
    given, size = (length_m, width_m, height_m), [abs(length_m), abs(width_m), abs(height_m)]
    negative = [k for k in (X, Y, Z) if given[k] < 0]
    if not negative:
        return Opening("box", triple(size)) if any(size) else POINT
    if len(negative) == 1:  # up to 1995
        axis = Z if negative != [Z] else X if size[X] else Y
        (other,) = {X, Y, Z} - {axis, *negative}
        size[other] = size[other] or size[negative[0]]
        return Opening("cylinder", triple(size), axis)
    if len(negative) == 3 or (ellipsoids and Z in negative):
        return Opening("ellipsoid", triple([extent or max(size) for extent in size]))
    (axis,) = {X, Y, Z} - {*negative}
    return Opening("cylinder", triple(size), axis)
