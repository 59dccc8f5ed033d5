"""Bands and tails of a scene's materials for a series of bounces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lambent.baked.transport.tails import FIXED, SecondBands, Tails
from lambent.baking.interreflection.settings import Bounces
from lambent.materials.factored.terms import Editable, Factor, Term
from lambent.scenes.scene import Scene

SMOOTH, SMOOTH_OF_TWO = 4, 8  # bands of curves over angles without narrow peaks
SMOOTH_ANGLES = ("theta_i", "theta_o", "theta_d")


@dataclass(frozen=True)
class Bins:
    """Bins for the light of a material's points.

    `terms` are those of its first surface with the bands of their curves; empty for an uneditable material.
    """

    editable: Editable
    terms: tuple[tuple[Term, tuple[tuple[Factor, int], ...]], ...] = ()

    @property
    def bands(self) -> list[int]:
        """Numbers of bands per term; for an uneditable material, one."""
        return [int(np.prod([n for _, n in factors], dtype=int)) for _, factors in self.terms] or [1]


def used_materials(scene: Scene) -> list[str]:
    """Names of the materials that objects use."""
    return list(dict.fromkeys(o.material for o in scene.objects))


def bins_of(editables: Mapping[str, Editable], bounces: Bounces) -> dict[str, Bins]:
    """Bins of materials, by name."""
    sharp = bounces.series[0]
    return {
        name: Bins(one, () if name in bounces.fixed else tuple((t, _factors(t, sharp)) for t in one.terms))
        for name, one in editables.items()
    }


def tails_of(editables: Mapping[str, Editable], bounces: Bounces) -> Tails:
    """The tails of materials: one slot per side of editable ones, and one for all others."""
    edited = {name: one for name, one in editables.items() if name not in bounces.fixed}
    slots = []
    for name, one in edited.items():
        slots += [(name, side) for side in one.sides]
    second: list[SecondBands] = []
    if bounces.series[1] > 1:
        for name, one in edited.items():
            for number, term in enumerate(one.terms):
                counts = tuple(n for _, n in _factors(term, bounces.series[1]))
                second.append(SecondBands(name, number, counts))
    if len(edited) < len(editables):
        slots.append(("", FIXED))
        second += [SecondBands("", 0, ())] if bounces.series[1] > 1 else []
    return Tails(tuple(slots), len(bounces.series), tuple(second))


def _factors(term: Term, sharp: int) -> tuple[tuple[Factor, int], ...]:
    smooth = SMOOTH if len(term.factors) < 2 else SMOOTH_OF_TWO
    return tuple((f, min(smooth, sharp) if f.over in SMOOTH_ANGLES else sharp) for f in term.factors)
