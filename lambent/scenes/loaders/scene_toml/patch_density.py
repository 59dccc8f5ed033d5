"""Densities of a light field's points by Bezier patch, as a scene.toml gives them: a list, or a table by number."""

from __future__ import annotations

import math
import re
from typing import Any

# One number for each patch; or a table: first patch, last patch (numbered from 1), density.
PatchDensity = tuple[float, ...] | tuple[tuple[int, int, float], ...]
FORM = "a list with a number for each patch, or a table by number such as { 1 = 2.0, 5-8 = 0.5 }"
NUMBERS = re.compile(r"(\d{1,9})(?:-(\d{1,9}))?")


def patch_density_told(value: Any) -> PatchDensity:
    """Parse a value; `ValueError` if it is neither of both forms."""
    if isinstance(value, list | tuple) and value:
        return tuple(_density(one) for one in value)
    if not isinstance(value, dict) or not value:
        raise ValueError(f"must be {FORM}")
    rules = []
    for key, density in value.items():
        found = NUMBERS.fullmatch(str(key))
        first, last = (int(found[1]), int(found[2] or found[1])) if found else (0, 0)
        if not 1 <= first <= last:
            raise ValueError(f"{key!r} is no number of a patch, from 1, and no range of them such as 5-8")
        rules.append((first, last, _density(density)))
    return tuple(rules)


def densities_of(told: PatchDensity, count: int) -> tuple[float, ...]:
    """The density of each of an object's patches, 1 where a table has none; later keys win.

    Raises
    ------
    ValueError
        If the object has no patches or others, or none has a density.
    """
    if count == 0:
        raise ValueError("has no Bezier patches")
    listed = [one for one in told if not isinstance(one, tuple)]
    if listed and len(listed) != count:
        raise ValueError(f"has {count} patches; found {len(listed)} densities")
    found = listed or [1.0] * count
    for first, last, density in (one for one in told if isinstance(one, tuple)):
        if last > count:
            raise ValueError(f"has {count} patches; found patch {last}")
        found[first - 1 : last] = [density] * (last - first + 1)
    if max(found) == 0:
        raise ValueError("would have no points: every density is 0")
    return tuple(found)


def _density(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not (value >= 0 and math.isfinite(value)):
        raise ValueError(f"a density of {value!r} is not a number from 0")
    return float(value)
