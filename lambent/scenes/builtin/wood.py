"""A wood-grain texture: boards with the rings of a trunk cut lengthwise. It repeats without a seam."""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats

EARLY, LATE = np.array([0.46, 0.26, 0.115]), np.array([0.185, 0.078, 0.028])  # reflectance within a year's ring


def wood(height: int = 256, width: int = 512, boards: int = 4) -> Floats:
    """Reflectance (height, width, 3) of boards, their grain along the rows."""
    rng = np.random.default_rng(7)
    u = np.arange(width)[None, :] / width
    v = (np.arange(height)[:, None] + 0.5) / height
    board = np.floor(v * boards)
    own = rng.uniform(size=(3, boards))[:, board.astype(int)]  # of each board: place in the trunk, tone
    rings = 26 * v + 5.0 * own[0] + _waves(rng, u, v, 3, 5, 14) * (0.5 + own[1])
    t = rings - np.floor(rings)
    late = np.clip((t - 0.25) / 0.6, 0, 1) ** 2 * np.clip((1 - t) / 0.08, 0, 1)
    fibres = _waves(rng, u, v, 6, 110, 60)
    mix = np.clip(0.75 * late + 0.09 * fibres + 0.25 * (own[2] - 0.5), 0, 1)[..., None]
    joint = np.abs(v * boards - np.round(v * boards)) < boards / height
    return np.asarray(np.where(joint, 0.45, 1.0)[..., None] * (EARLY + (LATE - EARLY) * mix))


def _waves(rng: np.random.Generator, u: Floats, v: Floats, along: int, across: int, count: int) -> Floats:
    """Smooth periodic noise of standard deviation 1: waves of up to `along` and `across` periods."""
    m, n = rng.integers(-along, along + 1, count), rng.integers(max(1, across // 6), across + 1, count)
    phase = rng.uniform(0, 2 * np.pi, count)
    total = sum(np.cos(2 * np.pi * (m[i] * u + n[i] * v) + phase[i]) for i in range(count))
    return np.asarray(total * np.sqrt(2 / count))
