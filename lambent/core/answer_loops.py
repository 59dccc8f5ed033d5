"""Compiled loops of `answer`: light between patches, exitance of points, gathering, and interpolation at texels.

Light of points is (K, G, 4) float32, groups side by side, so that a ray reads the light of all groups from one place.
The fourth channel is padding; it lets the processor add all channels of a group in one vector (`by_lanes`).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from threading import Lock
from typing import Any, cast

import numba
import numpy as np

NO_LIGHT = np.float32(1e-30)
_COMPILING, _NUMBA = Lock(), cast(Any, numba.config)


def by_lanes(loop: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a loop with LLVM's SLP vectorizer, which Numba leaves out: sums over channels become vector sums."""
    compiled = numba.njit(parallel=True, cache=True, nogil=True)(loop)

    @wraps(loop)
    def called(*arguments: Any) -> Any:
        if compiled.signatures:
            return compiled(*arguments)
        with _COMPILING:
            before, _NUMBA.SLP_VECTORIZE = _NUMBA.SLP_VECTORIZE, 1
            try:
                return compiled(*arguments)
            finally:
                _NUMBA.SLP_VECTORIZE = before

    return called


@numba.njit(parallel=True, cache=True, nogil=True)
def solve(starts, ends, senders, shares, direct, reflected, transmitted, paired, tolerance, sweeps, light):  # type: ignore[no-untyped-def]
    """Bring light (G, P, 3) to B = F (a (D + B) + t (D + B) of the other side) + D by Gauss-Seidel sweeps.

    F is sparse by group and row: `senders` and `shares` from `starts` to `ends` (G, P). Each group stops when no patch
    changes by more than `tolerance` of its light. Returns (G,) the number of sweeps, and (G,) whether each converged.
    """
    groups, patches = light.shape[:2]
    taken, done = np.zeros(groups, np.int64), np.zeros(groups, np.bool_)
    for group in numba.prange(groups):
        sent = np.empty((patches, 3), np.float32)
        for p in range(patches):
            for c in range(3):
                other = light[group, paired[p], c] * transmitted[p, c]
                sent[p, c] = light[group, p, c] * reflected[p, c] + other
        while taken[group] < sweeps and not done[group]:
            taken[group] += 1
            stands = True
            for p in range(patches):
                red = green = blue = np.float32(0)
                for k in range(starts[group, p], ends[group, p]):
                    q, share = senders[k], shares[k]
                    red += share * sent[q, 0]
                    green += share * sent[q, 1]
                    blue += share * sent[q, 2]
                other = paired[p]
                for c, arrived in enumerate((red, green, blue)):
                    new = max(direct[group, p, c] + arrived, np.float32(0))  # an equivalent albedo may be negative
                    # `not <=` instead of `>`: NaN, the difference of infinities, must not count as converged.
                    if not abs(new - light[group, p, c]) <= tolerance * new + NO_LIGHT:
                        stands = False
                    light[group, p, c] = new
                    sent[p, c] = new * reflected[p, c] + light[group, other, c] * transmitted[p, c]
                    if other != p:
                        sent[other, c] = light[group, other, c] * reflected[other, c] + new * transmitted[other, c]
            done[group] = stands
    return taken, done


@numba.njit(parallel=True, cache=True, nogil=True)
def exitance(direct, light, ratio, of, other, reflected, transmitted):  # type: ignore[no-untyped-def]
    """Exitance (K, G, 4) of points whose indirect light is the baked times ratio (n, G, 4) at index `of` (K,)."""
    groups, points = direct.shape[:2]
    found = np.zeros((points, groups, 4), np.float32)
    for k in numba.prange(points):
        there = other[k]
        for group in range(groups):
            for c in range(3):
                at = direct[group, k, c]
                sent = reflected[k, c] * (at + (light[group, k, c] - at) * ratio[of[k], group, c])
                if there != k:
                    at = direct[group, there, c]
                    now = at + (light[group, there, c] - at) * ratio[of[there], group, c]
                    sent += transmitted[k, c] * now
                found[k, group, c] = sent
    return found


@numba.njit(parallel=True, cache=True, nogil=True)
def ratios(now, baked, least, most_ratio):  # type: ignore[no-untyped-def]
    """`answer.ratios` of light of points (K, G, 4); 1 where the baked light is at most `least` (G,)."""
    found = np.ones(now.shape, np.float32)
    for k in numba.prange(len(now)):
        for group in range(now.shape[1]):
            for c in range(3):
                if baked[k, group, c] > least[group]:
                    ratio = now[k, group, c] / baked[k, group, c]
                    found[k, group, c] = min(max(ratio, np.float32(0)), most_ratio)
    return found


@numba.njit(parallel=True, cache=True, nogil=True)
def pack(numbers, weights, steps, one, rays):  # type: ignore[no-untyped-def]
    """`answer.packed_rays` into `rays` (K, R, 3), zeroed before, for rays to `numbers` (K, R) with `weights` (K, R)."""
    for k in numba.prange(len(numbers)):
        order = np.argsort(numbers[k])
        sums = np.zeros(len(order), np.float32)
        ends = np.zeros(len(order), np.int64)
        count, last = 0, np.int64(-1)
        for r in order:
            if weights[k, r] > 0:
                if numbers[k, r] != last:
                    last = numbers[k, r]
                    ends[count] = last
                    count += 1
                sums[count - 1] += weights[k, r]
        place, last = 0, np.int64(0)
        for n in range(count):
            # Steps are wide; dithered rounding to the byte above or below keeps sums of many weights right.
            dither = np.float32((n * 0.6180339887 + ends[n] * 0.7548776662) % 1)
            code = np.floor(np.log2(sums[n]) * steps + dither) + one
            if code >= 1:
                step = ends[n] - last
                rays[k, place, 0], rays[k, place, 1] = np.uint8(step & 255), np.uint8(step >> 8)
                rays[k, place, 2] = np.uint8(min(code, np.float32(255)))
                last = ends[n]
                place += 1


@numba.njit(parallel=True, cache=True, nogil=True)
def unpack(rays, starts, points, weights):  # type: ignore[no-untyped-def]
    """Points and weights (N,) of packed rays (K, R, 3); those of row k begin at `starts` (K + 1,)."""
    for k in numba.prange(len(rays)):
        last = np.int64(0)
        for n in range(starts[k + 1] - starts[k]):
            last += np.int64(rays[k, n, 0]) | (np.int64(rays[k, n, 1]) << 8)
            points[starts[k] + n] = last
            weights[starts[k] + n] = rays[k, n, 2]


@by_lanes
def gather_one(starts, points, weights, table, scale, sent):  # type: ignore[no-untyped-def]
    """Sums (K, 1, 4) of exitance (n, 1, 4) at `points` (N,); those of row k begin at `starts` (K + 1,).

    `table` maps bytes to weights; `scale` (K,) multiplies the sums.
    """
    found = np.empty((len(scale), 1, 4), np.float32)
    for k in numba.prange(len(scale)):
        a0 = a1 = a2 = a3 = np.float32(0)
        for r in range(starts[k], starts[k + 1]):
            point, weight = points[r], table[weights[r]]
            a0 += weight * sent[point, 0, 0]
            a1 += weight * sent[point, 0, 1]
            a2 += weight * sent[point, 0, 2]
            a3 += weight * sent[point, 0, 3]
        by = scale[k]
        found[k, 0, 0], found[k, 0, 1], found[k, 0, 2], found[k, 0, 3] = a0 * by, a1 * by, a2 * by, a3 * by
    return found


@by_lanes
def gather_four(starts, points, weights, table, scale, sent, first, found):  # type: ignore[no-untyped-def]
    """Likewise for four groups from `first` on, into found (K, G, 4); the last group repeats if fewer are left."""
    last = sent.shape[1] - 1
    two, three, four = min(first + 1, last), min(first + 2, last), min(first + 3, last)
    for k in numba.prange(len(scale)):
        a0 = a1 = a2 = a3 = b0 = b1 = b2 = b3 = np.float32(0)
        c0 = c1 = c2 = c3 = d0 = d1 = d2 = d3 = np.float32(0)
        for r in range(starts[k], starts[k + 1]):
            point, weight = points[r], table[weights[r]]
            a0 += weight * sent[point, first, 0]
            a1 += weight * sent[point, first, 1]
            a2 += weight * sent[point, first, 2]
            a3 += weight * sent[point, first, 3]
            b0 += weight * sent[point, two, 0]
            b1 += weight * sent[point, two, 1]
            b2 += weight * sent[point, two, 2]
            b3 += weight * sent[point, two, 3]
            c0 += weight * sent[point, three, 0]
            c1 += weight * sent[point, three, 1]
            c2 += weight * sent[point, three, 2]
            c3 += weight * sent[point, three, 3]
            d0 += weight * sent[point, four, 0]
            d1 += weight * sent[point, four, 1]
            d2 += weight * sent[point, four, 2]
            d3 += weight * sent[point, four, 3]
        by = scale[k]
        found[k, four, 0], found[k, four, 1], found[k, four, 2], found[k, four, 3] = d0 * by, d1 * by, d2 * by, d3 * by
        found[k, three, 0], found[k, three, 1] = c0 * by, c1 * by
        found[k, three, 2], found[k, three, 3] = c2 * by, c3 * by
        found[k, two, 0], found[k, two, 1], found[k, two, 2], found[k, two, 3] = b0 * by, b1 * by, b2 * by, b3 * by
        found[k, first, 0], found[k, first, 1] = a0 * by, a1 * by
        found[k, first, 2], found[k, first, 3] = a2 * by, a3 * by


@by_lanes
def upsampled(light, points, shares):  # type: ignore[no-untyped-def]
    """Weighted means (G, T, 3), over the points (T, 8) near each texel, of light (K, G, 4)."""
    groups = light.shape[1]
    found = np.empty((groups, len(points), 3), np.float32)
    for t in numba.prange(len(points)):
        total = np.float32(0)
        for n in range(points.shape[1]):
            total += np.float32(shares[t, n])
        for group in range(groups):
            a0 = a1 = a2 = a3 = np.float32(0)
            for n in range(points.shape[1]):
                at, share = points[t, n], np.float32(shares[t, n])
                a0 += share * light[at, group, 0]
                a1 += share * light[at, group, 1]
                a2 += share * light[at, group, 2]
                a3 += share * light[at, group, 3]
            found[group, t, 0], found[group, t, 1], found[group, t, 2] = a0 / total, a1 / total, a2 / total
    return found


@by_lanes
def texel_light(points, shares, edited, reference, direct, baked, least, most_ratio, most_excess):  # type: ignore[no-untyped-def]
    """`answer.answered` at texels (G, T, 3), from means of `edited` (K, G, 4) over the points near each texel."""
    found = np.empty(direct.shape, np.float32)
    groups, near = direct.shape[0], points.shape[1]
    for t in numba.prange(direct.shape[1]):
        total = np.float32(0)
        for n in range(near):
            total += np.float32(shares[t, n])
        for group in range(groups):
            a0 = a1 = a2 = a3 = np.float32(0)
            for n in range(near):
                place, share = points[t, n], np.float32(shares[t, n])
                a0 += share * edited[place, group, 0]
                a1 += share * edited[place, group, 1]
                a2 += share * edited[place, group, 2]
                a3 += share * edited[place, group, 3]
            for c, now in enumerate((a0, a1, a2)):
                then, at = reference[group, t, c], direct[group, t, c]
                ratio = np.float32(1)
                if then > least[group]:
                    ratio = min(max(now / (total * then), np.float32(0)), most_ratio)
                indirect = baked[group, t, c] - at
                light = at + indirect * ratio
                excess = indirect - most_excess * then
                if excess > 0 and ratio > 1:
                    light -= excess * (ratio - np.float32(1))
                found[group, t, c] = light
    return found
