"""Compiled loop of the change of radiance that probes see after edits of materials."""

from __future__ import annotations

import numba
import numpy as np

from lambent.core.kernels import parallel


@parallel()
def change(found, places, texels, material, other, sun, group_of_sun, before, now):  # type: ignore[no-untyped-def]
    """Write to `found` (G, N, 3), at `places` (n,), how the exitance that a probe sees differs between two states.

    `texels` (n,) are the light map's texels seen, with a `material` and a texel on the `other` side (T,), -1 without.
    `sun` (n, 3) is direct irradiance on the seen side, negative if it is on the other, in the group `group_of_sun`.
    `before` and `now` are irradiance (G, T, 3), factors of the texels seen (n, 3), and albedos (M, 3) of reflection and
    transmission.
    """
    light_before, tint_before, reflected_before, transmitted_before = before
    light_now, tint_now, reflected_now, transmitted_now = now
    none = np.float32(0)
    for k in numba.prange(len(places)):
        texel = texels[k]
        one, across = material[texel], other[texel]
        for group in range(found.shape[0]):
            for c in range(3):
                straight = sun[k, c] if group == group_of_sun else none
                here, there = max(straight, none), max(-straight, none)
                was = reflected_before[one, c] * (light_before[group, texel, c] + here)
                new = reflected_now[one, c] * (light_now[group, texel, c] + here)
                if across >= 0:
                    was += transmitted_before[one, c] * (light_before[group, across, c] + there)
                    new += transmitted_now[one, c] * (light_now[group, across, c] + there)
                found[group, places[k], c] = tint_now[k, c] * new - tint_before[k, c] * was
