"""Interpolation between two materials, for animated changes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from lambent.materials.document import Lobe, Material
from lambent.materials.slope_curve import ROW, slope_table


def between(first: Material, second: Material, share: float) -> Material:
    """Interpolate from the first material (`share` 0) to the second (`share` 1).

    Diffuse coefficients are linear, like the reflectance and transmittance of paints mixed pixel by pixel. Lobe
    parameters are linear (densities: their logarithms) if both materials have the same number and kinds of lobes in the
    same order; otherwise the first material's lobes stay until `share` is 1, as does everything that is not a number.
    """
    if share <= 0:
        return first
    if share >= 1:
        return second
    changes: dict[str, Any] = {
        name: _mean(getattr(first, name), getattr(second, name), share) for name in ("kd", "kt_d")
    }
    if first.kd_curve is not None and second.kd_curve is not None:
        changes["kd_curve"] = _mean(first.kd_curve, second.kd_curve, share)
    if [_kind(lobe) for lobe in first.lobes] == [_kind(lobe) for lobe in second.lobes]:
        changes["lobes"] = tuple(_lobe(a, b, share) for a, b in zip(first.lobes, second.lobes, strict=True))
    return first.model_copy(update=changes)


def _kind(lobe: Lobe) -> tuple[str, str, bool]:
    return lobe.kind, lobe.distribution, lobe.fresnel is None


def _lobe(first: Lobe, second: Lobe, share: float) -> Lobe:
    colours = {name: _mean(getattr(first, name), getattr(second, name), share) for name in ("k", "r0")}
    widths = {
        name: (1 - share) * getattr(first, name) + share * getattr(second, name) for name in ("mx", "my", "alpha")
    }
    curves: dict[str, Any] = {}
    if first.shape is not None and second.shape is not None:
        a, b = (slope_table(one)[::ROW] for one in (first.shape, second.shape))
        curves["shape"] = tuple(np.exp(_mean(a, b, share)).tolist())
    if first.fresnel is not None and second.fresnel is not None:
        curves["fresnel"] = tuple(_mean(a, b, share) for a, b in zip(first.fresnel, second.fresnel, strict=True))
    return first.model_copy(update={**colours, **widths, **curves})


def _mean(first: Iterable[float], second: Iterable[float], share: float) -> tuple[float, ...]:
    return tuple((1 - share) * a + share * b for a, b in zip(first, second, strict=True))
