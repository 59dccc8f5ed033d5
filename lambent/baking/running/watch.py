"""Observers of a bake, notified as soon as light is finished."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags


class Watch:
    """Base class of observers; ignores all notifications.

    Attributes
    ----------
    region_pause : float or None
        Pause between regions of the light map, as a multiple of the time that finishing one took. None: no
        regions.
    """

    region_pause: float | None = None

    def arrived(self, kind: str, names: Collection[str]) -> None:
        """Arrays of a kind that the store now has for the current scene, including those it had before.

        A kind is reported when it is complete; probes are also reported one by one. A name may be reported twice.
        """

    def region(self, light: NDArray[np.float16], finished: Flags) -> None:
        """The front of the light map by light group (n, H, W, 3), float16; n is 1 if light is not separated.

        It is valid where all samples are done, `finished` (H, W). Texels next to unfinished ones may change slightly
        until the light map arrives, which closes its seams.
        """
