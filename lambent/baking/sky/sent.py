"""Environments on their way to another process, which makes them from the scene and what was learnt of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mitsuba as mi

from lambent.baking.sky.bins import SkyBins
from lambent.baking.sky.guide import Learnt, SkyGuide, guided_sky


@dataclass(frozen=True, eq=False)
class SentSky:
    """What was learnt of a sky, in a scene between the corners `bounds`, if it is guided, and its sampling weight."""

    learnt: Learnt | None
    bounds: tuple[list[float], list[float]] | None
    weight: float

    @classmethod
    def of(cls, sky: Any) -> SentSky:
        """That of a mi.Emitter."""
        weight, guide = float(mi.traverse(sky)["sampling_weight"]), getattr(sky, "guide", None)
        if guide is None:
            return cls(None, None, weight)
        return cls(guide.learnt, ([*sky.bounds.min], [*sky.bounds.max]), weight)

    def like(self, sky: Any) -> Any:
        """mi.Emitter as it was sent; `sky` (mi.Emitter) has its picture."""
        if self.learnt is not None and self.bounds is not None:
            sky = guided_sky(sky, SkyGuide(SkyBins(sky), self.learnt), mi.ScalarBoundingBox3f(*self.bounds))
        parameters = mi.traverse(sky)
        parameters["sampling_weight"] = self.weight
        parameters.update()
        return sky
