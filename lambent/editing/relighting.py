"""Relighting: the same incremental pictures the other way, with BRDFs fixed and the environment turned or changed.

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
    """A picture under an environment that changes.

    Parameters
    ----------
    tree
        The N triangles that light the scene.
    transport : (N, 3, P) float32, or SparseRows
        Radiance of the P pixels that each triangle makes with a radiance of 1; or the wavelets of that.
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
        """Whether the picture shows all of the light."""
        return self._picture.is_exact

    @property
    def picture(self) -> Pixels:
        """(3, P) float32, linear radiance."""
        return self._picture.picture * np.float32(self._unit)

    def light(self, radiance: Floats) -> None:
        """Let the picture go to an environment of radiance (N, 3), by frames (`step`) or at once (`draw`)."""
        self._picture.want(self._tree.of_radiance(np.asarray(radiance, float)))

    def step(self, terms: int = TERMS) -> None:
        """One frame: of each level of wavelets the largest changes, or the level anew, whichever errs less."""
        self._picture.step(terms)

    def draw(self) -> None:
        """The exact picture at once."""
        self._picture.draw()
