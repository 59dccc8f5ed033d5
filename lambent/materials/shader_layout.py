"""Lobes in the buffer layout of lobes.wgsl: `struct LambentLobe`, 48 bytes each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.materials.document import Lobe

LOBE_DTYPE = np.dtype(
    [
        ("k", np.float32, 3),
        ("mx", np.float32),
        ("r0", np.float32, 3),
        ("my", np.float32),
        ("alpha", np.float32),
        ("side", np.uint32),
        ("distribution", np.uint32),
        ("unused", np.uint32),
    ]
)
SIDES = {"reflection": 0, "transmission": 1}
DISTRIBUTIONS = {"beckmann": 0, "ggx": 1}


def packed_lobes(lobes: Sequence[Lobe]) -> NDArray[Any]:
    """Structured array (N,) of `LOBE_DTYPE`, ready to be written to a storage buffer."""
    rows = [(o.k, o.mx, o.r0, o.my, o.alpha, SIDES[o.side], DISTRIBUTIONS[o.distribution], 0) for o in lobes]
    return np.array(rows, LOBE_DTYPE)
