"""Numbers of pairs of bands from the steps between them, as the contract of stores describes them."""

from __future__ import annotations

import numpy as np


def pair_numbers(counts: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """(N,) pairs j K + k of entries, point after point: counts (P,) of entries, steps (N,)."""
    reached = np.concatenate([[0], np.cumsum(steps.astype(np.int64))])
    begins = np.cumsum(counts) - counts
    return reached[1:] - np.repeat(reached[begins], counts) - 1
