"""Sorting of paths into the bands of a term and of second surfaces (Ben-Artzi 2007, eqs 6.2, 6.4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baked.transport.tails import Tails
from lambent.baking.interreflection.evaluation import Curves, quotient_of
from lambent.baking.interreflection.paths import WAYS, Paths, put
from lambent.baking.interreflection.sums import Sorted
from lambent.baking.tracing.array_ops import array_ops
from lambent.baking.tracing.rays import vectors
from lambent.baking.transport.bands import Bands
from lambent.baking.transport.view_points import ViewPoints
from lambent.materials.factored.curve import END_RAD
from lambent.materials.factored.parametrisations import angle_of
from lambent.materials.factored.terms import Editable, Term, narrowed, thinned, upper_pair, varies


@dataclass(frozen=True)
class SecondTerm:
    """A term of material number `material` at second surfaces; None for an uneditable one, whose BRDF the paths use."""

    material: int
    term: Term | None
    bands: tuple[Bands, ...]

    def evaluate(self, wi: Any, wo: Any, ops: Any) -> tuple[Any, Any]:
        """Factor on the path's light, and its band."""
        if self.term is None:
            return mi.Vector3f(1.0), mi.UInt32(0)
        return by_bands(self.term, self.bands, wi, wo, ops)


class Sorting:
    """Sorts the paths of some points; shares the work common to all terms of a material."""

    def __init__(self, paths: Paths, points: ViewPoints, tails: Tails, seconds: Sequence[SecondTerm] = ()) -> None:
        self._paths, self._points, self._ops = paths, points, array_ops()
        self._wo = dr.gather(mi.Vector3f, vectors(mi.Vector3f, points.wo), paths.at)
        numbers = range(2, tails.most_hits + 1)
        self._widths = np.repeat([len(tails.multisets(n)) for n in numbers], WAYS)
        width = dr.width(paths.wi)
        self._second = np.zeros((0, 2, width, 4), np.float32)
        if paths.second is not None:
            self._second = _second_surfaces(paths, tails, seconds, self._ops)

    def by_term(self, term: Term, bands: Sequence[Bands]) -> Sorted:
        """Sort by the bands of a term's curves, first curve first."""
        texture = self._gathered(self._points.diffuse if term.is_diffuse else self._points.specular)
        rough = None
        if varies(term) and (self._points.roughness != 1).any():
            rough = dr.gather(mi.Float, mi.Float(self._points.roughness), self._paths.at)
        value, band = by_bands(term, bands, self._paths.wi, self._wo, self._ops, rough)
        return self._sorted(value * texture, band)

    def whole(self, material: Editable) -> Sorted:
        """Sort into the single band of an uneditable material."""
        width = dr.width(self._paths.wi)
        textures = (self._gathered(texture) for texture in (self._points.diffuse, self._points.specular))
        value = Curves(material, self._ops).evaluate(self._paths.wi, self._wo, *textures)
        return self._sorted(value * dr.abs(self._paths.wi.z), dr.zeros(mi.UInt32, width))

    def _gathered(self, texture: np.ndarray) -> Any:
        return dr.gather(mi.Vector3f, vectors(mi.Vector3f, texture), self._paths.at)

    def _sorted(self, value: Any, band: Any) -> Sorted:
        value = dr.select(self._paths.weight > 0, value * self._paths.weight, 0.0)
        first = dr.empty(mi.Float, 4 * dr.width(self._paths.wi))
        put(first, value, band, dr.arange(mi.UInt32, dr.width(self._paths.wi)))
        light = self._paths.light.numpy().reshape(len(self._widths), -1, 4)
        return Sorted(first.numpy().reshape(-1, 4), light, self._paths.arrived.numpy(), self._second, self._widths)


def by_bands(term: Term, bands: Sequence[Bands], wi: Any, wo: Any, ops: Any, rough: Any = None) -> tuple[Any, Any]:
    """rho_q |cos| of directions in the local frame, and their band over all curves together.

    `rough` is the texture's factor on slopes.
    """
    (light, viewer), seen = upper_pair(tuple(wi), tuple(wo), term.side, ops)
    band = mi.UInt32(0)
    for one in bands:
        angle = angle_of(one.factor.over, light, viewer, one.factor.stretch, ops)
        angle = angle if rough is None else narrowed(one.factor.over, angle, rough, ops)
        band = band * one.count + dr.minimum(mi.UInt32(angle * (one.count / END_RAD)), one.count - 1)
    value = quotient_of(term, light, viewer, ops)
    value = value if rough is None else value * thinned(term, light, viewer, rough, ops)
    return dr.select(seen, value * light[2], 0.0), band


def _second_surfaces(paths: Paths, tails: Tails, seconds: Sequence[SecondTerm], ops: Any) -> np.ndarray:
    """(terms, 2, n, 4) factors and bands of the terms at each path's second surface, in the layout of `Sorted`."""
    second, begin, turn = paths.second, 0, dict[int, int]()
    assert second is not None
    width = dr.width(paths.wi)
    found: list[list[list[Any]]] = []
    for one, size in zip(seconds, (each.size for each in tails.second), strict=True):
        number = turn.setdefault(one.material, 0)
        turn[one.material] += 1
        if number == len(found):
            found.append([[dr.zeros(mi.Vector3f, width), dr.zeros(mi.UInt32, width)] for _ in range(2)])
        here = second.material == one.material
        for way, wi in zip(found[number], (second.wi_lit, second.wi), strict=True):
            value, band = one.evaluate(wi, second.wo, ops)
            way[0] = dr.select(here, value, way[0])
            way[1] = dr.select(here, band + begin, way[1])
        begin += size
    together = dr.empty(mi.Float, 4 * 2 * len(found) * width)
    index, stride = dr.arange(mi.UInt32, width), dr.opaque(mi.UInt32, width)  # keeps the width out of the kernel
    for k, (value, band) in enumerate(way for term in found for way in term):
        put(together, value, band, k * stride + index)
    return np.asarray(together.numpy().reshape(len(found), 2, width, 4))
