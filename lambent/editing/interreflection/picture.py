"""The interreflections of an edited view, as layers on the canvas of its direct light.

    B = sum over monomials q of  m_q(d_i)  sum over bands of  c_j F_jq        (Ben-Artzi 2007, eq. 6.8)

Some curves of one material i are edited and called active; all others are frozen. Incremental pictures cover the
material's own terms with an active curve, over its bands, and all pixels, over its bands at second surfaces. All other
inner sums stay constant.

A pixel's light is a polynomial in the albedos of the edited material, with one incremental picture per monomial:

    sum over monomials q of  m_q  sum over rows r and bands j of  s_r c_j F_qrj

Rows are the bands of the edited material at the second surface, bands those of its curve at the first. The same edit
changes both; frames apply the largest changes of their products.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats, Indices
from lambent.editing.canvas import Canvas, Layer, viewed
from lambent.editing.incremental import RENEWED_IN, TERMS, IncrementalPicture
from lambent.editing.interreflection.entries import Cells, TermLight, add_pixels, halves, rows
from lambent.editing.interreflection.powers import Active, Powers, active_bands, active_of, band_of, bands_of, powers
from lambent.editing.interreflection.stored import Interreflections, PartLight
from lambent.editing.products import Halves, Pixels
from lambent.editing.rows import wavelets_of
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.of_models import same_quotients
from lambent.materials.factored.terms import Editable, Term

BEYOND_DIRECT = (2, 99)  # least and most surfaces on paths
Shown = list[tuple[Layer, NDArray[np.float32]]]
ONE = np.ones((1, 3))


class FrozenPicture:
    """The interreflections while one material is edited.

    Parameters
    ----------
    materials
        All current materials of the view.
    edited : str
        The edited material.
    canvas : Canvas
        Creates the layers.
    active : names of curves, optional
        The edited curves; in terms with two of them, the first is used.
    hits : (int, int)
        Least and most surfaces on the shown paths.

    Attributes
    ----------
    edited, active, hits, materials
        As given.
    """

    def __init__(
        self,
        light: Interreflections,
        materials: Mapping[str, Editable],
        edited: str,
        canvas: Canvas,
        active: Collection[str] = (),
        hits: tuple[int, int] = BEYOND_DIRECT,
    ) -> None:
        self.edited, self.active, self.hits, self.materials = edited, frozenset(active), hits, materials
        material = materials[edited]
        self._powers = powers(light.tails, materials, edited, hits, active_of(material, active))
        self._idle = _idle(material, self._powers.active)
        self._pixels = sum(len(part.pixel) for part in light.parts.values())
        self._others: list[tuple[list[MonomialPicture], np.float32]] = []
        self._terms: list[_TermPicture] = []
        for name, part in light.parts.items():
            if name == edited and part.edited:
                pairs = zip(material.terms, part.terms, self._powers.active, strict=True)
                self._terms = [_TermPicture(*one, part, material, self._powers, canvas) for one in pairs]
            else:
                cells = Cells.of(self._powers, np.unique(np.concatenate([term.met for term in part.terms])))
                held, unit = halves(frozen_light(part, materials[name], self._powers, cells))
                self._others.append((monomials(held, cells, part, canvas), np.float32(unit)))
        self.show(material)
        self.draw()

    def serves(self, material: Editable, active: str | None = None) -> bool:
        """Whether this picture can show the edited material, and edit curve `active` if it has it."""
        begun = self.materials[self.edited]
        if not same_quotients(begun, material) or changed(begun, material) & self._idle:
            return False
        wanted = active_of(material, () if active is None else {active})
        return all(at is None or at == mine for at, mine in zip(wanted, self._powers.active, strict=True))

    def show(self, material: Editable) -> None:
        """Set the material as now edited as the target of the picture."""
        self._values = self._powers.values(material).astype(np.float32)
        second = self._powers.second(material)
        for pictures, _ in self._others:
            for one in pictures:
                one.want(second, ONE)
        for term, now in zip(self._terms, material.terms, strict=bool(self._terms)):
            term.show(material, now, second)

    def step(self, terms: int = TERMS) -> None:
        """One frame, with the work of adding `terms` terms in all pixels."""
        step(self._all, terms * self._pixels)

    def draw(self) -> None:
        """Draw the exact picture at once."""
        for one in self._all:
            one.draw()

    @property
    def is_exact(self) -> bool:
        return all(one.is_exact for one in self._all)

    @property
    def is_settled(self) -> bool:
        """Whether another frame would not change a bit."""
        return all(one.is_settled for one in self._all)

    @property
    def shown(self) -> Shown:
        """Layers with their scales, for composition."""
        scaled = [*self._others, *((term.pictures, term.scale) for term in self._terms)]
        return [(one.layer, self._values[one.power] * scale) for pictures, scale in scaled for one in pictures]

    @property
    def _all(self) -> list[MonomialPicture]:
        return [one for pictures, _ in self._others for one in pictures] + [
            one for term in self._terms for one in term.pictures
        ]


class _TermPicture:
    """One term of the edited material, over its active curve if it has one."""

    def __init__(
        self,
        term: Term,
        light: TermLight,
        at: int | None,
        part: PartLight,
        material: Editable,
        power: Powers,
        canvas: Canvas,
    ) -> None:
        self._at, self._counts, cells = at, light.counts, Cells.of(power, light.met)
        idle = bands_of(term.factors, light.counts, material, at)
        count = light.counts[at] if at is not None else 1
        held, self._unit = rows(light, idle, power.weight, cells, band_of(light.counts, at), count)
        self.pictures = monomials(held, cells, part, canvas)
        self._viewer: Curve | None = None

    def show(self, material: Editable, term: Term, second: Floats) -> None:
        self.scale = np.asarray(np.multiply(term.scale, self._unit), np.float32)
        viewer = material.curves[term.viewer] if term.viewer else None
        if viewer is not self._viewer:
            self._viewer = viewer
            for one in self.pictures:
                one.layer.view(viewer)
        curve = wavelets_of(active_bands(term, self._counts, material, self._at))
        for one in self.pictures:
            one.want(second, curve)


def changed(before: Editable, after: Editable) -> frozenset[str]:
    """Names of the curves that differ between two states of a material."""
    return frozenset(
        name
        for name, curve in after.curves.items()
        if name not in before.curves
        or (curve is not before.curves[name] and not np.array_equal(curve.values, before.curves[name].values))
    )


def frozen_light(part: PartLight, material: Editable, power: Powers, cells: Cells) -> Pixels:
    """(C, 3, P) light of a frozen material, by cells."""
    total = np.zeros((len(cells), 3, len(part.pixel)), np.float32)
    if not part.edited:
        add_pixels(total, part.terms[0], ONE, power.weight, cells, np.ones((3, 1)))
        return total
    for term, light in zip(material.terms, part.terms, strict=True):
        scale = np.asarray(term.scale, np.float32)[:, None]
        if term.viewer:
            scale = scale * viewed(part.theta_o, material.curves[term.viewer])
        add_pixels(total, light, bands_of(term.factors, light.counts, material), power.weight, cells, scale)
    return total


def _idle(material: Editable, active: Active) -> frozenset[str]:
    """Curves whose values are already in the sums."""
    pairs = zip(material.terms, active, strict=True)
    return frozenset(factor.curve for term, at in pairs for k, factor in enumerate(term.factors) if k != at)


class MonomialPicture:
    """One monomial of some pixels, as a layer of a canvas.

    Parameters
    ----------
    transport : (R, J, 3, P) float16
        By row, and by wavelet of the curve at the first surface.
    power : int
        Number of the monomial.
    rows : (R,)
        Index of each row's coefficient (`Powers.second`).
    """

    def __init__(self, transport: Halves, power: int, rows: Indices, part: PartLight, canvas: Canvas) -> None:
        self.power, self._rows, self.pixels = power, rows, transport.shape[-1]
        self.layer = canvas.layer(part.pixel, part.theta_o)
        self._picture = IncrementalPicture(self.layer.hold(transport.reshape(-1, *transport.shape[2:])))
        self._to_renew = 0

    def want(self, second: Floats, curve: Floats) -> None:
        """Show coefficients (all rows, 3) of second surfaces, and wavelets (J, 3) of the curve."""
        wanted = (second[self._rows][:, None] * curve).reshape(-1, 3)
        if not np.array_equal(wanted, self._picture.wanted):
            self._picture.want(wanted)
            self._to_renew = RENEWED_IN

    def step(self, terms: int) -> None:
        self._picture.step(terms)
        self._to_renew -= 1

    def draw(self) -> None:
        self._picture.draw()
        self._to_renew = 0

    @property
    def changes(self) -> int:
        """Number of terms left to change."""
        return int(np.count_nonzero((self._picture.wanted != self._picture.effective).any(axis=1)))

    @property
    def is_exact(self) -> bool:
        return self._picture.is_exact

    @property
    def is_settled(self) -> bool:
        return self.is_exact and self._to_renew <= 0


def monomials(transport: Halves, cells: Cells, part: PartLight, canvas: Canvas) -> list[MonomialPicture]:
    """Monomial pictures for transport (C, J, 3, P) by cells."""
    ends = np.flatnonzero(np.diff(cells.power, append=-1)) + 1
    parts = zip([0, *ends[:-1]], ends, strict=False)
    return [MonomialPicture(transport[a:b], int(cells.power[a]), cells.row[a:b], part, canvas) for a, b in parts]


def step(pictures: Sequence[MonomialPicture], work: int) -> None:
    """One frame of `work` terms times pixels: equal shares for all pictures, plus the unused shares of others."""
    going = sorted((one for one in pictures if not one.is_settled), key=lambda one: one.changes * one.pixels)
    for left, one in zip(range(len(going), 0, -1), going, strict=True):
        terms = min(one.changes, max(1, work // (left * max(1, one.pixels))))
        one.step(terms)
        work -= terms * one.pixels
