"""Transport of the pixels of a view: how much light reaches the viewer by each band of a curve.

    T_j = sum over lights m of  V rho_q |cos| L_m Delta_mj        (Ben-Artzi 2007, eqs 4.4, 4.11, 4.12)

Delta_mj is the share of triangle m whose angle lies in band j. One thread is one pixel: it walks through the lights and
touches only the bands that each of them meets. With two curves, rows are pairs of bands (4.15).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake.tracing.array_ops import array_ops
from lambent.bake.tracing.rays import array_of, has_holes, hidden, in_shadow, leaving, vectors
from lambent.bake.transport.overlaps import in_order, share_below
from lambent.bake.transport.view_points import ViewPoints
from lambent.materials.factored.curve import END_RAD
from lambent.materials.factored.parametrisations import angle_of
from lambent.materials.factored.roughness import narrowed, thinned, varies
from lambent.materials.factored.terms import Factor, Term
from lambent.scenes.triangle_lights import TriangleLights

BEND, BEND_BY_ANGLE, MOST_BEND = 0.25, 1 / 16, 2.0  # bands that an angle may be from linear within a piece; more, in
# proportion to the angle, where curves have no narrow peaks
WIDEST = 2  # bands that a piece may span in both of two curves
MOST_CUTS = 32  # an edge
BITS = 32


class Pairs(NamedTuple):
    """Transport by pairs of bands: of each point the number of its entries, and all entries, point after point.

    counts (P,); bands (N, 2) of the first and the second curve; values (N, 3).
    """

    counts: NDArray[np.int64]
    bands: NDArray[np.uint8]
    values: NDArray[np.float32]


@dataclass(frozen=True)
class Bands:
    """A factor's curve cut into `count` equal bands."""

    factor: Factor
    count: int


def visibility(scene: Any, points: ViewPoints, lights: TriangleLights) -> NDArray[np.uint32]:
    """(ceil(M / 32), P) words: bit m % 32 of word m // 32 is set where light m's centre is seen."""
    words = -(-len(lights) // BITS)
    holes = has_holes(scene)
    centres = vectors(mi.Vector3f, lights.centres)
    near = mi.Bool(lights.near)
    p, flat = vectors(mi.Point3f, points.p), vectors(mi.Vector3f, points.flat)
    thread = dr.arange(mi.UInt32, len(points) * words)
    count = dr.opaque(mi.UInt32, len(points))
    at = thread % count
    seen = _seen(
        scene, dr.gather(mi.Point3f, p, at), dr.gather(mi.Vector3f, flat, at), thread // count * BITS,
        dr.opaque(mi.UInt32, len(lights)), centres, near, bool(lights.near.any()), holes,
    )  # fmt: skip
    return np.array(seen).reshape(words, len(points))


@dr.syntax
def _seen(scene, p, n, first, lights, centres, near, any_near, holes):  # type: ignore[no-untyped-def]
    word, i = mi.UInt32(0), mi.UInt32(0)
    while i < BITS:
        m = first + i
        here = m < lights
        centre = dr.gather(mi.Vector3f, centres, m, here)
        is_near = dr.gather(mi.Bool, near, m, here) if dr.hint(any_near, mode="scalar") else mi.Bool(False)
        blocked = in_shadow(scene, leaving(scene, p, n, centre), here & ~is_near, holes)
        if dr.hint(any_near, mode="scalar"):
            blocked |= hidden(scene, p, n, mi.Point3f(centre), here & is_near, holes) & is_near
        word |= dr.select(here & ~blocked, mi.UInt32(1) << i, 0)
        i += 1
    return word


def transport(
    points: ViewPoints, lights: TriangleLights, seen: NDArray[np.uint32], term: Term, bands: Bands
) -> NDArray[np.float32]:
    """Transport (J, 3, P) of a term with one curve, in W/(sr m^2) for curves of 1.

    Parameters
    ----------
    seen : (words, P) uint32
        Of `visibility`.
    bands
        Those of the term's curve, or of the first of two if the other is constant.
    """
    total = _traced(points, lights, seen, term, [bands])
    return np.array(total).reshape(bands.count, 3, len(points))


def pair_transport(
    points: ViewPoints,
    lights: TriangleLights,
    seen: NDArray[np.uint32],
    term: Term,
    bands: Sequence[Bands],
    least: float,
) -> Pairs:
    """Transport of a term with two curves as `transport`, without the entries of a sum below `least`.

    Hazard: it takes 12 bytes for every pair of bands of every point.
    """
    counts = [b.count for b in bands]
    total = _traced(points, lights, seen, term, bands)
    at = dr.arange(mi.UInt32, len(points) * counts[0] * counts[1])
    values = dr.gather(mi.Vector3f, total, at)
    kept = dr.compress(values.x + values.y + values.z > dr.opaque(mi.Float, least))
    point, pair = np.divmod(np.array(kept), np.uint32(counts[0] * counts[1]))
    entries = np.stack(np.divmod(pair, np.uint32(counts[1])), axis=1).astype(np.uint8)
    return Pairs(np.bincount(point, minlength=len(points)), entries, array_of(dr.gather(mi.Vector3f, total, kept)))


def _traced(
    points: ViewPoints, lights: TriangleLights, seen: NDArray[np.uint32], term: Term, bands: Sequence[Bands]
) -> Any:
    """Transport on the device: (J, 3, P) of one curve, (P, J, K, 3) of two."""
    counts, pixels = [b.count for b in bands], len(points)
    total = dr.zeros(mi.Float, int(np.prod(counts)) * 3 * pixels)
    axes = [vectors(mi.Vector3f, axis) for axis in (points.t, points.b, points.n)]
    wo, ops = tuple(vectors(mi.Vector3f, points.wo)), array_ops()
    mirrored, turned = -1.0 if term.side == "transmission" else 1.0, -1.0 if term.side == "retro" else 1.0

    rough = mi.Float(points.roughness) if varies(term) and (points.roughness != 1).any() else None
    sheet = vectors(mi.Vector3f, points.sheet) if points.sheet.any() else None

    # Dr.Jit's loops take dataclasses apart, and frozen ones cannot be put together again: they are in functions.
    def local(w: Any) -> Any:
        return dr.dot(w, axes[0]) * turned, dr.dot(w, axes[1]) * turned, dr.dot(w, axes[2]) * mirrored

    def steps(w: Any) -> list[Any]:
        """The angles of a direction, in bands."""
        wi = local(w)
        angles = [angle_of(b.factor.over, wi, wo, b.factor.stretch, dr) for b in bands]
        if rough is not None:
            angles = [narrowed(b.factor.over, angle, rough, dr) for angle, b in zip(angles, bands, strict=True)]
        return [_in_bands(angle, b.count) for angle, b in zip(angles, bands, strict=True)]

    def height(w: Any) -> Any:
        above = dr.dot(w, axes[2]) * mirrored
        if sheet is None:
            return above
        return dr.select(dr.squared_norm(sheet) > 0, dr.minimum(above, dr.dot(w, sheet) * mirrored), above)

    def weight(w: Any) -> Any:
        """rho_q cos of a direction on the side that the term scatters from."""
        wi = local(w)
        quotient = term.quotient.evaluate(wi, wo, ops)
        value = mi.Vector3f(*quotient) if isinstance(quotient, tuple) else mi.Vector3f(quotient)
        if rough is not None:
            value *= thinned(term, wi, wo, rough, ops)
        return value * wi[2]

    pixel, width = dr.arange(mi.UInt32, pixels), dr.opaque(mi.UInt32, pixels)
    row = _accumulate(
        total, pixel, width, vectors(mi.Point3f, points.p), lights_on_device(lights), mi.UInt32(seen.ravel()),
        dr.opaque(mi.UInt32, len(lights)), steps, height, weight, counts,
    )  # fmt: skip
    if len(bands) == 1:
        _write(total, row, pixel, width, counts[0])
    dr.eval(total)
    return total


def lights_on_device(lights: TriangleLights) -> dict[str, Any]:
    """The arrays of lights; those of points and of cones only where there are some."""
    arrays = {
        "corners": [vectors(mi.Vector3f, lights.corners[:, c]) for c in range(3)],
        "centres": vectors(mi.Vector3f, lights.centres),
        "light": vectors(mi.Vector3f, lights.light),
    }
    if lights.near.any():
        arrays["near"] = mi.Bool(lights.near)
    if len(lights.cones):
        inner, outer = lights.cones[:, 3], lights.cones[:, 4]
        arrays["axes"] = vectors(mi.Vector3f, lights.cones[:, :3])
        arrays["cone"] = [
            mi.Float(outer.astype(np.float32)),
            mi.Float(np.maximum(outer - inner, 1e-4).astype(np.float32)),
        ]
    return arrays


@dr.syntax
def _accumulate(  # type: ignore[no-untyped-def]
    total, pixel, pixels, p, lights, seen, count, steps, height, weight, counts
):
    row = dr.alloc_local(mi.Float, 3 * counts[0] if len(counts) == 1 else 1, value=mi.Float(0))
    m = mi.UInt32(0)
    while m < count:
        bit = (dr.gather(mi.UInt32, seen, (m // BITS) * pixels + pixel) >> (m % BITS)) & 1
        centre, a, b, c, power = _light(lights, m, p)
        if (bit == 1) & (height(centre) > 0) & (dr.max(power) > 0):
            power *= weight(centre)
            corners = [steps(a), steps(b), steps(c)]
            middles = [steps(dr.normalize(a + b)), steps(dr.normalize(b + c)), steps(dr.normalize(c + a))]
            n = _cuts(corners, middles)
            power /= mi.Float(n * n)
            s = mi.UInt32(0)
            while s < n * n:
                orders = _orders(corners, _means(middles), counts)
                if n > 1:
                    orders = _orders_of_piece(_piece(a, b, c, n, s), steps, counts)
                _add_piece(total, row, pixel, power, orders, counts)
                s += 1
        m += 1
    return row


def _light(lights: dict[str, Any], m: Any, p: Any) -> tuple[Any, ...]:
    """Direction and corners of light m from p, and its radiance times its solid angle."""
    centre = dr.gather(mi.Vector3f, lights["centres"], m)
    a, b, c = [dr.gather(mi.Vector3f, corner, m) for corner in lights["corners"]]
    power = dr.gather(mi.Vector3f, lights["light"], m)
    if "near" not in lights:
        return centre, a, b, c, power
    near = dr.gather(mi.Bool, lights["near"], m)
    here = mi.Vector3f(p)
    across = dr.cross(b - a, c - a)
    to = centre - here
    facing, is_point = dr.dot(across, to) < 0, dr.all(a == b)
    a, b, c, centre = [dr.select(near, dr.normalize(v - here), v) for v in (a, b, c, centre)]
    share = dr.select(facing, _solid_angle(a, b, c), 0.0)
    if "cone" in lights:
        angle = dr.acos(dr.clip(-dr.dot(centre, dr.gather(mi.Vector3f, lights["axes"], m)), -1, 1))
        outer, width = [dr.gather(mi.Float, one, m) for one in lights["cone"]]
        inside = dr.select(outer < np.float32(np.pi), dr.clip((outer - angle) / width, 0, 1), 1.0)
        share = dr.select(is_point, inside / dr.squared_norm(to), share)
    return centre, a, b, c, power * dr.select(near, share, 1.0)


@dr.syntax
def _write(total, row, pixel, pixels, count):  # type: ignore[no-untyped-def]
    """Write each thread's row once."""
    j = mi.UInt32(0)
    while j < 3 * count:
        dr.scatter(total, row[j], j * pixels + pixel)
        j += 1


@dr.syntax
def _add_piece(total, row, pixel, power, orders, counts):  # type: ignore[no-untyped-def]
    """Add a piece of a light to the bands, or pairs of bands, that it meets."""
    low, middle, high = orders[0]
    j = dr.minimum(mi.UInt32(low), counts[0] - 1)
    below = mi.Float(0)
    while (mi.Float(j) <= high) & (j < counts[0]):
        up_to = share_below(mi.Float(j + 1), low, middle, high, dr)
        share = up_to - below
        below = up_to
        if dr.hint(len(counts) == 1, mode="scalar"):
            row[3 * j] += power[0] * share
            row[3 * j + 1] += power[1] * share
            row[3 * j + 2] += power[2] * share
        else:
            low_2, middle_2, high_2 = orders[1]
            k = dr.minimum(mi.UInt32(low_2), counts[1] - 1)
            under = mi.Float(0)
            while (mi.Float(k) <= high_2) & (k < counts[1]):
                over = share_below(mi.Float(k + 1), low_2, middle_2, high_2, dr)
                at = ((pixel * counts[0] + j) * counts[1] + k) * 3
                _add(total, at, power * (share * (over - under)))
                under = over
                k += 1
        j += 1


def _means(middles: list[list[Any]]) -> list[Any]:
    """Mean angles over a triangle, by curve: exact for angles that are quadratic in it."""
    return [(a + b + c) / 3 for a, b, c in zip(*middles, strict=True)]


def _orders_of_piece(piece: list[Any], steps: Any, counts: list[int]) -> list[Any]:
    """`_orders` of a piece; for the mean the centre counts 3/4 (Simpson's rule on a triangle)."""
    centre, corners = steps(dr.normalize(piece[0] + piece[1] + piece[2])), list(map(steps, piece))
    means = [0.75 * at + (a + b + c) / 12 for at, a, b, c in zip(centre, *corners, strict=True)]
    return _orders(corners, means, counts)


def _orders(corners: list[Any], means: list[Any], counts: list[int]) -> list[Any]:
    """The angles at a piece's corners in order, by curve, moved so that their mean is that of the whole piece.

    Angles are convex along most edges: without the correction they would be too large in the mean, and highlights too
    dark.
    """
    found = []
    for at, mean, end in zip(zip(*corners, strict=True), means, counts, strict=True):
        shift = mean - (at[0] + at[1] + at[2]) / 3
        a, b, c = (dr.clip(angle + shift, 0.0, dr.maximum(angle, end)) for angle in at)
        found.append(in_order(a, b, c, dr))
    return found


def _in_bands(angle: Any, count: int) -> Any:
    """An angle in bands; the end of the last band where rounding puts 90 degrees beyond it."""
    step = angle * (count / END_RAD)
    return dr.select(step < count * (1 + 1e-5), dr.minimum(step, count), step)


def _add(total: Any, at: Any, value: Any) -> None:
    for c in range(3):
        dr.scatter_add(total, value[c], at + c, mode=dr.ReduceMode.NoConflicts)


def _cuts(corners: list[Any], middles: list[Any]) -> Any:
    """Cuts of an edge after which the angles are nearly linear in each piece: their error falls with the square.

    Two angles that vary together in a piece are counted as if they did not (4.15), so one must vary little.
    """
    cuts = mi.Float(1)
    for at, between in zip(zip(*corners, strict=True), zip(*middles, strict=True), strict=True):
        bends = [dr.abs(m - (x + y) / 2) for m, x, y in zip(between, at, (*at[1:], at[0]), strict=True)]
        least = dr.minimum(dr.minimum(*at[:2]), at[2])
        allowed = dr.clip(least * BEND_BY_ANGLE, BEND, MOST_BEND)
        cuts = dr.maximum(cuts, dr.sqrt(dr.maximum(dr.maximum(*bends[:2]), bends[2]) / allowed))
    if len(corners[0]) == 2:
        spans = (high - low for low, _, high in (in_order(x, y, z, dr) for x, y, z in zip(*corners, strict=True)))
        cuts = dr.maximum(cuts, dr.minimum(*spans) / WIDEST)
    return dr.clip(mi.UInt32(dr.ceil(cuts)), 1, MOST_CUTS)


def _piece(a: Any, b: Any, c: Any, n: Any, s: Any) -> list[Any]:
    """Corners, unit, of piece s of the n^2 equal pieces of a flat triangle, counted in rows from a."""
    row = mi.UInt32(dr.sqrt(mi.Float(s) + 0.5))
    k = s - row * row
    j, turned = k // 2, k % 2 == 1
    u, v = (b - a) / mi.Float(n), (c - b) / mi.Float(n)

    def at(i: Any, k: Any) -> Any:
        return dr.normalize(a + u * mi.Float(i) + v * mi.Float(k))

    second, third = at(row + 1, j), at(row + 1, j + 1)
    return [at(row, j), dr.select(turned, third, second), dr.select(turned, at(row, j + 1), third)]


def _solid_angle(a: Any, b: Any, c: Any) -> Any:
    """Of unit directions (van Oosterom and Strackee 1983, eq. 8)."""
    volume = dr.abs(dr.dot(a, dr.cross(b, c)))
    return 2 * dr.atan2(volume, 1 + dr.dot(a, b) + dr.dot(b, c) + dr.dot(c, a))
