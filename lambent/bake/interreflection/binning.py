"""Paths sorted into the bands of a term: T_jz of every point (Ben-Artzi 2007, eqs 6.1, 6.2).

One thread is one point, which walks through its samples: no two threads add to one place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.bake.interreflection.paths import NONE, WAYS, Paths
from lambent.bake.tracing.array_ops import array_ops
from lambent.bake.tracing.rays import array_of, vectors
from lambent.bake.transport.bands import Bands
from lambent.bake.transport.view_points import ViewPoints
from lambent.materials.factored.albedo import is_flat
from lambent.materials.factored.curve import END_RAD, KNOTS
from lambent.materials.factored.parametrisations import angle_of
from lambent.materials.factored.terms import Editable, Term, upper_pair
from lambent.store.tails import Tails

CHANNELS = 3


def by_bands(term: Term, bands: Sequence[Bands], wi: Any, wo: Any, ops: Any) -> tuple[Any, Any]:
    """rho_q |cos| of directions in the local frame, and the band, of all curves together, that they are in."""
    (light, viewer), seen = upper_pair(tuple(wi), tuple(wo), term.side, ops)
    quotient = term.quotient.evaluate(light, viewer, ops)
    value = mi.Vector3f(*quotient) if isinstance(quotient, tuple) else mi.Vector3f(quotient)
    band = mi.UInt32(0)
    for one in bands:
        angle = angle_of(one.factor.over, light, viewer, one.factor.stretch, ops)
        band = band * one.count + dr.minimum(mi.UInt32(angle * (one.count / END_RAD)), one.count - 1)
    return dr.select(seen, value * light[2], 0.0), band


@dataclass(frozen=True)
class SecondTerm:
    """A term of the material of that number at second surfaces; no term where it is not edited: paths know it."""

    material: int
    term: Term | None
    bands: tuple[Bands, ...]

    @property
    def size(self) -> int:
        return int(np.prod([one.count for one in self.bands], dtype=int))

    def evaluate(self, wi: Any, wo: Any, ops: Any) -> tuple[Any, Any]:
        """Factor of the path's light, and its band."""
        if self.term is None:
            return mi.Vector3f(1.0), mi.UInt32(0)
        return by_bands(self.term, self.bands, wi, wo, ops)


class Sums:
    """Sums over samples for a block of points: (points, tails, bands, 3) on the device."""

    def __init__(self, points: int, tails: Tails, bands: int, seconds: Sequence[SecondTerm] = ()) -> None:
        self.points, self.tails, self.bands, self.seconds = points, len(tails), bands, seconds
        hits = np.repeat(np.arange(2, tails.most_hits + 1), WAYS)
        self._widths = [len(tails.multisets(n)) for n in hits]  # tails of each band of a second surface, by entry
        self.total = dr.zeros(mi.Float, points * len(tails) * bands * CHANNELS)

    def add(self, paths: Paths, points: ViewPoints, term: Term, bands: Sequence[Bands]) -> None:
        """Add paths by the bands of a term's curves, numbered first curve first."""
        wo, ops = vectors(mi.Vector3f, points.wo), array_ops()
        texture = vectors(mi.Vector3f, _texture(points, term))

        def scattered(wi: Any) -> tuple[Any, Any]:
            value, band = by_bands(term, bands, wi, wo, ops)
            return value * texture, band

        self._add(paths, scattered)

    def add_known(self, paths: Paths, points: ViewPoints, material: Editable) -> None:
        """Add paths to the one band of a material whose curves stay as they are."""
        wo, ops = tuple(vectors(mi.Vector3f, points.wo)), array_ops()
        tables = {name: [mi.Float(column) for column in curve.values.T] for name, curve in material.curves.items()}

        def scattered(wi: Any) -> tuple[Any, Any]:
            total = mi.Vector3f(0.0)
            for term in material.terms:
                (light, viewer), seen = upper_pair(tuple(wi), wo, term.side, ops)
                quotient = term.quotient.evaluate(light, viewer, ops)
                value = mi.Vector3f(*quotient) if isinstance(quotient, tuple) else mi.Vector3f(quotient)
                value *= mi.Vector3f(*term.scale) * vectors(mi.Vector3f, _texture(points, term))
                for factor in term.factors:
                    value *= _looked_up(tables[factor.curve], angle_of(factor.over, light, viewer, factor.stretch, ops))
                if term.viewer:
                    value *= _looked_up(tables[term.viewer], angle_of("theta_o", light, viewer, 1.0, ops))
                total += dr.select(seen, value * light[2], 0.0)
            return total, mi.UInt32(0)

        self._add(paths, scattered)

    def _add(self, paths: Paths, scattered: Any) -> None:
        assert paths.points == self.points
        _sum(
            self.total, paths.wi, paths.weight, paths.light, paths.tail, dr.opaque(mi.UInt32, paths.points),
            dr.opaque(mi.UInt32, paths.samples), scattered, dr.arange(mi.UInt32, paths.points),
            dr.opaque(mi.UInt32, self.tails), self.bands, self._second_surfaces(paths),
        )  # fmt: skip
        dr.eval(self.total)

    def _second_surfaces(self, paths: Paths) -> list[Any]:
        """For each term of second surfaces: factors and offsets of the tail, of every entry of a path."""
        if paths.second is None:
            return [lambda at: [(None, mi.UInt32(0))] * len(self._widths)]
        second, ops, begin, found = paths.second, array_ops(), 0, []
        for one in self.seconds:

            def scattered(at: Any, one: SecondTerm = one, begin: int = begin) -> list[tuple[Any, Any]]:
                wo = dr.gather(mi.Vector3f, second.wo, at)
                here = dr.gather(mi.UInt32, second.material, at) == one.material
                ways = []
                for wi in (second.wi_lit, second.wi):
                    value, band = one.evaluate(dr.gather(mi.Vector3f, wi, at), wo, ops)
                    ways.append((dr.select(here, value, 0.0), band + begin))
                # The second surface's own light comes from the light that was sampled; all other, from where the path went.
                return [
                    (value, band * dr.opaque(mi.UInt32, width))
                    for (value, band), width in zip([ways[0], *[ways[1]] * (len(self._widths) - 1)], self._widths, strict=True)
                ]

            found.append(scattered)
            begin += one.size
        return found

    def put(self, place: np.ndarray, light: np.ndarray) -> None:
        """Begin with sums (N, 3) at places (point * tails + tail) * bands + band."""
        at = mi.UInt32(place.astype(np.uint32)) * CHANNELS
        for c in range(CHANNELS):
            dr.scatter(self.total, mi.Float(np.ascontiguousarray(light[:, c], np.float32)), at + c)
        dr.eval(self.total)

    def entries(self, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points (N,), numbers tail * bands + band (N,), and means (N, 3) where they are not 0, in this order."""
        index = dr.arange(mi.UInt32, self.points * self.tails * self.bands)
        value = dr.gather(mi.Vector3f, self.total, index)
        kept = dr.compress(value.x + value.y + value.z > 0)
        light = array_of(dr.gather(mi.Vector3f, self.total, kept)) / np.float32(samples)
        point, code = np.divmod(np.array(kept), np.uint32(self.tails * self.bands))
        return point, code, light


def _texture(points: ViewPoints, term: Term) -> np.ndarray:
    return points.diffuse if is_flat(term) else points.specular


def _looked_up(table: Any, angle: Any) -> Any:
    at = dr.clip(angle * (KNOTS / END_RAD), 0, KNOTS)
    k = dr.minimum(mi.UInt32(at), KNOTS - 1)
    share = at - mi.Float(k)
    return mi.Vector3f(*(dr.gather(mi.Float, c, k) * (1 - share) + dr.gather(mi.Float, c, k + 1) * share for c in table))


@dr.syntax
def _sum(total, wi, weight, light, tail, points, samples, scattered, point, tails, bands, seconds):  # type: ignore[no-untyped-def]
    s = mi.UInt32(0)
    while s < samples:
        at = s * points + point
        one = dr.gather(mi.Float, weight, at)
        if one > 0:
            value, band = scattered(dr.gather(mi.Vector3f, wi, at))
            value *= one
            for second in seconds:
                for arriving, number, (factor, offset) in zip(light, tail, second(at)):
                    brought = value * mi.Vector3f(dr.gather(mi.Color3f, arriving, at))
                    if dr.hint(factor is not None, mode="scalar"):
                        brought *= factor
                    z = dr.gather(mi.UInt32, number, at) + offset
                    place = ((point * tails + z) * bands + band) * CHANNELS
                    some = dr.max(brought) > 0
                    for c in range(CHANNELS):
                        dr.scatter_add(total, brought[c], place + c, some, mode=dr.ReduceMode.NoConflicts)
        s += 1
