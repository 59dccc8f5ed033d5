"""Transport of the pixels of a view: light that reaches the viewer, by node of a curve.

    T_j = sum over lights m of  V rho_q |cos| L_m Delta_mj        (Ben-Artzi 2007, eqs 4.4, 4.11, 4.12)

Delta_mj is the mean over triangle m of hat function j, which is 1 at the centre of band j and 0 at the neighbouring
ones: curves are linear between nodes (`Curve.node_values`), where the thesis has steps. One thread is one pixel: it
loops over the lights, accumulates only the nodes that each of them meets, in its own memory, and writes them once. With
two curves, nodes are pairs of nodes (4.15).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baked.shared_exponent import LARGEST, ONES, packed
from lambent.baking.tracing.array_ops import array_ops
from lambent.baking.tracing.rays import vectors
from lambent.baking.transport.device_lights import lights_on_device
from lambent.baking.transport.pieces import in_bands
from lambent.baking.transport.sums import accumulate, add
from lambent.baking.transport.view_points import ViewPoints
from lambent.core.arrays import ranges
from lambent.materials.factored.parametrisations import angle_of
from lambent.materials.factored.terms import Factor, Term, narrowed, thinned, varies
from lambent.scenes.sky.triangle_lights import TriangleLights

BLOCK = 1 << 14  # threads that Dr.Jit gives to one core at a time
PAIRS_AT_ONCE = 1 << 24  # of points and pairs of bands: 128 MB
LONGEST = 255  # largest step between entries
OWN_PAIRS = 1 << 13  # of bands, held per thread at a time: 1.6 MB for 16 threads that run as one vector


class Pairs(NamedTuple):
    """Transport by pairs of bands: the number of entries per point, and all entries, point after point.

    counts (P,); steps (N,) uint8 from one entry's pair to the next: pairs are numbered j K + k, and each point begins
    at -1; light (N,) RGB9E5 (`baked.shared_exponent`). Black entries bridge steps that would be too long.
    """

    counts: NDArray[np.int64]
    steps: NDArray[np.uint8]
    light: NDArray[np.uint32]


@dataclass(frozen=True)
class Bands:
    """A factor's curve divided into `count` equal bands."""

    factor: Factor
    count: int


def transport(
    points: ViewPoints, lights: TriangleLights, seen: NDArray[np.uint32], term: Term, bands: Bands
) -> NDArray[np.float32]:
    """Transport (J, 3, P) of a term with one curve, in W/(sr m^2) for curves of 1.

    Parameters
    ----------
    seen : (words, P) uint32
        From `visibility`.
    bands
        Those of the term's curve, or of the first of two if the other is constant.
    """
    total = dr.empty(mi.Float, bands.count * 3 * len(points))
    row, pixel, active = _Lit(points, lights, seen, term, [bands]).rows(0, bands.count)
    _write(total, row, pixel, dr.opaque(mi.UInt32, len(points)), active, bands.count)
    dr.eval(total)
    return np.array(total).reshape(bands.count, 3, len(points))


def pair_transport(
    points: ViewPoints,
    lights: TriangleLights,
    seen: NDArray[np.uint32],
    term: Term,
    bands: Sequence[Bands],
    unit: float,
    texture: NDArray[np.float32] | None = None,
    least: float = 0.0,
) -> Iterator[Pairs]:
    """Transport of a term with two curves as in `transport`, times `texture` (P, 3), in multiples of `unit`.

    For each band of the first curve, entries below the share `least` of its light are added to the last larger entry
    before them, or to the first. Entries that round to black are left out. Points are yielded in blocks, to save
    memory.
    """
    size = bands[0].count * bands[1].count
    at_once = max(1, PAIRS_AT_ONCE // size)
    own = max(1, OWN_PAIRS // bands[1].count)  # bands of the first curve
    for first in range(0, len(points), at_once):
        some = slice(first, first + at_once)
        few = points.where(some)
        factor = np.full((len(few), 3), 1 / unit, np.float32) if texture is None else texture[some] / np.float32(unit)
        lit = _Lit(few, lights, seen[:, some], term, bands)
        last = dr.full(mi.UInt32, 0xFFFFFFFF, len(few))
        parts = range(0, bands[0].count, own)
        yield _joined([_pairs(lit, begin, min(own, bands[0].count), factor, last, least) for begin in parts])


def _joined(parts: list[Pairs]) -> Pairs:
    """Join the entries of several ranges of bands of the same points, point after point."""
    if len(parts) == 1:
        return parts[0]
    counts = np.stack([part.counts for part in parts], axis=1)
    begins = np.cumsum(counts.ravel()).reshape(counts.shape) - counts
    joined = Pairs(counts.sum(axis=1), *(np.empty(counts.sum(), part.dtype) for part in parts[0][1:]))
    for k, part in enumerate(parts):
        at = np.repeat(begins[:, k], part.counts) + ranges(part.counts)
        joined.steps[at], joined.light[at] = part.steps, part.light
    return joined


def _pairs(lit: _Lit, begin: int, count: int, factor: NDArray[np.float32], last: Any, least: float) -> Pairs:
    """Pairs of `count` bands of the first curve from `begin`; `last` (P,) is each point's previous entry."""
    size, points = count * lit.counts[1], len(lit)
    row, pixel, active = lit.rows(begin, count)
    scale = dr.gather(mi.Vector3f, vectors(mi.Vector3f, factor), pixel, active)
    places = _entries(size * points)
    found = dr.empty(mi.UInt32, points)
    if least:
        _merge(row, active, dr.opaque(mi.Float, least), lit.counts[1], size)
    _pack(places, found, last, row, pixel, active, scale, dr.opaque(mi.UInt32, begin * lit.counts[1]), size)
    dr.eval(places, found, last)
    ends = dr.cumsum(found)
    total = int(ends[points - 1])
    dense = _entries(max(total, 1))
    pixel, active = _threads(points)
    own, to = (dr.gather(mi.UInt32, of, pixel, active) for of in (found, ends - found))
    _move(dense, places, pixel, own, to, size)
    dr.eval(dense)
    return Pairs(found.numpy().astype(np.int64), *(one.numpy()[:total] for one in dense))


def _entries(count: int) -> list[Any]:
    """Memory for steps and light of `count` entries."""
    return [dr.empty(dr.uint8_array_t(mi.UInt32), count), dr.empty(mi.UInt32, count)]


def _threads(points: int) -> tuple[Any, Any]:
    """Each thread's point, and whether it has one: all cores have equally many threads, in pieces of their own."""
    cores = dr.thread_count() if "llvm" in mi.variant() else 1
    blocks = cores * -(-points // (cores * BLOCK)) if cores > 1 else 1
    own = -(-points // blocks)
    own = min(BLOCK, -(-own // 16) * 16) if cores > 1 else own  # whole vectors
    thread = dr.arange(mi.UInt32, (blocks - 1) * BLOCK + own)
    within = thread % BLOCK if blocks > 1 else thread
    pixel = (thread // BLOCK) * dr.opaque(mi.UInt32, own) + within if blocks > 1 else thread
    return pixel, (within < dr.opaque(mi.UInt32, own)) & (pixel < dr.opaque(mi.UInt32, points))


class _Lit:
    """Points on the device, and the light they receive by one term."""

    def __init__(
        self, points: ViewPoints, lights: TriangleLights, seen: NDArray[np.uint32], term: Term, bands: Sequence[Bands]
    ) -> None:
        self._bands, self._term, self._many = bands, term, len(points)
        self.counts = [b.count for b in bands]
        self._arrays = [vectors(mi.Vector3f, of) for of in (points.p, points.t, points.b, points.n, points.wo)]
        self._lights, self._number = lights_on_device(lights), dr.opaque(mi.UInt32, len(lights))
        self._seen = mi.UInt32(seen.ravel())
        rough = varies(term) and (points.roughness != 1).any()
        self._roughness = mi.Float(points.roughness) if rough else None
        self._sheet = vectors(mi.Vector3f, points.sheet) if points.sheet.any() else None

    def __len__(self) -> int:
        return self._many

    def rows(self, begin: int, count: int) -> tuple[Any, Any, Any]:
        """Transport by `count` bands of the first curve from `begin`, (count, 3) or (count, K, 3), of each thread.

        Also returns each thread's point, and whether it has one.
        """
        pixel, active = _threads(self._many)
        p, *axes, seen_from = (dr.gather(mi.Vector3f, array, pixel, active) for array in self._arrays)
        wo, ops, term, bands = tuple(seen_from), array_ops(), self._term, self._bands
        mirrored, turned = -1.0 if term.side == "transmission" else 1.0, -1.0 if term.side == "retro" else 1.0

        rough = None if self._roughness is None else dr.gather(mi.Float, self._roughness, pixel, active)
        sheet = None if self._sheet is None else dr.gather(mi.Vector3f, self._sheet, pixel, active)

        # Dr.Jit's loops rebuild dataclasses, which fails for frozen ones: closures keep them out of the loop state.
        def local(w: Any) -> Any:
            return dr.dot(w, axes[0]) * turned, dr.dot(w, axes[1]) * turned, dr.dot(w, axes[2]) * mirrored

        def steps(w: Any) -> list[Any]:
            """The angles of a direction, in units of bands."""
            wi = local(w)
            angles = [angle_of(b.factor.over, wi, wo, b.factor.stretch, dr) for b in bands]
            if rough is not None:
                angles = [narrowed(b.factor.over, angle, rough, dr) for angle, b in zip(angles, bands, strict=True)]
            return [in_bands(angle, b.count) for angle, b in zip(angles, bands, strict=True)]

        def height(w: Any) -> Any:
            above = dr.dot(w, axes[2]) * mirrored
            if sheet is None:
                return above
            return dr.select(dr.squared_norm(sheet) > 0, dr.minimum(above, dr.dot(w, sheet) * mirrored), above)

        def quotient(w: Any) -> Any:
            """rho_q of a direction on the side that the term scatters from."""
            wi = local(w)
            value = term.quotient.evaluate(wi, wo, ops)
            value = mi.Vector3f(*value) if isinstance(value, tuple) else mi.Vector3f(value)
            return value if rough is None else value * thinned(term, wi, wo, rough, ops)

        size = 3 * count * int(np.prod(self.counts[1:]))
        row = _cleared(dr.alloc_local(mi.Float, size), dr.opaque(mi.UInt32, size))
        part = dr.opaque(mi.UInt32, begin), dr.opaque(mi.UInt32, begin + count)
        row = accumulate(
            row, part, pixel, active, dr.opaque(mi.UInt32, self._many), p, self._lights, self._seen, self._number,
            axes[2] * mirrored, local, steps, height, quotient, self.counts,
        )  # fmt: skip
        return row, pixel, active


@dr.syntax
def _cleared(row, size):  # type: ignore[no-untyped-def]
    """A thread's memory, zeroed in a loop: zeroed by `alloc_local`, LLVM compiles one store per number."""
    j = mi.UInt32(0)
    while j < size:
        row[j] = mi.Float(0)
        j += 1
    return row


@dr.syntax
def _write(total, row, pixel, pixels, active, count):  # type: ignore[no-untyped-def]
    """Write each thread's row once."""
    j = mi.UInt32(0)
    while j < 3 * count:
        dr.scatter(total, row[j], j * pixels + pixel, active)
        j += 1


@dr.syntax
def _merge(row, active, share, second, size):  # type: ignore[no-untyped-def]
    """Add each band's small entries to the last large one before them, or to the first."""
    begin = mi.UInt32(0)
    while active & (begin < size):
        light, k = mi.Float(0), mi.UInt32(0)
        while k < second:
            light += _sum(row, begin + k)
            k += 1
        least, to, k = share * light, mi.UInt32(0xFFFFFFFF), mi.UInt32(0)
        before = mi.Vector3f(0)
        while (k < second) & (light > 0):
            at = begin + k
            if _sum(row, at) >= least:
                to = mi.UInt32(at)
                add(row, 3 * at, before)
                before = mi.Vector3f(0)
            else:
                value = mi.Vector3f(row[3 * at], row[3 * at + 1], row[3 * at + 2])
                if to == 0xFFFFFFFF:
                    before += value
                else:
                    add(row, 3 * to, value)
                add(row, 3 * at, -value)
            k += 1
        begin += second


def _sum(row: Any, at: Any) -> Any:
    return row[3 * at] + row[3 * at + 1] + row[3 * at + 2]


@dr.syntax
def _pack(places, counts, last, row, pixel, active, scale, first, size):  # type: ignore[no-untyped-def]
    """Write each thread's nonblack pairs to the beginning of its `size` places."""
    code, found = mi.UInt32(0), mi.UInt32(0)
    before = dr.gather(mi.UInt32, last, pixel, active)
    while active & (code < size):
        rgb = [dr.clip(row[3 * code + c] * scale[c], 0, LARGEST) for c in range(3)]
        bits = packed(tuple(rgb), _bits, _floats, mi.UInt32, dr)
        step = first + code - before
        kept = ((bits & ONES) > 0) | (step == LONGEST)
        at = pixel * size + found
        dr.scatter(places[0], type(places[0])(step), at, kept)
        dr.scatter(places[1], bits, at, kept)
        found += dr.select(kept, 1, 0)
        before = dr.select(kept, first + code, before)
        code += 1
    dr.scatter(counts, found, pixel, active)
    dr.scatter(last, before, pixel, active)


def _bits(value: Any) -> Any:
    return dr.reinterpret_array(mi.UInt32, value)


def _floats(bits: Any) -> Any:
    return dr.reinterpret_array(mi.Float, bits)


@dr.syntax
def _move(to, places, pixel, count, begin, size):  # type: ignore[no-untyped-def]
    """Compact the entries of all threads, from `begin`."""
    i = mi.UInt32(0)
    while i < count:
        for k in range(2):
            dr.scatter(to[k], dr.gather(type(places[k]), places[k], pixel * size + i), begin + i)
        i += 1
