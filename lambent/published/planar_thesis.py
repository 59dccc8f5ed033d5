"""The estimate of thesis M on planar reflectors (4.24, 4.25, 4.5.3): rings within a lobe's border, one filter each."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from lambent.core.arrays import Floats
from lambent.materials.document import Lobe
from lambent.realtime.integrators import patterns
from lambent.realtime.integrators.integrators import Integrator
from lambent.realtime.planar.planar_integrators import PLANAR

MOST_RINGS = 3


def multi_ring_table(lobe: Lobe, n: int) -> Floats:
    """The thesis's pattern on planes (4.5.3): a centre and up to three rings of equal count, evenly spaced radii.

    Lobes much longer than wide keep the line. As in the thesis's figure, n = 10 has 3 rings of 3.
    """
    rings = next((r for r in range(MOST_RINGS, 1, -1) if n > 1 and (n - 1) % r == 0 and (n - 1) // r >= 3), 1)
    count = (n - 1) // rings
    shares: list[Floats] = [np.zeros((1, 2))]
    for ring in range(rings if count else 0):
        phi = 2 * np.pi * (np.arange(count) + ring / rings) / count
        shares.append(patterns.polar((ring + 1) / (rings + 1), phi))
    return patterns.lobe_table_at(lobe, np.concatenate(shares))


@contextmanager
def offered() -> Iterator[None]:
    """Draw the estimate on planar reflectors by the thesis's integrators, which else show probes there."""
    shader = "planar_thesis.wgsl"
    made = {f"lobe-4.{n}": Integrator(shader, multi_ring_table, {"FORMULA": n}) for n in (24, 25)}
    PLANAR.update(made)
    try:
        yield
    finally:
        for name in made:
            del PLANAR[name]
