"""Looks of materials over time: for films whose surfaces change along a path."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

from lambent.core.errors import UserError
from lambent.materials.between import between
from lambent.scenes.scene import Look


@dataclass(frozen=True)
class LookTrack:
    """Looks of materials over time: by name, ascending times in seconds, each with a look.

    Between two times the numbers of a material are interpolated (`materials.between`), and light is computed for each
    moment: every frame shows a consistent room, where cross-fading two pictures would show both rooms at once. Textures
    are those of the earlier time. The first and the last look hold beyond the ends.
    """

    materials: Mapping[str, tuple[tuple[float, Look], ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, keys in self.materials.items():
            if not keys or any(b[0] <= a[0] for a, b in pairwise(keys)):
                raise UserError("times do not increase", field=name, got=[time_s for time_s, _ in keys])

    def looks_at(self, time_s: float) -> dict[str, Look]:
        """The look of each material that changes, at a time."""
        return {name: _look_at(keys, time_s) for name, keys in self.materials.items()}


def _look_at(keys: tuple[tuple[float, Look], ...], time_s: float) -> Look:
    after = next((number for number, key in enumerate(keys) if key[0] > time_s), len(keys))
    if after in (0, len(keys)):
        return keys[min(after, len(keys) - 1)][1]
    (begin_s, first), (end_s, second) = keys[after - 1], keys[after]
    share = (time_s - begin_s) / (end_s - begin_s)
    return Look(between(first.material, second.material, share), first.textures)
