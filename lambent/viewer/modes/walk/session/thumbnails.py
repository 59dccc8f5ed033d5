"""Thumbnails of textures for lists: made one by one in a background thread, when a list first shows them."""

from __future__ import annotations

from collections.abc import Callable, Hashable

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from lambent.core.arrays import Floats
from lambent.core.light.colour import srgb_encode
from lambent.core.pictures.images import to_bytes
from lambent.viewer.background.work import Work, pending

SIDE = 18  # pixels, about the height of a line
ENOUGH = 8 * SIDE  # texels a side that a thumbnail is made from
Thumbnail = NDArray[np.uint8]  # (SIDE, SIDE, 3), as displayed
BLANK: Thumbnail = np.zeros((0, 0, 3), np.uint8)  # of an image that cannot be read


class Thumbnails:
    """Small pictures by key; `busy` while one is being made."""

    def __init__(self) -> None:
        self._made: dict[Hashable, Thumbnail] = {}
        self._work: Work | None = None

    @property
    def busy(self) -> bool:
        return self._work is not None

    def get(self, key: Hashable, reflectance: Callable[[], Floats]) -> Thumbnail | None:
        """The thumbnail (SIDE, SIDE, 3) of a texture, or None until it is made; BLANK if that fails.

        `reflectance` returns linear values (H, W, 3); it is called in the background, and may raise `UserError`.
        """
        self._work = pending(self._work)
        if key not in self._made and self._work is None:

            def keep(made: Thumbnail) -> None:
                self._made[key] = made

            self._work = Work(lambda _: thumbnail(reflectance()), keep, lambda _: keep(BLANK))
        return self._made.get(key)


def thumbnail(reflectance: Floats) -> Thumbnail:
    """Linear values (H, W, 3) as a displayed picture (SIDE, SIDE, 3); large textures are sampled."""
    height, width = reflectance.shape[:2]
    few = reflectance[:: max(1, height // ENOUGH), :: max(1, width // ENOUGH)].astype(np.float32)
    picture = Image.fromarray(to_bytes(srgb_encode(few)))
    return np.asarray(picture.resize((SIDE, SIDE), Image.Resampling.BOX))
