"""Materials that are measured tables: while a scene is baked they scatter as the table says, not as their document.

The renderer shows the document, a fit of the table; the light of the bake is that of the measurement.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path

from lambent.core.files import sha256_of
from lambent.core.progress import Progress, silent
from lambent.materials.measured.patch_sheet import Lookup, lookup_of
from lambent.materials.measured.registry import load
from lambent.scenes.scene import Scene


def lookups_of(scene: Scene, *, photons: bool = False, progress: Progress = silent) -> Mapping[str, Lookup]:
    """The tables of a scene's materials, by the material's name; for `photons` with light and viewer exchanged.

    Raises
    ------
    UserError
        Where a file cannot be read.
    """
    worn = {o.material for o in scene.objects} & set(scene.measured)
    return {
        name: _lookup(scene.measured[name], sha256_of(scene.measured[name]), photons, progress) for name in sorted(worn)
    }


@functools.lru_cache(maxsize=8)
def _lookup(file: Path, digest: str, photons: bool, progress: Progress) -> Lookup:
    return lookup_of(load(file), None, progress, reverse=photons)
