"""Relighting: incremental pictures with fixed BRDFs and an environment that rotates or changes.

picture = sum over wavelets of light of  coefficient * row          (Ben-Artzi 2007, section 7.3; Overbeck 2006)
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats
from lambent.editing.incremental import TERMS
from lambent.editing.per_band import PerBandPicture
from lambent.editing.products import Pixels
from lambent.editing.rows import Rows
from lambent.editing.sparse_rows import SparseRows
from lambent.scenes.triangle_wavelets import TriangleTree


class RelitPicture:
    """A picture under a changing environment.

    Parameters
    ----------
    tree
        The N triangles that light the scene.
    transport : (N, 3, P) float32, or SparseRows
        Radiance of the P pixels due to each triangle at radiance 1; or its wavelets.
    """

    def __init__(self, tree: TriangleTree, transport: Pixels | SparseRows) -> None:
        self._tree, self._unit = tree, 1.0
        if isinstance(transport, SparseRows):
            self._picture = PerBandPicture(transport, tree.levels)
        else:
            rows = Rows.of_wavelets(np.asarray(tree.of_transport(transport), np.float32))
            self._unit, self._picture = rows.unit, PerBandPicture(rows.values, tree.levels)

    @property
    def is_exact(self) -> bool:
        """Whether the picture shows the light exactly."""
        return self._picture.is_exact

    @property
    def picture(self) -> Pixels:
        """(3, P) float32, linear radiance."""
        return self._picture.picture * np.float32(self._unit)

    def light(self, radiance: Floats) -> None:
        """Set an environment of radiance (N, 3) as the target, approached by `step` and reached by `draw`."""
        self._picture.want(self._tree.of_radiance(np.asarray(radiance, float)))

    def step(self, terms: int = TERMS) -> None:
        """One frame: per level of wavelets, add the largest changes or redraw, whichever has the smaller error."""
        self._picture.step(terms)

    def draw(self) -> None:
        """Draw the exact picture at once."""
        self._picture.draw()
