"""Angle bases of LBNL's matrices, with f constant over their patches.

A basis divides the hemisphere into rings of theta and each ring into n_phis equal patches; the first patch of a ring is
centred on phi = 0. The three of Klems (1994) are built in: full (145 patches), half (77) and quarter (41). A patch's
weight is its projected solid angle, the integral of cos(theta) over it: pi (cos^2 lower - cos^2 upper) / n_phis.

Matrices use headings: the direction light travels in, projected on the sheet. A patch of incident light at phi = 0
receives the light from phi = 180 degrees, so that transmitted and mirrored light leaves by the patch of the same
number.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.core.geometry.directions import HALF_TURN, direction
from lambent.materials.lobes import NUMPY
from lambent.materials.measured.tables.half_vector_grid import turns

OUTSIDE = -1
BEYOND = 4.0  # as sin^2(theta): above any direction's
WHOLE_DEG = 90 - 1e-3  # a basis up to here reaches the horizon
_TURNS_DEG = (15.0, 30.0, 45.0, 60.0, 90.0)
_EXACT = 1e-9
_THIRDS = 3  # divisions of a patch, in theta and in phi, each of which gives a tuple


@dataclass(frozen=True)
class AngleBasis:
    """Patches of the hemisphere, numbered ring by ring from the normal, with increasing phi within a ring.

    Attributes
    ----------
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

    @cached_property
    def rings(self) -> Indices:
        """(count,) ring of each patch."""
        return np.repeat(np.arange(len(self.n_phis)), self.n_phis)

    @cached_property
    def places(self) -> Indices:
        """(count,) number of each patch within its ring."""
        return np.arange(self.count) - self.starts[self.rings]

    @cached_property
    def _cos2(self) -> Floats:
        """(R + 1,) cos^2 of the rings' bounds."""
        return np.asarray(np.cos(np.radians(self.edges_deg)) ** 2)

    @cached_property
    def upper_sin2(self) -> Floats:
        """(R,) sin^2 of the rings' upper bounds, rounded to float32; BEYOND at the horizon.

        A direction belongs to the first ring whose bound exceeds x^2 + y^2. All look-ups, on tables and in sheets, use
        exactly these numbers, so that a direction on a border is in the same patch everywhere.
        """
        upper = np.array(self.edges_deg[1:])
        sin2 = np.where(upper < WHOLE_DEG, np.sin(np.radians(upper)) ** 2, BEYOND)
        return np.asarray(sin2.astype(np.float32).astype(float))

    def index(self, w: Floats) -> Indices:
        """(N,) patch of unit directions (N, 3) of the upper hemisphere; OUTSIDE beyond the last ring."""
        x, y = w[..., 0], w[..., 1]
        ring = np.searchsorted(self.upper_sin2, x * x + y * y, side="right")
        inside = ring < len(self.n_phis)
        ring = np.where(inside, ring, 0)
        n = np.array(self.n_phis)[ring]
        place = np.floor(turns(y, x, NUMPY) * n + 0.5).astype(np.int64) % n
        return np.where(inside, self.starts[ring] + place, OUTSIDE)

    @cached_property
    def projected_sr(self) -> Floats:
        """(count,) integral of cos(theta) over each patch, in sr; pi over a whole hemisphere."""
        n = np.array(self.n_phis)
        return np.asarray(np.repeat(-np.pi * np.diff(self._cos2) / n, n))

    @cached_property
    def centres(self) -> Floats:
        """(count, 3) unit directions at the patches' centres; the normal for a patch around it."""
        edges, n = np.radians(self.edges_deg), np.array(self.n_phis)
        middle = np.where((n == 1) & (edges[:-1] == 0), 0.0, (edges[:-1] + edges[1:]) / 2)
        return direction(middle[self.rings], 2 * np.pi * self.places / n[self.rings])

    @cached_property
    def opposite(self) -> Indices:
        """(count,) the patch at phi + 180 degrees; the nearest one in rings with an odd number of patches."""
        return self.index(self.centres * HALF_TURN)

    def points(self, patch: Indices, u: Floats) -> Floats:
        """(N, 3) directions in patches (N,) for u (N, 2) in [0, 1)^2, uniform in projected solid angle."""
        ring = self.rings[patch]
        cos2 = self._cos2[ring] + u[:, 0] * (self._cos2[ring + 1] - self._cos2[ring])
        phi = 2 * np.pi * (self.places[patch] + u[:, 1] - 0.5) / np.array(self.n_phis)[ring]
        r, z = np.sqrt(np.maximum(1 - cos2, 0)), np.sqrt(np.maximum(cos2, 0))
        return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)

    def direct_share(self, f: Floats) -> float:
        """Share of uniform incident light that leaves by the patch it entered by; f (count, count), 0 if f is black.

        This is the patch of the mirrored or the undeviated direction.
        """
        projected = self.projected_sr
        power = projected @ f @ projected
        return float((projected**2) @ np.diagonal(f) / power) if power > 0 else 0.0


KLEMS_FULL = AngleBasis("LBNL/Klems Full", (0, 5, 15, 25, 35, 45, 55, 65, 75, 90), (1, 8, 16, 20, 24, 24, 24, 16, 12))
KLEMS_HALF = AngleBasis("LBNL/Klems Half", (0, 6.5, 19.5, 32.5, 45.5, 58.5, 71.5, 90), (1, 8, 12, 16, 20, 12, 8))
KLEMS_QUARTER = AngleBasis("LBNL/Klems Quarter", (0, 9, 27, 45, 63, 90), (1, 8, 12, 12, 8))
BUILT_IN = (KLEMS_FULL, KLEMS_HALF, KLEMS_QUARTER)


@dataclass(frozen=True)
class PatchMatrix:
    """f of reflection or transmission on one side, constant over pairs of patches.

    Attributes
    ----------
    values : (outgoing.count, incident.count, C)
        1/sr, finite; negative values count as 0 everywhere but in `tuples`.
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
        """Number of pairs of patches with a channel below zero."""
        return int((self.values < 0).any(axis=-1).sum())

    @cached_property
    def f(self) -> Floats:
        """`values`, negative ones as 0."""
        return np.maximum(self.values, 0) if self.negative else self.values

    def at(self, entering: Floats, leaving: Floats) -> Floats:
        """f (N, C) for headings (N, 3) with z >= 0; 0 beyond the bases."""
        i, o = self.incident.index(entering), self.outgoing.index(leaving)
        inside = (i != OUTSIDE) & (o != OUTSIDE)
        return np.asarray(np.where(inside[:, None], self.f[o, i], 0.0))

    def hemispherical(self, entering: Floats) -> Floats:
        """Share (N, C) of light with this heading that is scattered: the exact sum over the outgoing patches."""
        return self._looked_up(np.tensordot(self.outgoing.projected_sr, self.f, 1), self.incident, entering)

    def hemispherical_reversed(self, leaving: Floats) -> Floats:
        """Likewise for reversed light, which enters at a heading by which light of this part leaves."""
        return self._looked_up(np.tensordot(self.f, self.incident.projected_sr, ((1,), (0,))), self.outgoing, leaving)

    @staticmethod
    def _looked_up(totals: Floats, basis: AngleBasis, w: Floats) -> Floats:
        index = basis.index(w)
        return np.asarray(np.where((index != OUTSIDE)[:, None], totals[index], 0.0))

    def tuples(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Headings (M, 3) of light that enters and leaves, f (M, C), and a weight (M,) in sr, of every pair of patches.

        Light enters at the centre of its patch and leaves at nine places of its own; with the centre alone, a lobe far
        narrower than the patch would fit with any energy. The weights times the cosines of the leaving headings sum to
        the patch's projected solid angle, so that sums over tuples are sums over patches.
        """
        o, i = np.indices(self.values.shape[:2]).reshape(2, -1)
        return self._tuples(self.incident.centres[i], self.outgoing, o)

    def tuples_reversed(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Likewise for reversed light; `entering` and `leaving` are its own headings."""
        o, i = np.indices(self.values.shape[:2]).reshape(2, -1)
        entering, leaving, f, weight = self._tuples(self.outgoing.centres[o], self.incident, i)
        return entering * HALF_TURN, leaving * HALF_TURN, f, weight

    def _tuples(self, entering: Floats, basis: AngleBasis, patch: Indices) -> tuple[Floats, Floats, Floats, Floats]:
        """Tuples of light that enters with these headings and leaves by these patches."""
        places, share = _spread(basis)
        entering, f = (np.repeat(a, _THIRDS**2, axis=0) for a in (entering, self.values.reshape(-1, self.channels)))
        return entering, places[patch].reshape(-1, 3), f, share[patch].ravel()

    @cached_property
    def anisotropy(self) -> float:
        """Change of f when the sheet is turned, over the mean of f.

        Uses turns by 15 to 90 degrees that map the patches of both rings onto themselves; infinite if there are none.
        """
        difference, size = 0.0, 0.0
        for a, n_i in enumerate(self.incident.n_phis):
            for b, n_o in enumerate(self.outgoing.n_phis):
                i, o = self.incident.starts[a], self.outgoing.starts[b]
                block = self.f[o : o + n_o, i : i + n_i]
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

    @property
    def direct_share(self) -> float:
        """`AngleBasis.direct_share`; 0 if the two bases differ."""
        return self.incident.direct_share(self.f.sum(axis=-1)) if self.incident == self.outgoing else 0.0


def _spread(basis: AngleBasis) -> tuple[Floats, Floats]:
    """Nine directions (count, 9, 3) in every patch, its centre among them, and weights (count, 9) in sr.

    Theta and phi are divided in three. A weight times the cosine is the projected solid angle of its piece.
    """
    n, ring = np.array(basis.n_phis), basis.rings
    lower, upper = np.radians(basis.edges_deg[:-1]), np.radians(basis.edges_deg[1:])
    cuts = lower[:, None] + (upper - lower)[:, None] * np.arange(_THIRDS + 1) / _THIRDS  # (R, 4)
    size = (-np.pi * np.diff(np.cos(cuts) ** 2) / (n * _THIRDS)[:, None])[ring]
    theta = ((cuts[:, 1:] + cuts[:, :-1]) / 2)[ring]
    phi = 2 * np.pi * (basis.places[:, None] + (np.arange(_THIRDS) - 1) / _THIRDS) / n[ring, None]
    places = direction(theta[:, :, None], phi[:, None, :])
    weight = np.broadcast_to((size / np.cos(theta))[:, :, None], places.shape[:-1])
    return places.reshape(basis.count, -1, 3), weight.reshape(basis.count, -1)
