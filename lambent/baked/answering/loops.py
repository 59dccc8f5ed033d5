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

from lambent.core.kernels import parallel

NO_LIGHT = np.float32(1e-30)
LANES = 2048  # channels of points' light that a thread computes at a time
BLOCK = 128  # texels, whose light fits into the L1 cache
_COMPILING, _NUMBA = Lock(), cast(Any, numba.config)


def by_lanes(loop: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a loop with LLVM's SLP vectorizer, which Numba leaves out: sums over channels become vector sums."""
    compiled = parallel()(loop)

    @wraps(loop)
    def called(*arguments: Any) -> Any:
        if compiled.compiled.signatures:  # type: ignore[attr-defined]
            return compiled(*arguments)
        with _COMPILING:
            before, _NUMBA.SLP_VECTORIZE = _NUMBA.SLP_VECTORIZE, 1
            try:
                return compiled(*arguments)
            finally:
                _NUMBA.SLP_VECTORIZE = before

    return called


@by_lanes
def solve(starts, ends, senders, shares, direct, reflected, transmitted, paired, tolerance, sweeps, light):  # type: ignore[no-untyped-def]
    """Bring light (G, P, 3) to B = F (a (D + B) + t (D + B) of the other side) + D by Gauss-Seidel sweeps.

    F is sparse: `senders` and `shares` of each row run from `starts` to `ends` (P,). Each pass over the rows sums four
    groups, which stop together when no patch changes by more than `tolerance` of its light. Returns the number of
    sweeps of each four groups, and whether they converged.
    """
    groups, patches = light.shape[:2]
    fours = (groups + 3) // 4
    taken, done = np.zeros(fours, np.int64), np.zeros(fours, np.bool_)
    for four in numba.prange(fours):
        first, last = 4 * four, min(4 * four + 4, groups)
        sent, arrived = np.zeros((patches, 16), np.float32), np.empty(16, np.float32)
        for group in range(first, last):
            for p in range(patches):
                for c in range(3):
                    other = light[group, paired[p], c] * transmitted[p, c]
                    sent[p, 4 * (group - first) + c] = light[group, p, c] * reflected[p, c] + other
        while taken[four] < sweeps and not done[four]:
            taken[four] += 1
            stands = True
            for p in range(patches):
                a0 = a1 = a2 = a3 = a4 = a5 = a6 = a7 = np.float32(0)
                a8 = a9 = a10 = a11 = a12 = a13 = a14 = a15 = np.float32(0)
                for k in range(starts[p], ends[p]):
                    q, share = senders[k], shares[k]
                    a0 += share * sent[q, 0]
                    a1 += share * sent[q, 1]
                    a2 += share * sent[q, 2]
                    a3 += share * sent[q, 3]
                    a4 += share * sent[q, 4]
                    a5 += share * sent[q, 5]
                    a6 += share * sent[q, 6]
                    a7 += share * sent[q, 7]
                    a8 += share * sent[q, 8]
                    a9 += share * sent[q, 9]
                    a10 += share * sent[q, 10]
                    a11 += share * sent[q, 11]
                    a12 += share * sent[q, 12]
                    a13 += share * sent[q, 13]
                    a14 += share * sent[q, 14]
                    a15 += share * sent[q, 15]
                arrived[0], arrived[1], arrived[2], arrived[3] = a0, a1, a2, a3
                arrived[4], arrived[5], arrived[6], arrived[7] = a4, a5, a6, a7
                arrived[8], arrived[9], arrived[10], arrived[11] = a8, a9, a10, a11
                arrived[12], arrived[13], arrived[14], arrived[15] = a12, a13, a14, a15
                other = paired[p]
                for group in range(first, last):
                    for c in range(3):
                        lane = 4 * (group - first) + c
                        # An equivalent albedo may be negative.
                        new = max(direct[group, p, c] + arrived[lane], np.float32(0))
                        # `not <=` instead of `>`: NaN, the difference of infinities, must not count as converged.
                        if not abs(new - light[group, p, c]) <= tolerance * new + NO_LIGHT:
                            stands = False
                        light[group, p, c] = new
                        sent[p, lane] = new * reflected[p, c] + light[group, other, c] * transmitted[p, c]
                        if other != p:
                            across = light[group, other, c] * reflected[other, c]
                            sent[other, lane] = across + new * transmitted[other, c]
            done[four] = stands
    return taken, done


@by_lanes
def exitance(direct, indirect, grows, now, inverse, most_ratio, material, other, reflected, transmitted, before, step):  # type: ignore[no-untyped-def]
    """Exitance (K, G, 4) of points with albedos (M, 4), for indirect light `now` times `inverse` times the baked.

    All light is (K, G, 4). `indirect` is the baked light, and `grows` the part of it that is brightened. `inverse` is
    one over the reference of `now`, 0 where a ratio is meaningless. From exitance `before`, the result is `step` times
    the way.
    """
    points, groups = direct.shape[:2]
    lanes = points * groups * 4
    light, found = np.empty(lanes, np.float32), np.empty(direct.shape, np.float32)
    straight, shone, more = direct.reshape(-1), indirect.reshape(-1), grows.reshape(-1)
    bright, dimmed = now.reshape(-1), inverse.reshape(-1)
    for block in numba.prange((lanes + LANES - 1) // LANES):
        for i in range(LANES * block, min(LANES * block + LANES, lanes)):
            ratio = min(max(bright[i] * dimmed[i], np.float32(0)), most_ratio)
            ratio = ratio if dimmed[i] > 0 else np.float32(1)
            growth = max(ratio - np.float32(1), np.float32(0))
            light[i] = straight[i] + shone[i] * min(ratio, np.float32(1)) + more[i] * growth
    for k in numba.prange(points):
        one, there = material[k], other[k]
        for group in range(groups):
            at = 4 * (k * groups + group)
            for c in range(4):
                found[k, group, c] = reflected[one, c] * light[at + c]
            if there != k:
                at = 4 * (there * groups + group)
                for c in range(4):
                    found[k, group, c] += transmitted[one, c] * light[at + c]
            if step != np.float32(1):
                for c in range(4):
                    found[k, group, c] = before[k, group, c] + step * (found[k, group, c] - before[k, group, c])
    return found


@numba.njit(cache=True, nogil=True)
def nearest_code(weight, steps, one):  # type: ignore[no-untyped-def]
    """Byte (as a float, 0 for none) of the step nearest to a weight, in `steps` per octave from 1, coded `one`."""
    if weight <= 0:
        return 0.0
    below = np.floor(np.log2(weight) * steps)
    middle = (2.0 ** (below / steps) + 2.0 ** ((below + 1) / steps)) / 2
    return min(max(below + (weight > middle) + one, 0.0), 255.0)


@parallel()
def pack(numbers, weights, steps, one, rays):  # type: ignore[no-untyped-def]
    """`answer_rays.packed_rays` into `rays` (K, R, 3), zeroed before, for rays to `numbers` with `weights` (K, R)."""
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
        place, last, rest = 0, np.int64(0), 0.0
        for n in range(count):
            # Steps are wide; passing on what rounding leaves keeps sums of weights right.
            code = nearest_code(sums[n] + rest, steps, one)
            rest += sums[n]
            if code >= 1:
                rest -= 2.0 ** ((code - one) / steps)
                step = ends[n] - last
                rays[k, place, 0], rays[k, place, 1] = np.uint8(step & 255), np.uint8(step >> 8)
                rays[k, place, 2] = np.uint8(code)
                last = ends[n]
                place += 1


@parallel()
def thin(starts, points, weights, table, light, steps, one, chosen, codes):  # type: ignore[no-untyped-def]
    """Sample n rays of each row k, which begin at `starts` (K + 1,), into indices `chosen` and weights `codes` (K, n).

    Systematic sampling merges repeated rays; unused entries stay 0. The probability of a ray is the mean of its share
    of the row's weights and its share of the gathered light, from exitance `light` (m,).
    """
    count = chosen.shape[1]
    for k in numba.prange(len(chosen)):
        weighed = lit = np.float32(0)
        for r in range(starts[k], starts[k + 1]):
            weighed += table[weights[r]]
            lit += table[weights[r]] * light[points[r]]
        shift = (k * 0.6180339887) % 1
        total, taken, place, rest = 0.0, 0, 0, 0.0
        for r in range(starts[k], starts[k + 1]):
            weight = table[weights[r]]
            chance = weight / weighed
            if lit > 0:
                chance = 0.5 * chance + 0.5 * weight * light[points[r]] / lit
            total += chance
            before = taken
            while taken < count and taken + shift < total * count:
                taken += 1
            if taken > before:
                value = weight * (taken - before) / (count * chance)
                code = max(nearest_code(value + rest, steps, one), 1.0)
                rest += value - 2.0 ** ((code - one) / steps)
                chosen[k, place] = r
                codes[k, place] = np.uint8(code)
                place += 1


@parallel()
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
def gather_four(starts, points, weights, table, scale, sent):  # type: ignore[no-untyped-def]
    """Likewise for four groups side by side: sums (K, 16) of exitance (n, 16)."""
    found = np.empty((len(scale), 16), np.float32)
    for k in numba.prange(len(scale)):
        a0 = a1 = a2 = a3 = a4 = a5 = a6 = a7 = np.float32(0)
        a8 = a9 = a10 = a11 = a12 = a13 = a14 = a15 = np.float32(0)
        for r in range(starts[k], starts[k + 1]):
            point, weight = points[r], table[weights[r]]
            a0 += weight * sent[point, 0]
            a1 += weight * sent[point, 1]
            a2 += weight * sent[point, 2]
            a3 += weight * sent[point, 3]
            a4 += weight * sent[point, 4]
            a5 += weight * sent[point, 5]
            a6 += weight * sent[point, 6]
            a7 += weight * sent[point, 7]
            a8 += weight * sent[point, 8]
            a9 += weight * sent[point, 9]
            a10 += weight * sent[point, 10]
            a11 += weight * sent[point, 11]
            a12 += weight * sent[point, 12]
            a13 += weight * sent[point, 13]
            a14 += weight * sent[point, 14]
            a15 += weight * sent[point, 15]
        by = scale[k]
        found[k, 0], found[k, 1], found[k, 2], found[k, 3] = a0 * by, a1 * by, a2 * by, a3 * by
        found[k, 4], found[k, 5], found[k, 6], found[k, 7] = a4 * by, a5 * by, a6 * by, a7 * by
        found[k, 8], found[k, 9], found[k, 10], found[k, 11] = a8 * by, a9 * by, a10 * by, a11 * by
        found[k, 12], found[k, 13], found[k, 14], found[k, 15] = a12 * by, a13 * by, a14 * by, a15 * by
    return found


@by_lanes
def smoothed(light, points, shares):  # type: ignore[no-untyped-def]
    """Weighted means (K, G, 4), over the points (K, 8) around each point, of light (K, G, 4)."""
    groups = light.shape[1]
    found = np.empty(light.shape, np.float32)
    for k in numba.prange(len(points)):
        total, some = np.float32(0), 0
        while some < points.shape[1] and shares[k, some] > 0:
            total += np.float32(shares[k, some])
            some += 1
        by = np.float32(1) / total
        for group in range(groups):
            a0 = a1 = a2 = a3 = np.float32(0)
            for n in range(some):
                at, share = points[k, n], np.float32(shares[k, n])
                a0 += share * light[at, group, 0]
                a1 += share * light[at, group, 1]
                a2 += share * light[at, group, 2]
                a3 += share * light[at, group, 3]
            found[k, group, 0], found[k, group, 1] = a0 * by, a1 * by
            found[k, group, 2], found[k, group, 3] = a2 * by, a3 * by
    return found


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
    groups, texels, near = direct.shape[0], direct.shape[1], points.shape[1]
    found = np.empty((groups, 3 * texels), np.float32)
    before, straight, whole = reference.reshape(groups, -1), direct.reshape(groups, -1), baked.reshape(groups, -1)
    for block in numba.prange((texels + BLOCK - 1) // BLOCK):
        first = BLOCK * block
        count = min(BLOCK, texels - first)
        mean = np.empty((groups, 3 * BLOCK + 1), np.float32)  # each texel overwrites the padding of the previous one
        for t in range(count):
            total = np.float32(0)
            for n in range(near):
                total += np.float32(shares[first + t, n])
            by, lane = np.float32(1) / total, 3 * t
            for group in range(groups):
                a0 = a1 = a2 = a3 = np.float32(0)
                for n in range(near):
                    place, share = points[first + t, n], np.float32(shares[first + t, n])
                    a0 += share * edited[place, group, 0]
                    a1 += share * edited[place, group, 1]
                    a2 += share * edited[place, group, 2]
                    a3 += share * edited[place, group, 3]
                mean[group, lane], mean[group, lane + 1] = a0 * by, a1 * by
                mean[group, lane + 2], mean[group, lane + 3] = a2 * by, a3 * by
        for group in range(groups):
            for i in range(3 * count):
                value = 3 * first + i
                then, at = before[group, value], straight[group, value]
                ratio = min(max(mean[group, i] / max(then, NO_LIGHT), np.float32(0)), most_ratio)
                ratio = ratio if then > least[group] else np.float32(1)
                indirect = whole[group, value] - at
                excess = max(indirect - most_excess * then, np.float32(0)) * max(ratio - np.float32(1), np.float32(0))
                found[group, value] = at + indirect * ratio - excess
    return found.reshape(direct.shape)
