"""A round cloth laid over a round pedestal: a developable-like surface in closed form, without a simulation.

On the pedestal the cloth is flat. Over the edge it bends down, tightly in the valleys of its folds, which touch the
pedestal, and widely on their crests, which flare outwards: a hanging cloth has a longer circumference than its support.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.core.geometry.directions import Floats
from lambent.scenes.geometry.grid import grid
from lambent.scenes.scene import Mesh

STEP = 1e-5  # of the finite differences that give the normals, in radians and shares of the radius


@dataclass(frozen=True)
class Drape:
    """The shape of a draped cloth; metres, its top at y = 0.

    Attributes
    ----------
    flat_radius : float
        Of its flat middle.
    bend, crest_bend : float
        Radius of the bend over the edge in a valley, and how much larger it is on a crest.
    flare_deg : float
        Angle between a crest and the vertical.
    folds : int
        Folds around the pedestal.
    """

    flat_radius: float
    bend: float
    crest_bend: float
    flare_deg: float
    folds: int

    def crest(self, phi: Floats) -> Floats:
        """Share of a crest, 0 to 1, at angles phi: folds have uneven widths and depths."""
        warp = 0.8 * np.sin(2 * phi + 1.0) + 0.6 * np.sin(3 * phi + 0.3) + 0.4 * np.sin(5 * phi + 2.0)
        depth = 0.72 + 0.18 * np.sin(3 * phi + 4.0) + 0.1 * np.sin(5 * phi + 1.0)
        wave = 0.5 + 0.5 * np.cos(self.folds * phi + warp)
        return np.asarray(depth * wave)

    def points(self, phi: Floats, s: Floats) -> Floats:
        """Positions (..., 3) at angles phi and lengths s along the cloth from its middle."""
        c = self.crest(phi)
        radius, steepest = self.bend + c * self.crest_bend, np.pi / 2 - np.radians(self.flare_deg) * c
        over = np.maximum(s - self.flat_radius, 0)
        angle = np.minimum(over / radius, steepest)
        hang = np.maximum(over - radius * steepest, 0)
        out = np.minimum(s, self.flat_radius) + radius * np.sin(angle) + hang * np.cos(steepest)
        down = radius * (1 - np.cos(angle)) + hang * np.sin(steepest)
        return np.stack([out * np.cos(phi), -down, -out * np.sin(phi)], axis=-1)

    def mesh(self, radius: float, around: int, rows: tuple[int, int, int]) -> Mesh:
        """The cloth of a radius; `rows` of quads on the flat, in the bend and below it. uv in metres, on the cloth."""
        flat, bent, hanging = rows
        knee = self.flat_radius + (self.bend + self.crest_bend) * np.pi / 2
        lines = [np.linspace(0, self.flat_radius, flat + 1), np.linspace(self.flat_radius, knee, bent + 1)[1:]]
        s = np.concatenate([*lines, np.linspace(knee, radius, hanging + 1)[1:]])[:, None]
        phi = np.linspace(0, 2 * np.pi, around + 1)[None, :]
        positions = self.points(phi, np.broadcast_to(s, (len(s), around + 1)))
        positions[:, -1] = positions[:, 0]
        outer = np.maximum(s, 1e-3 * radius)  # the normal at the centre is that of its neighbourhood
        h = STEP * radius
        along = self.points(phi, outer + h) - self.points(phi, outer - h)
        across = self.points(phi + STEP, outer + 0 * phi) - self.points(phi - STEP, outer + 0 * phi)
        normals = np.cross(along, across)
        normals[:, -1] = normals[:, 0]
        uv = np.stack([s * np.cos(phi), -s * np.sin(phi)], axis=-1)
        return grid(positions, normals, (1, 0, 0), uv)
