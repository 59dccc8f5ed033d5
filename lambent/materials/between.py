"""Interpolation between two materials, for animated changes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lambent.materials.document import Lobe, Material


def between(first: Material, second: Material, share: float) -> Material:
    """Interpolate from the first material (`share` 0) to the second (`share` 1).

    Diffuse coefficients are linear, like the reflectance and transmittance of paints mixed pixel by pixel. Lobe
    parameters are linear if both materials have the same number and kinds of lobes in the same order; otherwise the
    first material's lobes stay until `share` is 1, as does everything that is not a number.
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
