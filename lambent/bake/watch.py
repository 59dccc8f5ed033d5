"""Who wants to see a bake's light before the bake is done: what is finished is told at once."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags


class Watch:
    """Told what is there; by itself it does nothing with it.

    Attributes
    ----------
    region_pause : float or None
        Regions of the light map are finished early, and again after so many times what that took. None: never.
    """

    region_pause: float | None = None

    def arrived(self, kind: str, names: Collection[str]) -> None:
        """Arrays of a kind that the store now holds for the scene as it is; those it held before are told, too.

        Kinds are told when they are whole, probes one by one as well. A name may be told twice.
        """

    def region(self, light: NDArray[np.float16], finished: Flags) -> None:
        """The front of the light map by light group (n, H, W, 3), float16; n is 1 where light is not sorted.

        It counts where all samples are there, `finished` (H, W). Texels beside unfinished ones may change a little
        until the light map arrives, which closes its seams.
        """
