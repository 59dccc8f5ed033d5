"""Where the sun shines, by texel of the light map: what a shadow map alone cannot tell along joints of thin sheets.

`light_map/sunlit` is 0 where no ray from the texel or its neighbours reaches the sun that the light map leaves out, and
1 everywhere else. It holds for the geometry and the direction in its notes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.store.contract import SunRecord
from lambent.store.store import Store

SUNLIT = "light_map/sunlit"
GEOMETRY = "geometry/positions"  # whose key says which geometry it is


def read_sunlit(store: Store, sun: SunRecord | None) -> NDArray[np.uint8] | None:
    """(H, W) uint8; None where a store has none for its geometry and sun, as earlier stores."""
    if sun is None or SUNLIT not in store or GEOMETRY not in store:
        return None
    found = store.artefact(SUNLIT)
    if found.meta.get("geometry") != store.artefact(GEOMETRY).key or found.meta.get("sun") != list(sun.direction):
        return None
    of_light = store.artefact("light_map/irradiance").shape[:2]
    if found.shape != of_light:
        raise store.broken(SUNLIT, got=found.shape, expected=f"{of_light}, as the light map")
    return store.read(SUNLIT)
