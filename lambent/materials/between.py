"""Materials between two others, for what changes with time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lambent.materials.document import Lobe, Material


def between(first: Material, second: Material, share: float) -> Material:
    """The material `share` of the way, 0 to 1, from the first to the second.

    Diffuse coefficients change evenly, as linear reflectance and transmittance do where paints are mixed pixel by
    pixel. So do the numbers of lobes where both have as many, of the same kinds and in the same order; else lobes are
    those of the first until the second is reached, and so is everything that is no number.
    """
    if share <= 0:
        return first
    if share >= 1:
        return second
    changes: dict[str, Any] = {
        name: _mean(getattr(first, name), getattr(second, name), share) for name in ("kd", "kt_d")
    }
    if [_kind(lobe) for lobe in first.lobes] == [_kind(lobe) for lobe in second.lobes]:
        changes["lobes"] = tuple(_lobe(a, b, share) for a, b in zip(first.lobes, second.lobes, strict=True))
    return first.model_copy(update=changes)


def _kind(lobe: Lobe) -> tuple[str, str]:
    return lobe.kind, lobe.distribution


def _lobe(first: Lobe, second: Lobe, share: float) -> Lobe:
    colours = {name: _mean(getattr(first, name), getattr(second, name), share) for name in ("k", "r0")}
    widths = {
        name: (1 - share) * getattr(first, name) + share * getattr(second, name) for name in ("mx", "my", "alpha")
    }
    return first.model_copy(update={**colours, **widths})


def _mean(first: Sequence[float], second: Sequence[float], share: float) -> tuple[float, ...]:
    return tuple((1 - share) * a + share * b for a, b in zip(first, second, strict=True))
