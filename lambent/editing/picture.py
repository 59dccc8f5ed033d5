"""The edited picture of a view: every term of every material as an incremental picture, over the unedited part.

    radiance = sum over terms of  f_q f_o(theta_o)  sum over j of  c_j T_j        (Ben-Artzi 2007, eqs 3.1, 4.6)

Scales and curves of the viewer multiply whole pixels, so their edits are exact at once.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats, Image, Indices
from lambent.core.discovery import known
from lambent.editing.canvas import Canvas, HostCanvas, Layer
from lambent.editing.incremental import RENEWED_IN, TERMS, IncrementalPicture
from lambent.editing.products import Products
from lambent.editing.rows import PairTransport, Rows, coefficients_of
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.of_models import same_quotients
from lambent.materials.factored.terms import Editable, Term


@dataclass(frozen=True)
class Part:
    """The pixels that show one material, and their transport.

    Attributes
    ----------
    start : Editable
        The material for which transport was computed.
    pixel : (P,) int
        row * width + column, without repeats.
    theta_o : (P,)
        Angle between the viewer and the normal, in radians.
    transport : tuple
        For each term of `start`: pairs for one with two curves, otherwise rows. Textures are part of it.
    """

    start: Editable
    pixel: Indices
    theta_o: Floats
    transport: tuple[Rows | PairTransport, ...]


class TransportNeeded(Exception):
    """Transport of a material cannot show an edit that changes a quotient.

    Attributes
    ----------
    material : str
    terms : tuple of str
        Names of the terms that need new transport.
    """

    def __init__(self, material: str, terms: tuple[str, ...]) -> None:
        super().__init__(f"{material}: transport of {', '.join(terms)} has to be computed")
        self.material, self.terms = material, terms


class EditedPicture:
    """The picture of a view while its materials are edited.

    Parameters
    ----------
    background : (H, W, 3) float32
        Linear radiance of the unedited part; in pixels of parts, the emission of their surfaces.
    parts
        By material name.
    canvas
        Creates the canvas; by default in memory.

    Attributes
    ----------
    canvas : Canvas
    """

    def __init__(
        self, background: Image, parts: Mapping[str, Part], canvas: Callable[[Image], Canvas] = HostCanvas
    ) -> None:
        self.canvas = canvas(background)
        self._covered = np.zeros(background.shape[0] * background.shape[1], np.int64)
        self._parts: dict[str, Part] = {}
        self._terms: dict[str, list[_TermPicture]] = {}
        for name, part in parts.items():
            self.put(name, part)

    def put(self, material: str, part: Part) -> None:
        """Add a material, or replace its transport (more lights, another quotient), and draw `part.start`."""
        made = zip(part.start.terms, part.transport, strict=True)
        terms = [_TermPicture(term, transport, part, self.canvas) for term, transport in made]
        for term, start in zip(terms, part.start.terms, strict=True):
            term.show(part.start.curves, start)
            term.draw()
        before = self._parts.get(material)
        if before is not None:
            self._covered[before.pixel] -= 1
        self._covered[part.pixel] += 1
        assert self._covered.max(initial=0) <= 1, f"a pixel of {material} shows another material too"
        self._parts[material], self._terms[material] = part, terms

    def show(self, material: str, edited: Editable) -> None:
        """Set a material as now edited as the target; frames approach it by `step`, `draw` reaches it at once.

        Of two curves in a term, the one that changes becomes active. Raises `TransportNeeded`, leaving the picture
        unchanged, if the transport cannot show the edit, and `UserError` if no pixel shows the material.
        """
        known("material in view", material, self._parts)
        part, terms = self._parts[material], self._terms[material]
        if not same_quotients(part.start, edited):
            before = {term.name: (term.quotient, term.factors, term.side) for term in part.start.terms}
            new = [t.name for t in edited.terms if before.get(t.name) != (t.quotient, t.factors, t.side)]
            raise TransportNeeded(material, tuple(new or (term.name for term in edited.terms)))
        for term, now in zip(terms, edited.terms, strict=True):
            term.show(edited.curves, now)

    def activate(self, material: str, curve: str) -> None:
        """Make a curve the active one of its terms, before it is dragged. Raises the errors of `show`."""
        known("material in view", material, self._parts)
        known("curve", curve, self._parts[material].start.curves)
        for term in self._terms[material]:
            term.activate(curve)

    def step(self, terms: int = TERMS) -> None:
        """One frame: the `terms` largest changes over all active pictures."""
        active = [term for pictures in self._terms.values() for term in pictures if not term.is_settled]
        sizes = [term.sizes_of_changes() for term in active]
        whose = np.repeat(np.arange(len(active)), [len(size) for size in sizes])
        size = np.concatenate([*sizes, np.zeros(0)])
        largest = np.argpartition(-size, terms - 1)[:terms] if len(size) > terms else np.arange(len(size))
        shares = np.bincount(whose[largest[size[largest] > 0]], minlength=len(active))
        if not shares.any():  # squares of tiny changes underflow to 0
            shares[:] = terms
        for term, share in zip(active, shares, strict=True):
            term.step(int(share))

    def draw(self) -> None:
        """Draw the exact picture at once."""
        for terms in self._terms.values():
            for term in terms:
                term.draw()

    @property
    def is_exact(self) -> bool:
        """Whether the picture shows the target exactly."""
        return all(term.picture.is_exact for terms in self._terms.values() for term in terms)

    @property
    def is_settled(self) -> bool:
        """Whether it is exact and every pixel has been recomputed since: another frame would not change a bit."""
        return all(term.is_settled for terms in self._terms.values() for term in terms)

    def compose(self) -> None:
        """Update the canvas; a frame shown from a GPU's memory ends with this."""
        self.canvas.compose(self.shown)

    @property
    def shown(self) -> list[tuple[Layer, NDArray[np.float32]]]:
        """Layers with their scales, for composition."""
        return [(term.layer, term.scale) for terms in self._terms.values() for term in terms]

    def image(self) -> Image:
        """(H, W, 3) float32, linear radiance."""
        self.compose()
        return self.canvas.image()


class _TermPicture:
    """One term: its incremental picture over the active curve, and its factors."""

    def __init__(self, term: Term, transport: Rows | PairTransport, part: Part, canvas: Canvas) -> None:
        self._factors = term.factors
        self._pairs = None if isinstance(transport, Rows) else transport
        self._counts = (len(transport.values),) if isinstance(transport, Rows) else transport.counts
        assert self._pairs is None or len(term.factors) == 2, "pairs are of two curves"
        self.layer = canvas.layer(part.pixel, part.theta_o)
        self._viewer: Curve | None = None
        self._shown, self._colour = part.start.curves, term.scale
        self._to_renew = 0  # blocks of pixels not recomputed since the last edit
        self._active = 0
        if isinstance(transport, Rows):
            self._use(self.layer.hold(transport.values), transport.unit)
        else:
            self._use(*self._folded())

    @property
    def is_settled(self) -> bool:
        return self.picture.is_exact and self._to_renew <= 0

    def show(self, curves: Mapping[str, Curve], term: Term) -> None:
        """Set curves, and the scale of `term`, as the target."""
        before, self._shown, self._colour = self._shown, curves, term.scale
        viewer = curves[term.viewer] if term.viewer else None
        if viewer is not self._viewer:
            self._viewer = viewer
            self.layer.view(viewer)
        if self._pairs is not None and self._changed(before, 1 - self._active):
            self._refold(self._active if self._changed(before, self._active) else 1 - self._active)
        self._want()

    def activate(self, curve: str) -> None:
        """Fold in the other curve if this term has two and `curve` is idle."""
        if self._pairs is not None and self._factors[1 - self._active].curve == curve:
            self._refold(1 - self._active)

    @property
    def scale(self) -> NDArray[np.float32]:
        """(3,) radiance of value 1 in the picture."""
        return np.asarray(np.multiply(self._colour, self._unit), np.float32)

    def sizes_of_changes(self) -> Floats:
        """(J,) squared visible size of the changes left for later frames."""
        change = (self.picture.wanted - self.picture.effective) * self.scale
        return np.asarray(np.sum(change * change, axis=1))

    def step(self, terms: int) -> None:
        self.picture.step(terms)
        self._to_renew -= 1

    def draw(self) -> None:
        self.picture.draw()
        self._to_renew = 0

    def _want(self) -> None:
        wanted = self._coefficients(self._shown, self._active) if self._factors else np.ones((1, 3))
        if not np.array_equal(wanted, self.picture.wanted):
            self.picture.want(wanted)
            self._to_renew = RENEWED_IN

    def _use(self, products: Products, unit: float) -> None:
        self._unit, self.picture = unit, IncrementalPicture(products)

    def _refold(self, active: int) -> None:
        self._active = active
        self._use(*self._folded())
        self._want()
        self.draw()

    def _folded(self) -> tuple[Products, float]:
        """Products over the active curve, with the idle one as shown folded in, and the radiance of value 1."""
        assert self._pairs is not None
        idle = 1 - self._active
        factor = self._factors[idle]
        values = self._shown[factor.curve].node_values(self._counts[idle], factor.polar)
        return self.layer.fold(self._pairs, idle, values)

    def _coefficients(self, curves: Mapping[str, Curve], factor: int) -> Floats:
        over = self._factors[factor]
        return coefficients_of(curves[over.curve], self._counts[factor], over.polar)

    def _changed(self, before: Mapping[str, Curve], factor: int) -> bool:
        then, now = self._coefficients(before, factor), self._coefficients(self._shown, factor)
        return then is not now and not np.array_equal(then, now)
