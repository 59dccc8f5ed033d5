"""Angle bases of LBNL's matrices, and f that is constant over their patches.

A basis cuts the hemisphere into rings of theta and each ring into n_phis equal patches; the first patch of a ring is
centred on phi = 0. The three of Klems (1994) are built in: full (145 patches), half (77) and quarter (41). What a patch
counts for is its projected solid angle, the integral of cos(theta) over it: pi (cos^2 lower - cos^2 upper) / n_phis.

Directions of a matrix are headings: the way light travels, projected on the sheet. A patch of incident light at phi = 0
holds the light that comes from phi = 180 degrees, so that light that goes straight on leaves through the patch of the
same number, and mirrored light as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lambent.core.directions import Floats, angles, direction

Indices = NDArray[np.int64]

OUTSIDE = -1
_TURNS_DEG = (15.0, 30.0, 45.0, 60.0, 90.0)
_EXACT = 1e-9
_THIRDS = 3  # pieces of a patch, in theta and in phi, that give a tuple each


@dataclass(frozen=True)
class AngleBasis:
    """Patches of the hemisphere, ring by ring from the normal, phi rising within a ring.

    Attributes
    ----------
    name : str
    edges_deg : tuple of R + 1 float
        Bounds of theta, from 0, increasing, at most 90.
    n_phis : tuple of R int
        Patches of each ring.
    """

    name: str
    edges_deg: tuple[float, ...]
    n_phis: tuple[int, ...]

    @property
    def count(self) -> int:
        return sum(self.n_phis)

    @cached_property
    def starts(self) -> Indices:
        """(R,) number of the first patch of each ring."""
        return np.concatenate([[0], np.cumsum(self.n_phis)[:-1]]).astype(np.int64)

    def index(self, w: Floats) -> Indices:
        """(N,) patch of unit directions (N, 3) of the upper hemisphere; OUTSIDE beyond the last ring."""
        theta, phi = angles(w)
        ring = np.searchsorted(np.array(self.edges_deg), np.degrees(theta), side="right") - 1
        inside = ring < len(self.n_phis)
        ring = np.where(inside, ring, 0)
        n = np.array(self.n_phis)[ring]
        place = np.floor(phi / (2 * np.pi) * n + 0.5).astype(np.int64) % n
        return np.where(inside, self.starts[ring] + place, OUTSIDE)

    @cached_property
    def projected_sr(self) -> Floats:
        """(count,) integral of cos(theta) over each patch, in sr; pi over a whole hemisphere."""
        squares = np.cos(np.radians(self.edges_deg)) ** 2
        n = np.array(self.n_phis)
        return np.asarray(np.repeat(-np.pi * np.diff(squares) / n, n))

    @cached_property
    def centres(self) -> Floats:
        """(count, 3) unit directions in the middle of the patches; the normal for a patch around it."""
        edges, n = np.radians(self.edges_deg), np.array(self.n_phis)
        middle = np.where((n == 1) & (edges[:-1] == 0), 0.0, (edges[:-1] + edges[1:]) / 2)
        place = np.arange(self.count) - np.repeat(self.starts, n)
        return direction(np.repeat(middle, n), 2 * np.pi * place / np.repeat(n, n))

    @cached_property
    def opposite(self) -> Indices:
        """(count,) the patch at phi + 180 degrees; rings of an odd number of patches have the nearest one."""
        return self.index(self.centres * (-1, -1, 1))

    def points(self, patch: Indices, u: Floats) -> Floats:
        """(N, 3) directions in patches (N,) for u (N, 2) in [0, 1)^2, even in projected solid angle."""
        n = np.array(self.n_phis)
        ring = np.repeat(np.arange(len(n)), n)[patch]
        squares = np.cos(np.radians(self.edges_deg)) ** 2
        cos_squared = squares[ring] + u[:, 0] * (squares[ring + 1] - squares[ring])
        phi = 2 * np.pi * (patch - self.starts[ring] + u[:, 1] - 0.5) / n[ring]
        r, z = np.sqrt(np.maximum(1 - cos_squared, 0)), np.sqrt(np.maximum(cos_squared, 0))
        return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)


KLEMS_FULL = AngleBasis("LBNL/Klems Full", (0, 5, 15, 25, 35, 45, 55, 65, 75, 90), (1, 8, 16, 20, 24, 24, 24, 16, 12))
KLEMS_HALF = AngleBasis("LBNL/Klems Half", (0, 6.5, 19.5, 32.5, 45.5, 58.5, 71.5, 90), (1, 8, 12, 16, 20, 12, 8))
KLEMS_QUARTER = AngleBasis("LBNL/Klems Quarter", (0, 9, 27, 45, 63, 90), (1, 8, 12, 12, 8))
BUILT_IN = (KLEMS_FULL, KLEMS_HALF, KLEMS_QUARTER)


@dataclass(frozen=True)
class PatchMatrix:
    """f of one side and one way (reflection or transmission), constant over pairs of patches.

    Attributes
    ----------
    incident, outgoing : AngleBasis
    values : (outgoing.count, incident.count, C)
        1/sr, finite; what is negative counts as 0 in all but `tuples`.
    """

    incident: AngleBasis
    outgoing: AngleBasis
    values: Floats

    @property
    def channels(self) -> int:
        return int(self.values.shape[-1])

    @property
    def sizes(self) -> dict[str, int]:
        return {"incident patches": self.incident.count, "outgoing patches": self.outgoing.count}

    @property
    def dark(self) -> bool:
        """Whether f is zero throughout."""
        return not bool((self.values > 0).any())

    @property
    def negative(self) -> int:
        """How many pairs of patches are below zero in any channel."""
        return int((self.values < 0).any(axis=-1).sum())

    @cached_property
    def f(self) -> Floats:
        """`values` without what is negative."""
        return np.maximum(self.values, 0) if self.negative else self.values

    def at(self, entering: Floats, leaving: Floats) -> Floats:
        """f (N, C) for headings (N, 3) with z >= 0; 0 beyond the bases."""
        i, o = self.incident.index(entering), self.outgoing.index(leaving)
        inside = (i != OUTSIDE) & (o != OUTSIDE)
        return np.asarray(np.where(inside[:, None], self.f[o, i], 0.0))

    def hemispherical(self, entering: Floats) -> Floats:
        """Share (N, C) of light with this heading that leaves: the exact sum over the outgoing patches."""
        return self._looked_up(np.tensordot(self.outgoing.projected_sr, self.f, 1), self.incident, entering)

    def hemispherical_reversed(self, leaving: Floats) -> Floats:
        """The same for light that takes the ways of this part backwards, in at the heading by which it leaves here."""
        return self._looked_up(np.tensordot(self.f, self.incident.projected_sr, ((1,), (0,))), self.outgoing, leaving)

    @staticmethod
    def _looked_up(totals: Floats, basis: AngleBasis, w: Floats) -> Floats:
        index = basis.index(w)
        return np.asarray(np.where((index != OUTSIDE)[:, None], totals[index], 0.0))

    def tuples(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Headings (M, 3) of light that enters and leaves, f (M, C), and a weight (M,) in sr, of every pair of patches.

        Light enters in the middle of its patch and leaves at nine places of its own: at the middle alone a lobe far
        narrower than the patch would fit, with any energy. The weights times the cosines of the leaving headings sum to
        the patch's projected solid angle, so that sums over tuples are sums over patches.
        """
        o, i = np.indices(self.values.shape[:2]).reshape(2, -1)
        places, share = _spread(self.outgoing)
        leaving, weight = places[o].reshape(-1, 3), share[o].ravel()
        return self._nine(self.incident.centres[i]), leaving, self._nine(self.values.reshape(-1, self.channels)), weight

    def tuples_reversed(self) -> tuple[Floats, Floats, Floats, Floats]:
        """The same of light that takes the ways backwards; entering and leaving are those of the light that does."""
        o, i = np.indices(self.values.shape[:2]).reshape(2, -1)
        places, share = _spread(self.incident)
        back = np.array((-1, -1, 1))
        entering, leaving = self.outgoing.centres[o] * back, places[i].reshape(-1, 3) * back
        return self._nine(entering), leaving, self._nine(self.values.reshape(-1, self.channels)), share[i].ravel()

    @staticmethod
    def _nine(rows: Floats) -> Floats:
        return np.repeat(rows, _THIRDS**2, axis=0)

    @cached_property
    def anisotropy(self) -> float:
        """How much f changes when the sheet is turned, over the mean of f, where turns carry patches to patches.

        Compared are turns by 15 to 90 degrees that map the patches of both rings onto themselves; infinite where there
        are none.
        """
        difference, size = 0.0, 0.0
        for a, n_i in enumerate(self.incident.n_phis):
            for b, n_o in enumerate(self.outgoing.n_phis):
                block = self._block(a, b)
                for turn in _TURNS_DEG:
                    steps = np.array([n_o, n_i]) * turn / 360
                    whole = steps.round().astype(int)
                    if np.abs(steps - whole).max() < _EXACT:
                        turned = np.roll(block, tuple(whole), axis=(0, 1))
                        difference += float(np.abs(turned - block).mean())
                        size += float(block.mean())
        if size > 0:
            return difference / size
        return np.inf if not self.dark else 0.0

    def _block(self, ring_i: int, ring_o: int) -> Floats:
        i, o = self.incident.starts[ring_i], self.outgoing.starts[ring_o]
        return self.f[o : o + self.outgoing.n_phis[ring_o], i : i + self.incident.n_phis[ring_i]]

    @property
    def direct_share(self) -> float:
        """Share of the light, coming evenly from everywhere, that leaves by the patch it came in by; 0 of two bases.

        That is the patch of the mirrored or the straight direction.
        """
        if self.incident != self.outgoing or self.dark:
            return 0.0
        projected, f = self.incident.projected_sr, self.f.sum(axis=-1)
        return float((projected**2) @ np.diagonal(f) / (projected @ f @ projected))


def _spread(basis: AngleBasis) -> tuple[Floats, Floats]:
    """Nine directions (count, 9, 3) in every patch, its middle among them, and weights (count, 9) in sr.

    Theta and phi are cut in three each. A weight times the cosine is the projected solid angle of its piece.
    """
    n = np.array(basis.n_phis)
    lower, upper = np.radians(basis.edges_deg[:-1]), np.radians(basis.edges_deg[1:])
    cuts = lower[:, None] + (upper - lower)[:, None] * np.arange(_THIRDS + 1) / _THIRDS  # (R, 4)
    sizes = -np.pi * np.diff(np.cos(cuts) ** 2) / (n * _THIRDS)[:, None]
    theta, size = np.repeat((cuts[:, 1:] + cuts[:, :-1]) / 2, n, axis=0), np.repeat(sizes, n, axis=0)
    place = (np.arange(basis.count) - np.repeat(basis.starts, n))[:, None] + (np.arange(_THIRDS) - 1) / _THIRDS
    phi = 2 * np.pi * place / np.repeat(n, n)[:, None]
    places = direction(theta[:, :, None], phi[:, None, :])
    weight = np.broadcast_to((size / np.cos(theta))[:, :, None], places.shape[:-1])
    return places.reshape(basis.count, -1, 3), weight.reshape(basis.count, -1)
