"""Sums of a thread: lights are cut into pieces, whose light goes to the hat functions, or pairs of them, they meet."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from lambent.baking.transport.device_lights import light_at
from lambent.baking.transport.overlaps import below
from lambent.baking.transport.pieces import (
    MOST_CUTS,
    MOST_CUTS_OF_WIDE,
    Where,
    above,
    angles,
    corners_of,
    first_part,
    is_bent,
    is_beyond,
    is_broad,
    is_last_part,
    next_part,
    parent,
    share_of,
    spread_of,
    whole,
)
from lambent.baking.transport.polygon_light import cosine_integral, highest_part
from lambent.baking.transport.visibility import BITS

TINY = 1e-12  # of a light: smaller amounts are ignored


@dr.syntax
def accumulate(  # type: ignore[no-untyped-def]
    row, part, pixel, active, pixels, p, lights, seen, count, up, local, steps, height, quotient, counts
):
    """Add all lights that a point sees to its row. Pieces are cut, depth first, if their angles bend.

    For wide lights, each piece has its own light and quotient, and directions below the horizon are moved onto it.
    """
    m = mi.UInt32(0)
    while active & (m < count):
        bit = (dr.gather(mi.UInt32, seen, (m // BITS) * pixels + pixel) >> (m % BITS)) & 1
        centre, a, b, c, power, solid, wide = light_at(lights, m, p, up)
        if (bit == 1) & (height(centre) > 0) & (dr.max(power) * solid > 0):
            of_point = solid * quotient(centre) * dr.dot(centre, up)
            power *= of_point if wide is None else dr.select(wide, 1.0, of_point)
            where = whole()
            busy = mi.Bool(True)
            while busy:
                ends, between = corners_of(a, b, c, where)
                corners, middles = [[steps(w) for w in _lifted(few, up, wide)] for few in (ends, between)]
                elsewhere = is_beyond(corners, middles, part)
                if ~elsewhere & _is_coarse(where, ends, is_bent(corners, middles), wide):
                    where = first_part(where)
                else:
                    light = power * share_of(where)
                    if dr.hint(wide is not None, mode="scalar"):
                        light = _of_piece(light, power, wide, ends, between, up, local, height, quotient)
                    if ~elsewhere:
                        _add_piece(row, part, light, angles(corners, middles, counts), counts)
                    while (where[0] > 0) & is_last_part(where):
                        where = parent(where)
                    busy = where[0] > 0
                    where = next_part(where)
        m += 1
    return row


def _lifted(directions: list[Any], up: Any, wide: Any) -> list[Any]:
    """Move directions of a wide light from below the horizon onto it."""
    return directions if wide is None else [dr.select(wide, above(w, up), w) for w in directions]


def _is_coarse(where: Where, corners: list[Any], bent: Any, wide: Any) -> Any:
    """Whether a piece must be cut."""
    if wide is None:
        return bent & (where[0] < MOST_CUTS)
    return (bent | (wide & is_broad(corners))) & (where[0] < dr.select(wide, MOST_CUTS_OF_WIDE, MOST_CUTS))


@dr.syntax
def _of_piece(light, power, wide, ends, between, up, local, height, quotient):  # type: ignore[no-untyped-def]
    """The light of a piece; computed separately for a wide light."""
    if wide:
        middle = dr.normalize(highest_part(sum(between), ends, up, dr))
        a, b, c = (local(w) for w in ends)
        light = power * quotient(middle) * cosine_integral(a, b, c, dr)
        light = dr.select(height(middle) > 0, light, 0.0)
    return light


@dr.syntax
def _add_piece(row, part, power, found, counts):  # type: ignore[no-untyped-def]
    """Add a piece of a light to the nodes, or pairs of nodes, that it meets; of the first curve, those of a part.

    Of two angles, it walks along the nodes of the one that varies more; the other is taken at its mean around each
    node.
    """
    outer, turned = spread_of(found)
    low, high = outer[0][0] - 0.5, outer[0][2] - 0.5  # in units of nodes, from the first
    sides = outer[1][1] - outer[1][0], outer[1][2] - outer[1][0]
    lowest, highest = dr.minimum(dr.minimum(*sides), 0), dr.maximum(dr.maximum(*sides), 0)
    begin, end = mi.Float(part[0]) - 1, mi.Float(part[1]) - 1
    many, others, step, other_step = mi.Float(counts[0]), 1, 1, 1
    if dr.hint(len(counts) == 2, mode="scalar"):
        begin, end = dr.select(turned, -1, begin), dr.select(turned, mi.Float(counts[1]) - 1, end)
        many, others = [dr.select(turned, *order) for order in (counts[::-1], counts)]
        step, other_step = dr.select(turned, 1, counts[1]), dr.select(turned, counts[1], 1)
        many = mi.Float(many)
    y = dr.clip(dr.floor(low), -1, many - 1)  # the node before, or -1
    before = mi.Float(0), mi.Float(0), mi.Float(0)
    if y < begin:
        before = below(begin + 0.5, outer, dr)
        y = mi.Float(begin)
    left, left_b = mi.Float(0), mi.Float(0)  # carried over to this node from the previous interval
    end = dr.minimum(end, high + 1)
    while y <= end:
        now = below(dr.minimum(y + 1.5, many), outer, dr)
        here = now[0] - before[0]
        mean = dr.clip((now[2] - before[2]) / dr.maximum(here, TINY), lowest, highest)
        beyond = dr.clip(now[1] - before[1] + here * (low - y), 0, here)  # for the next node
        beyond = dr.select(y < 0, here, dr.select(y < many - 1, beyond, 0))
        share = left + here - beyond
        inner = outer[1][0] + (left_b + mean * (here - beyond)) / dr.maximum(share, TINY)
        if (share > 0) & (y >= 0) & (inner <= mi.Float(others)):
            if dr.hint(len(counts) == 2, mode="scalar"):
                x = dr.clip(inner - 0.5, 0, mi.Float(others - 1))
                k = mi.UInt32(x)
                at, to = mi.UInt32(y) * step - part[0] * counts[1], x - mi.Float(k)
                _add_within(row, part, at + k * other_step, power * (share * (1 - to)), counts)
                _add_within(row, part, at + dr.minimum(k + 1, others - 1) * other_step, power * (share * to), counts)
            else:
                add(row, 3 * (mi.UInt32(y) - part[0]), power * share)
        left, left_b, before = beyond, mean * beyond, now
        y += 1


@dr.syntax
def _add_within(row, part, at, value, counts):  # type: ignore[no-untyped-def]
    if at < (part[1] - part[0]) * counts[1]:
        add(row, 3 * at, value)


def add(row: Any, at: Any, value: Any) -> None:
    for c in range(3):
        row[at + c] += value[c]
