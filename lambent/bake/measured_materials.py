"""Materials that are measured tables: while a scene is baked they scatter as the table says, not as their document.

The renderer shows the document, a fit of the table; the light of the bake is that of the measurement.
"""

from __future__ import annotations

from collections.abc import Mapping

from lambent.core.frames import Floats
from lambent.core.progress import Progress, silent
from lambent.materials.measured.half_vector_grid import HalfVectorGrid, Sheet, grid_of
from lambent.materials.measured.registry import load
from lambent.scenes.scene import Scene


class _Reversed(Sheet):
    """Light and viewer exchanged: what a photon meets, whose `si.wi` is where the light comes from."""

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        return super().eval(wo, wi)


def grids_of(scene: Scene, *, photons: bool = False, progress: Progress = silent) -> Mapping[str, HalfVectorGrid]:
    """The tables of a scene's materials, by the material's name; for `photons` with light and viewer exchanged.

    Raises
    ------
    UserError
        Where a file cannot be read.
    """
    worn = {o.material for o in scene.objects}
    tables = {name: load(file) for name, file in scene.measured.items() if name in worn}
    return {name: grid_of(_Reversed(table) if photons else table, None, progress) for name, table in tables.items()}
