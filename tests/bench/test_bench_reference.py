"""How far images are from their reference, where few pixels are compared."""

from __future__ import annotations

import numpy as np

from lambent.bench.measuring.reference import Reference


def test_errors_count_where_few_pixels_are_compared() -> None:
    radiance = np.random.default_rng(1).uniform(0.5, 2, (48, 64, 3))
    shown = np.zeros((48, 64), bool)
    shown[20:26, 30:40] = True
    reference = Reference.of(radiance, shown)
    errors = reference.errors(radiance * [0.7, 1.0, 1.3])
    assert errors["flip_shown"] > 0.05 and errors["psnr"] < 30
    assert reference.errors(radiance)["flip"] == 0
