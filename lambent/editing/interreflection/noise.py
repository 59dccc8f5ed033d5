"""Noise of interreflections, from two pictures of which the second has the samples of the first and more."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lambent.core.colour import luminance
from lambent.editing.interreflection.folding import Cells
from lambent.editing.interreflection.picture import frozen_light
from lambent.editing.interreflection.powers import powers
from lambent.editing.interreflection.stored import Interreflections
from lambent.editing.products import Pixels
from lambent.materials.factored.terms import Editable


def light_of(light: Interreflections, materials: Mapping[str, Editable]) -> Pixels:
    """(3, P) interreflections of all points with these materials, part after part, in W/(sr m^2)."""
    frozen = powers(light.tails, materials, "")  # no material is edited: the one monomial is 1
    all_tails = Cells.of(frozen, np.arange(len(light.tails)))
    parts = [frozen_light(part, materials[name], frozen, all_tails)[0] for name, part in light.parts.items()]
    return np.concatenate(parts, axis=1)


def noise(before: Pixels, after: Pixels, samples: tuple[int, int]) -> float:
    """Standard error of the luminance of a point in `after`, as a share of its mean over all points.

    With variance s of a sample, n samples before and m after, the difference has s (1/n - 1/m), and `after` s/m.
    """
    fewer, more = samples
    difference, mean = luminance((after - before).T), float(luminance(after.T).mean())
    variance = float(np.mean(np.square(difference))) * fewer / (more - fewer)
    return float(variance**0.5 / max(mean, 1e-30))
