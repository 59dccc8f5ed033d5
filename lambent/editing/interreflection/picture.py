"""The interreflections of an edited view, as layers of the canvas that its direct light is drawn on.

    B = sum over monomials q of  m_q(d_i)  sum over bands of  c_j F_jq        (Ben-Artzi 2007, eq. 6.8)

One material i is edited; all others are frozen. Its own pixels are incremental pictures over its active curves, one for
each monomial; of all other pixels, the inner sums do not change.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from lambent.editing.canvas import Canvas, Layer, viewed
from lambent.editing.incremental import RENEWED_IN, TERMS, IncrementalPicture
from lambent.editing.interreflection.folding import pixels, rows
from lambent.editing.interreflection.powers import Powers, bands_of, powers
from lambent.editing.interreflection.stored import Interreflections, PartLight, TermLight
from lambent.editing.products import Pixels
from lambent.editing.rows import Rows, wavelets_of
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.of_models import same_quotients
from lambent.materials.factored.terms import Editable, Term

BEYOND_DIRECT = (2, 99)  # least and most surfaces on paths
Shown = list[tuple[Layer, NDArray[np.float32]]]


class FrozenPicture:
    """The interreflections while one material is edited.

    Parameters
    ----------
    materials
        All materials of the view, as they are now.
    edited : str
        The one that is edited.
    canvas : Canvas
        Makes the layers.
    active : str, optional
        Its curve that is edited, in terms that have two.
    hits : (int, int)
        Least and most surfaces on the paths that are shown.

    Attributes
    ----------
    edited, hits, materials
        As they were given.
    """

    def __init__(
        self,
        light: Interreflections,
        materials: Mapping[str, Editable],
        edited: str,
        canvas: Canvas,
        active: str | None = None,
        hits: tuple[int, int] = BEYOND_DIRECT,
    ) -> None:
        self.edited, self.hits, self.materials = edited, hits, materials
        self._powers = powers(light.tails, materials, edited, hits)
        self._others: list[list[_Sum]] = []
        self._terms: list[_TermPicture] = []
        for name, part in light.parts.items():
            if name == edited and part.edited:
                pairs = zip(materials[edited].terms, part.terms, strict=True)
                self._terms = [
                    _TermPicture(*pair, part, materials[edited], self._powers, active, canvas) for pair in pairs
                ]
            else:
                sums = frozen_light(part, materials[name], self._powers)
                self._others.append([_Sum(one, part, canvas) for one in sums])
        self.show(materials[edited])
        self.draw()

    def serves(self, material: Editable, active: str | None = None) -> bool:
        """Whether the edited material can be shown so: with the same terms, and one of two curves as it was."""
        return same_quotients(self.materials[self.edited], material) and all(
            term.serves(material, active) for term in self._terms
        )

    def show(self, material: Editable) -> None:
        """Let the picture go to the material as it is edited now."""
        self._values = self._powers.values(material).astype(np.float32)
        for term, now in zip(self._terms, material.terms, strict=bool(self._terms)):
            term.show(material, now)

    def step(self, terms: int = TERMS) -> None:
        """One frame: the largest changes of each term."""
        for term in self._terms:
            term.step(terms)

    def draw(self) -> None:
        """The exact picture at once."""
        for term in self._terms:
            term.draw()

    @property
    def is_exact(self) -> bool:
        return all(term.is_exact for term in self._terms)

    @property
    def is_settled(self) -> bool:
        """Whether another frame would change no bit."""
        return all(term.is_settled for term in self._terms)

    @property
    def shown(self) -> Shown:
        """Layers with their scales, to be composed."""
        others = [
            (one.layer, value * one.unit)
            for sums in self._others
            for one, value in zip(sums, self._values, strict=True)
        ]
        own = [
            (layer, value * term.scale)
            for term in self._terms
            for layer, value in zip(term.layers, self._values, strict=True)
        ]
        return others + own


class _Sum:
    """A picture (3, P) that stays as it is, as a layer."""

    def __init__(self, picture: Pixels, part: PartLight, canvas: Canvas) -> None:
        held = Rows.of_wavelets(picture[None])
        self.layer, self.unit = canvas.layer(part.pixel, part.theta_o, None), np.float32(held.unit)
        products = IncrementalPicture(self.layer.hold(held.values))
        products.want(np.ones((1, 3)))
        products.draw()


class _TermPicture:
    """One term of the edited material: an incremental picture for each monomial, over its active curve."""

    def __init__(
        self,
        term: Term,
        light: TermLight,
        part: PartLight,
        material: Editable,
        power: Powers,
        active: str | None,
        canvas: Canvas,
    ) -> None:
        names = [factor.curve for factor in term.factors]
        self._factors, self._counts = term.factors, light.counts
        self._at = names.index(active) if active in names else 0
        self._idle = {name: material.curves[name] for k, name in enumerate(names) if k != self._at}
        idle = bands_of(term.factors, light.counts, material, but=self._at)
        row = np.indices(light.counts)[self._at].reshape(-1) if light.counts else np.zeros(1, np.int64)
        count = light.counts[self._at] if light.counts else 1
        found, self._unit = rows(light, idle, power.weight, power.power, len(power.exponents), row, count)
        self.layers = [canvas.layer(part.pixel, part.theta_o, None) for _ in found]
        self._pictures = [IncrementalPicture(layer.hold(one)) for layer, one in zip(self.layers, found, strict=True)]
        self._viewer: Curve | None = None
        self._to_renew = 0

    def serves(self, material: Editable, active: str | None) -> bool:
        names = [factor.curve for factor in self._factors]
        if active in names and names.index(active) != self._at:
            return False
        return all(
            material.curves[name] is curve or np.array_equal(material.curves[name].values, curve.values)
            for name, curve in self._idle.items()
        )

    def show(self, material: Editable, term: Term) -> None:
        self.scale = np.asarray(np.multiply(term.scale, self._unit), np.float32)
        viewer = material.curves[term.viewer] if term.viewer else None
        if viewer is not self._viewer:
            self._viewer = viewer
            for layer in self.layers:
                layer.view(viewer)
        if self._factors:
            factor = self._factors[self._at]
            wanted = wavelets_of(material.curves[factor.curve].band_means(self._counts[self._at], factor.polar))
        else:
            wanted = np.ones((1, 3))
        if not np.array_equal(wanted, self._pictures[0].wanted):
            self._to_renew = RENEWED_IN
        for picture in self._pictures:
            picture.want(wanted)

    def step(self, terms: int) -> None:
        if not self.is_settled:
            for picture in self._pictures:
                picture.step(terms)
            self._to_renew -= 1

    def draw(self) -> None:
        for picture in self._pictures:
            picture.draw()
        self._to_renew = 0

    @property
    def is_exact(self) -> bool:
        return all(picture.is_exact for picture in self._pictures)

    @property
    def is_settled(self) -> bool:
        return self.is_exact and self._to_renew <= 0


def frozen_light(part: PartLight, material: Editable, power: Powers) -> Pixels:
    """(Q, 3, P) light of a material that is frozen, by monomial."""
    total = np.zeros((len(power.exponents), 3, len(part.pixel)), np.float32)
    if not part.edited:
        return total + pixels(part.terms[0], np.ones((1, 3)), power.weight, power.power, len(total))
    for term, light in zip(material.terms, part.terms, strict=True):
        found = pixels(light, bands_of(term.factors, light.counts, material), power.weight, power.power, len(total))
        scale = np.asarray(term.scale, np.float32)[:, None]
        if term.viewer:
            scale = scale * viewed(np.ones((3, 1), np.float32), part.theta_o, material.curves[term.viewer])
        total += found * scale
    return total
