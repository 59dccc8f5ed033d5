"""Gonio-photometer tables: a grid of incident directions, and for each a sheet of outgoing ones on either side.

Look-ups between the incident directions (thesis M, 3.2) blend p = f |cos theta_o|. `half_vector` aligns the lobes first
(Rusinkiewicz 1998): each neighbouring incident direction w_k is asked at w_k mirrored about h(wi, wo). `quadrilinear`
blends what stands at wo itself, and is the right one of retro-reflectors. The far side is the near side of the pair
mirrored at the surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from lambent.core.directions import Floats, angles, direction, normalize, reflect
from lambent.materials.measured.protocol import Flags, MeasuredSamples, TableInfo, collect
from lambent.materials.measured.sheets import Indices, ScatteredSheet, Sheet, bracket
from lambent.materials.measured.table import IntegratedTable, require_values

AnySheet = Sheet | ScatteredSheet
Sheets = tuple[tuple[AnySheet, ...], ...]

FORMAT = "gonio text"
Symmetry = Literal["isotropic", "quadrant", "half", "none"]
PHI_I_RANGE_DEG: dict[Symmetry, float] = {"isotropic": 0.0, "quadrant": 90.0, "half": 180.0, "none": 360.0}
Reconstruction = Literal["half_vector", "quadrilinear"]
_COS_MIN = 1e-4
_STEEPEST = 4.0  # times f of a neighbour: where the asked direction is well above the horizon that wo is at


@dataclass(frozen=True)
class GonioTable(IntegratedTable):
    """A gonio-photometer's table.

    Attributes
    ----------
    name : str
        Of the specimen.
    theta_i_deg : (I,) increasing in [0, 90)
    phi_i_deg : (J,) increasing in [0, 360); (0,) of an isotropic table
    reflected : I x J sheets, or none
    transmitted : I x J sheets, or none
    symmetry : str
        isotropic; quadrant: mirrored at x = 0 and y = 0, phi_i from 0 to 90; half: f(-x, -y) = f(x, y), phi_i from 0
        to 180; none.
    stored : str
        The quantity of the file it was read from.
    reconstruction : str
        How `eval` looks up between incident directions.
    file : str, optional
        Name of the file it was read from.
    notes : tuple of str
        What the reader repaired or assumed.
    format : str
        Name of the reader that took it.
    """

    name: str
    theta_i_deg: Floats
    phi_i_deg: Floats
    reflected: Sheets
    transmitted: Sheets = ()
    symmetry: Symmetry = "isotropic"
    stored: Literal["f", "f_cos", "p"] = "f"
    reconstruction: Reconstruction = "half_vector"
    file: str | None = None
    notes: tuple[str, ...] = ()
    format: str = FORMAT

    def __post_init__(self) -> None:
        values = np.concatenate([sheet.values.ravel() for sheets in self._sides for row in sheets for sheet in row])
        with np.errstate(invalid="ignore"):
            require_values(values, np.isfinite(values) & (values >= 0), self.file or self.name)

    @property
    def _sides(self) -> list[Sheets]:
        return [sheets for sheets in (self.reflected, self.transmitted) if sheets]

    @cached_property
    def info(self) -> TableInfo:  # type: ignore[override]
        first = self._sides[0][0][0]
        sizes = {"theta_i": len(self.theta_i_deg), "phi_i": len(self.phi_i_deg)}
        if isinstance(first, Sheet):
            about = "o" if first.frame is None else "specular"
            sizes |= {f"theta_{about}": len(first.theta_deg), f"phi_{about}": len(first.phi_deg)}
        else:
            sizes["outgoing"] = len(first.directions)
        return TableInfo(
            file=self.file or self.name,
            format=self.format,
            isotropic=self.symmetry == "isotropic",
            transmits=bool(self.transmitted),
            channels=first.values.shape[-1],
            stored=self.stored,
            sizes=sizes,
            notes=self.notes,
        )

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., C) in 1/sr; a pair seen from below is the same pair seen from above (a two-sided sheet)."""
        wi, wo = np.broadcast_arrays(np.asarray(wi, float), np.asarray(wo, float))
        flat_i, flat_o = wi.reshape(-1, 3), wo.reshape(-1, 3)
        f = np.zeros((len(flat_i), self.info.channels))
        product = flat_i[:, 2] * flat_o[:, 2]
        for sheets, side in ((self.reflected, product > 0), (self.transmitted, product < 0)):
            if sheets and side.any():
                up = np.array([1.0, 1.0, 0.0])
                pair = (w[side] * up + np.abs(w[side]) * (1 - up) for w in (flat_i, flat_o))
                f[side] = self._eval_side(sheets, *self._reduced(*pair))
        return f.reshape(*wi.shape[:-1], -1)

    def _reduced(self, wi: Floats, wo: Floats) -> tuple[Floats, Floats]:
        """The pair moved to where the table has incident directions."""
        if self.symmetry == "isotropic":
            sin_theta = np.hypot(wi[:, 0], wi[:, 1])
            c, s = (np.divide(wi[:, a], sin_theta, out=np.full(len(wi), 1.0 - a), where=sin_theta > 0) for a in (0, 1))
            turned = np.stack([c * wo[:, 0] + s * wo[:, 1], c * wo[:, 1] - s * wo[:, 0], wo[:, 2]], axis=-1)
            return np.stack([sin_theta, np.zeros_like(sin_theta), wi[:, 2]], axis=-1), turned
        if self.symmetry == "none":
            return wi, wo
        flip_y = np.where(wi[:, 1] < 0, -1.0, 1.0)
        flip_x = np.where(wi[:, 0] < 0, -1.0, 1.0) if self.symmetry == "quadrant" else flip_y
        flip = np.stack([flip_x, flip_y, np.ones_like(flip_y)], axis=-1)
        return wi * flip, wo * flip

    def _eval_side(self, sheets: Sequence[Sequence[AnySheet]], wi: Floats, wo: Floats) -> Floats:
        theta, phi = angles(wi)
        i, u = bracket(self.theta_i_deg, np.degrees(theta))
        i1 = np.minimum(i + 1, len(self.theta_i_deg) - 1)
        j, j1, v = self._phi_bracket(np.degrees(phi))
        h = normalize(wi + wo)
        f = np.zeros((len(wi), self.info.channels))
        for a, b, weight in ((i, j, (1 - u) * (1 - v)), (i, j1, (1 - u) * v), (i1, j, u * (1 - v)), (i1, j1, u * v)):
            neighbour = direction(np.radians(self.theta_i_deg[a]), np.radians(self.phi_i_deg[b]))
            asked = reflect(neighbour, h) if self.reconstruction == "half_vector" else wo
            # p is interpolated, not f: f of a lobe bends steeply over theta_i, and p falls to 0 at the horizon.
            # At the horizon itself f = p / cos would run away, and with it a picture's brightest pixels.
            weight = weight * np.minimum(np.maximum(asked[:, 2], 0) / np.maximum(wo[:, 2], _COS_MIN), _STEEPEST)
            for k, rows in _groups(a * len(self.phi_i_deg) + b, weight > 0):
                sheet = sheets[k // len(self.phi_i_deg)][k % len(self.phi_i_deg)]
                f[rows] += sheet.at(asked[rows]) * weight[rows, None]
        return f

    def _phi_bracket(self, phi_deg: Floats) -> tuple[Indices, Indices, Floats]:
        """Indices of the phi_i on either side and the share of the second; a table of a whole or half turn wraps."""
        nodes = self.phi_i_deg
        period = {"half": 180.0, "none": 360.0}.get(self.symmetry)
        if period is None or len(nodes) == 1:
            j, v = bracket(nodes, phi_deg)
            return j, np.minimum(j + 1, len(nodes) - 1), v
        closed = nodes if nodes[-1] - nodes[0] >= period - 1e-6 else np.append(nodes, nodes[0] + period)
        j, v = bracket(closed, (phi_deg - nodes[0]) % period + nodes[0])
        return j, (j + 1) % len(nodes), v

    def samples(self, max_count: int | None = None) -> MeasuredSamples:
        """The table's tuples; the weight is the solid angle of the outgoing cell, in sr."""
        columns: list[tuple[Floats, ...]] = []
        for sheets, side in ((self.reflected, 1.0), (self.transmitted, -1.0)):
            for theta_i, row in zip(self.theta_i_deg, sheets, strict=False):
                seen: set[int] = set()
                for phi_i, sheet in zip(self.phi_i_deg, row, strict=True):
                    if id(sheet) not in seen:  # at theta_i = 0 one sheet may stand for every phi_i
                        columns.append(_tuples(sheet, direction(np.radians(theta_i), np.radians(phi_i)), side))
                    seen.add(id(sheet))
        wi, wo, f, weight = (np.concatenate(column) for column in zip(*columns, strict=True))
        return collect(wi, wo, f, weight, self.info, np.isnan(f).any(axis=1), max_count)


def _tuples(sheet: AnySheet, wi: Floats, side: float) -> tuple[Floats, Floats, Floats, Floats]:
    """wi, wo, f and weight of what was measured."""
    measured = sheet.measured
    wo = sheet.directions[measured]
    return np.broadcast_to(wi, wo.shape), wo * (1, 1, side), sheet.values[measured], sheet.weights()[measured]


def _groups(key: Indices, chosen: Flags) -> list[tuple[int, Indices]]:
    """(key, rows) of every key that occurs among the chosen rows."""
    rows = np.flatnonzero(chosen)
    if len(rows) == 0:
        return []
    rows = rows[np.argsort(key[rows], kind="stable")]
    found, starts = np.unique(key[rows], return_index=True)
    return list(zip(found.tolist(), np.split(rows, starts[1:]), strict=True))
