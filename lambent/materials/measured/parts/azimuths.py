"""Incident azimuths of a table that covers the whole circle, a half or a quarter; the rest follows by symmetry.

A half-circle table is unchanged when both directions turn by 180 degrees, a quarter-circle table when both are mirrored
in x or in y. If the nodes end before their part of the circle does, because the closing node is left out, f is
interpolated between the last node and the image of the next.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Floats

CLOSED_RAD = 1e-3  # distance of the last node from the end at which a part counts as closed
SAME = 1e-6  # relative to a part: the closing node belongs to it


@dataclass(frozen=True)
class Azimuths:
    """Increasing nodes (N,) in radians, N > 1, of one of `parts` equal parts of the circle: 1, 2 or 4."""

    nodes: Floats
    parts: int

    @classmethod
    def of(cls, nodes: Floats) -> Azimuths:
        """Detect the part of the circle that nodes cover, with or without a closing node."""
        span, step = float(nodes[-1] - nodes[0]), float(np.median(np.diff(nodes)))
        whole = [parts for parts in (1, 2, 4) if abs(span - 2 * np.pi / parts) < CLOSED_RAD]
        wide = [parts for parts in (1, 2, 4) if span <= 2 * np.pi / parts + CLOSED_RAD]
        nearest = min(wide, key=lambda parts: abs(np.log((span + step) * parts / (2 * np.pi))))
        return cls(nodes, whole[0] if whole else nearest)

    def folded(self, wi: Floats, wo: Floats) -> tuple[Floats, Floats, Floats]:
        """Pairs (N, 3) folded into the nodes' part of the circle, and the azimuths (N,) of wi there."""
        phi, period = np.arctan2(wi[:, 1], wi[:, 0]), 2 * np.pi / self.parts
        if self.parts < 4:
            parts = (phi - self.nodes[0]) / period
            count = np.where(parts > 0, np.maximum(np.ceil(parts - SAME) - 1, 0), np.floor(parts))
            flip = np.where((count % 2 == self.parts - 1)[:, None], [-1.0, -1.0, 1.0], 1.0) if self.parts > 1 else 1.0
            return wi * flip, wo * flip, phi - count * period
        middle = self._bounds.mean()
        signs = np.array([np.cos(middle), np.sin(middle), 0.0])
        flip = np.where(wi * signs < 0, -1.0, 1.0)
        wi, wo = wi * flip, wo * flip
        off = np.arctan2(wi[:, 1], wi[:, 0]) - middle
        return wi, wo, middle + off - 2 * np.pi * np.round(off / (2 * np.pi))

    def beyond(self, phi: Floats) -> tuple[Floats, Floats, Floats]:
        """For `folded` azimuths (N,): flip (N, 3), azimuth (N,) and weight (N,) of the other image to blend with."""
        first, last = self.nodes[0], self.nodes[-1]
        over, under = np.maximum(phi - last, 0), np.maximum(first - phi, 0)
        if self.parts < 4:
            period = 2 * np.pi / self.parts
            flip = np.broadcast_to([-1.0, -1.0, 1.0] if self.parts == 2 else 1.0, (len(phi), 3))
            return flip, phi - period, np.minimum(over / max(first + period - last, SAME), 1)
        low, high = self._bounds
        across = np.where(over > 0, high, low)
        along_x = np.abs(np.sin(across)) < 0.5  # the mirror there is in y, elsewhere in x
        flip = np.stack([np.where(along_x, 1.0, -1.0), np.where(along_x, -1.0, 1.0), np.ones(len(phi))], axis=-1)
        share = over / max(2 * (high - last), SAME) + under / max(2 * (first - low), SAME)
        return flip, 2 * across - phi, np.minimum(share, 1)  # a quarter's nodes may lie across its ends

    @property
    def _bounds(self) -> Floats:
        """Ends (2,) of the quarter."""
        low = np.floor((self.nodes[0] + self.nodes[-1]) / np.pi) * np.pi / 2
        return np.array([low, low + np.pi / 2])
