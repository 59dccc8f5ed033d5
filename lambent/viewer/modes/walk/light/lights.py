"""The light mix in the window: of the Light panel, of saved views, and of recorded walks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import groupby

from lambent.core.light.light_mix import LightMix, MixTrack
from lambent.core.plain import Triple
from lambent.store.light_groups import LightGroupRecord
from lambent.viewer.edits.edits import MaterialEdits


@dataclass
class Lights:
    """The store's light `groups`, if any, and their mix, which belongs to the `edits` and shares their undo.

    `fields`: whether an object has a light field, which follows the mix only approximately.
    """

    groups: tuple[LightGroupRecord, ...] = ()
    edits: MaterialEdits = field(default_factory=lambda: MaterialEdits({}))
    fields: bool = False

    @property
    def mix(self) -> LightMix:
        """The mix of the panel."""
        return self.edits.light

    @mix.setter
    def mix(self, mix: LightMix) -> None:
        self.edits.mix(mix)

    def known(self, factors: Mapping[str, Triple]) -> dict[str, Triple]:
        """The part of a mix whose groups are in the store, which may have been baked again since."""
        names = {group.name for group in self.groups}
        return {name: factor for name, factor in factors.items() if name in names}


@dataclass
class RecordedLight:
    """Mixes and their times in seconds while a walk was recorded."""

    keys: list[tuple[float, LightMix]] = field(default_factory=list)
    last_s: float = 0.0

    def take(self, mix: LightMix, time_s: float) -> None:
        """Record the present mix; a changed mix also gets a key just before the change."""
        if self.keys and mix == self.keys[-1][1]:
            self.last_s = time_s
            return
        if self.keys and self.keys[-1][0] < self.last_s < time_s:
            self.keys.append((self.last_s, self.keys[-1][1]))
        self.keys.append((time_s, mix))
        self.last_s = time_s

    def track(self, began_s: float) -> MixTrack | None:
        """The track of the recording, with times from `began_s`; None if all light was as baked."""
        names = {name for _, mix in self.keys for name in mix.groups}
        groups = {}
        for name in sorted(names):
            keys = [(max(time_s - began_s, 0.0), mix.of(name)) for time_s, mix in self.keys]
            last_of_time = [list(same)[-1] for _, same in groupby(keys, key=lambda key: key[0])]
            groups[name] = tuple(last_of_time)
        return MixTrack(groups) if groups else None
