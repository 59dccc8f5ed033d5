"""Compiled loops of `answer`: light between patches, exitance of points, gathering, and the light of texels.

Exitance is (K, G, 4) float32, so that a ray reads the light of all groups from one place; the fourth is padding.
"""

from __future__ import annotations

import numba
import numpy as np

NO_LIGHT = np.float32(1e-30)


@numba.njit(parallel=True, cache=True, nogil=True)
def solve(starts, ends, senders, shares, direct, reflected, transmitted, paired, tolerance, sweeps, light):  # type: ignore[no-untyped-def]
    """Bring light (G, P, 3) to B = F (a (D + B) + t (D + B) of the other side) + D by Gauss and Seidel's method.

    F is sparse by group and row: `senders` and `shares` from `starts` to `ends` (G, P). Groups stop one by one, when no
    patch changes by more than `tolerance` of its light. Returns the sweeps of each (G,), and whether it stopped (G,).
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
                    # Not `>`: a difference of infinities, which is not a number, does not stand.
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
    """Exitance (K, G, 3) of points whose indirect light is ratio (G, n, 3) at `of` (K,) times as baked."""
    groups, points = direct.shape[:2]
    found = np.empty((points, groups, 3), np.float32)
    for k in numba.prange(points):
        there = other[k]
        for group in range(groups):
            for c in range(3):
                at = direct[group, k, c]
                sent = reflected[k, c] * (at + (light[group, k, c] - at) * ratio[group, of[k], c])
                if there != k:
                    at = direct[group, there, c]
                    now = at + (light[group, there, c] - at) * ratio[group, of[there], c]
                    sent += transmitted[k, c] * now
                found[k, group, c] = sent
    return found


@numba.njit(parallel=True, cache=True, nogil=True)
def merge(rays, starts, ends, points, weights, most, table):  # type: ignore[no-untyped-def]
    """Add rays (K, R, 2 + G) of a row that end at one point: rows of `points` (K R,) from `starts` to `ends` (K,).

    Weights (K R, G) are bytes: roots over that of the row's `most` (K, G). `table` has the weights of the rays' bytes.
    """
    count, groups = rays.shape[1], rays.shape[2] - 2
    for k in numba.prange(rays.shape[0]):
        number = rays[k, :, 0].astype(np.int64) | (rays[k, :, 1].astype(np.int64) << 8)
        order = np.argsort(number)
        sums = np.zeros((count, groups), np.float32)
        place, last = np.int64(starts[k] - 1), np.int64(-1)
        for r in order:
            lit = False
            for group in range(groups):
                lit |= rays[k, r, 2 + group] != 0
            if not lit:
                continue
            if number[r] != last:
                place, last = place + 1, number[r]
                points[place] = last
            for group in range(groups):
                sums[place - starts[k], group] += table[rays[k, r, 2 + group]]
        ends[k] = place + 1
        for group in range(groups):
            largest = np.float32(0)
            for n in range(ends[k] - starts[k]):
                largest = max(largest, sums[n, group])
            most[k, group] = largest
            for n in range(ends[k] - starts[k] if largest > 0 else 0):
                weights[starts[k] + n, group] = np.uint8(np.rint(np.sqrt(sums[n, group] / largest) * np.float32(255)))


@numba.njit(parallel=True, cache=True, nogil=True)
def gather_one(starts, points, weights, most, table, sent):  # type: ignore[no-untyped-def]
    """Sums (1, K, 3) of exitance (n, 1, 3) at `points` (N,), those of each k from `starts` (K + 1,) on.

    `table` has the weights that bytes stand for, over `most` (K, 1).
    """
    found = np.empty((1, len(most), 3), np.float32)
    for k in numba.prange(len(most)):
        red = green = blue = np.float32(0)
        for r in range(starts[k], starts[k + 1]):
            weight, point = table[weights[r, 0]], points[r]
            red += weight * sent[point, 0, 0]
            green += weight * sent[point, 0, 1]
            blue += weight * sent[point, 0, 2]
        found[0, k, 0], found[0, k, 1], found[0, k, 2] = red * most[k, 0], green * most[k, 0], blue * most[k, 0]
    return found


@numba.njit(parallel=True, cache=True, nogil=True)
def gather_four(starts, points, weights, most, table, sent, first, found):  # type: ignore[no-untyped-def]
    """The same for four groups from `first` on, into found (G, K, 3): a ray finds their light side by side.

    Where there are fewer, the last is summed again.
    """
    last = sent.shape[1] - 1
    b, c, d = min(first + 1, last), min(first + 2, last), min(first + 3, last)
    for k in numba.prange(len(most)):
        a0 = a1 = a2 = b0 = b1 = b2 = c0 = c1 = c2 = d0 = d1 = d2 = np.float32(0)
        for r in range(starts[k], starts[k + 1]):
            point = points[r]
            weight = table[weights[r, first]]
            a0 += weight * sent[point, first, 0]
            a1 += weight * sent[point, first, 1]
            a2 += weight * sent[point, first, 2]
            weight = table[weights[r, b]]
            b0 += weight * sent[point, b, 0]
            b1 += weight * sent[point, b, 1]
            b2 += weight * sent[point, b, 2]
            weight = table[weights[r, c]]
            c0 += weight * sent[point, c, 0]
            c1 += weight * sent[point, c, 1]
            c2 += weight * sent[point, c, 2]
            weight = table[weights[r, d]]
            d0 += weight * sent[point, d, 0]
            d1 += weight * sent[point, d, 1]
            d2 += weight * sent[point, d, 2]
        found[d, k, 0], found[d, k, 1], found[d, k, 2] = d0 * most[k, d], d1 * most[k, d], d2 * most[k, d]
        found[c, k, 0], found[c, k, 1], found[c, k, 2] = c0 * most[k, c], c1 * most[k, c], c2 * most[k, c]
        found[b, k, 0], found[b, k, 1], found[b, k, 2] = b0 * most[k, b], b1 * most[k, b], b2 * most[k, b]
        found[first, k, 0], found[first, k, 1] = a0 * most[k, first], a1 * most[k, first]
        found[first, k, 2] = a2 * most[k, first]


@numba.njit(parallel=True, cache=True, nogil=True)
def texel_light(points, shares, edited, reference, direct, baked, least, most_ratio, most_excess):  # type: ignore[no-untyped-def]
    """`answer.answered` at texels (G, T, 3), of means over the points near each of `edited` (G, K, 3)."""
    found = np.empty(direct.shape, np.float32)
    groups, near = direct.shape[0], points.shape[1]
    for t in numba.prange(direct.shape[1]):
        total = np.float32(0)
        for n in range(near):
            total += np.float32(shares[t, n])
        for group in range(groups):
            for c in range(3):
                now = np.float32(0)
                for n in range(near):
                    now += np.float32(shares[t, n]) * edited[group, points[t, n], c]
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
