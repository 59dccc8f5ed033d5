"""Gonio-photometer tables: a grid of incident directions, and for each a sheet of outgoing ones on either side.

Look-ups between the incident directions (thesis M, 3.2) blend p = f |cos theta_o|, looked up in the sheet of each
neighbouring incident direction w_k at the direction that a method gives:

- `half_vector`: w_k mirrored about h(wi, wo). Peaks follow the mirror direction (Rusinkiewicz 1998).
- `back_vector`: the same, but if wo is nearer to the light than to its mirror direction, wo turned as wi is turned to
  w_k. Peaks about the light, those of retro-reflectors, follow it: they have the same back vector, the half vector of
  the viewer and the light's mirror image about n (Belcour et al. 2014), for every direction of the light. At normal
  incidence the peaks coincide and count as the light's, which is far stronger in tables that use this method.
- `quadrilinear`: wo itself. Peaks stay where they were measured.

The choice is made by leaving one out: inner theta_i are predicted from their neighbours. The error is E under the
cube-root metric, which weighs faint peaks and dark parts alike, relative to E against black. Transmission is looked up
as the reflection of the pair mirrored at the surface.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry.directions import FLIP_Z, angles, direction, half_vector, raised, reflect
from lambent.materials.bsdf import components
from lambent.materials.document import Material
from lambent.materials.lobes import NUMPY, ArrayOps, Vector
from lambent.materials.measured.inspecting.metrics import CUBEROOT
from lambent.materials.measured.protocol import (
    RETRO_PROPOSAL,
    MeasuredSamples,
    MeasuredTable,
    Quantity,
    TableInfo,
    collect,
)
from lambent.materials.measured.tables.sheets import ScatteredSheet, Sheet
from lambent.materials.measured.tables.table import (
    bracket,
    mirrored_to_range,
    on_flat_pairs,
    require_values,
    usable_values,
)

Reconstruction = Literal["half_vector", "back_vector", "quadrilinear"]
RECONSTRUCTIONS: tuple[Reconstruction, ...] = get_args(Reconstruction)
AUTO: Literal["auto"] = "auto"
CLEARLY = 0.9  # share of the error of `half_vector` that another method must not exceed
_TUPLES = 3000  # per incident direction that is left out


@dataclass(frozen=True)
class Choice:
    """The method in use; `errors` has E of each method relative to E against black, and is empty if unknown."""

    way: Reconstruction
    errors: dict[Reconstruction, float] = field(default_factory=dict)


Fold = tuple[MeasuredSamples, Callable[[Reconstruction, MeasuredSamples], Floats]]
"""Tuples of an incident direction, and f (N, C) at them as predicted by the table without it."""


def choice_of(folds: Iterable[Fold]) -> Choice:
    """The method with the best predictions; `half_vector` unless another one is clearly better."""
    off, whole = dict.fromkeys(RECONSTRUCTIONS, 0.0), 0.0
    for samples, predicted in folds:
        some = _thinned(samples)
        whole += CUBEROOT.error(some, np.zeros_like(some.f)) ** 2
        for way in off:
            off[way] += CUBEROOT.error(some, predicted(way, some)) ** 2
    if whole <= 0:
        return Choice("half_vector")
    errors = {way: float(np.sqrt(error / whole)) for way, error in off.items()}
    best = min(errors, key=lambda way: errors[way])
    return Choice(best if errors[best] < CLEARLY * errors["half_vector"] else "half_vector", errors)


def _thinned(samples: MeasuredSamples) -> MeasuredSamples:
    """Up to _TUPLES tuples, half of them by solid angle and half by light; weights compensate for the choice."""
    if len(samples) <= _TUPLES:
        return samples
    light = samples.weight * np.abs(samples.wo[:, 2])
    of_peaks = light * samples.f.mean(axis=1)
    density = light / max(float(light.sum()), 1e-300) + of_peaks / max(float(of_peaks.sum()), 1e-300) + 1e-12
    summed = np.cumsum(density)
    drawn = np.searchsorted(summed, (np.arange(_TUPLES) + 0.5) / _TUPLES * summed[-1]).clip(max=len(samples) - 1)
    some = samples.take(drawn)
    return replace(some, weight=some.weight / density[drawn])


def looked_up(way: Reconstruction, wi: Floats, wo: Floats) -> Callable[[Floats], list[tuple[Floats, Any, bool]]]:
    """Where to look up the sheets of neighbouring incident directions (N, 3) for the pairs wi, wo (N, 3).

    The returned function gives directions (N, 3), their weights (N), and whether they belong to a peak about the light.
    """
    if way == "quadrilinear":
        return lambda neighbour: [(wo, 1.0, False)]
    h = half_vector(wi, wo)
    if way == "half_vector":
        return lambda neighbour: [(reflect(neighbour, h), 1.0, False)]
    share, behind = back_share(components(wi), components(wo)), reflect(wo, wi)

    def both(neighbour: Floats) -> list[tuple[Floats, Any, bool]]:
        mirrored = reflect(neighbour, h)
        # two half turns, about wi and about the midpoint: the shortest rotation from wi to the neighbour
        turned = reflect(behind, half_vector(wi, neighbour))
        # if h is the neighbour itself, its peak about the light would appear elsewhere
        of_light = np.maximum(share, back_share(components(neighbour), components(mirrored)))
        return [(mirrored, 1 - of_light, False), (turned, of_light, True)]

    return both


_COS_NORMAL = 1 - 1e-6  # .08 degrees
_STEEPNESS = 2.0  # from 0 to 1 over half the range of the measure below


def back_share(wi: Vector, wo: Vector, ops: ArrayOps = NUMPY) -> Any:
    """1 if wo is nearer to wi than to its mirror image, 0 if farther; continuous in between.

    Based on (|h_b| - |h|)/(|h_b| + |h|) of the squared tangential components of wi + wo and wi' + wo; symmetric in wi
    and wo. 1 for wi or wo along the normal.
    """
    across = wi[0] * wo[0] + wi[1] * wo[1]
    size = wi[0] * wi[0] + wi[1] * wi[1] + wo[0] * wo[0] + wo[1] * wo[1]
    nearness = 2 * across / ops.maximum(size, 1e-12)  # -1 at the mirror direction, 1 towards the light
    share = ops.minimum(ops.maximum(0.5 + _STEEPNESS * nearness, 0.0), 1.0)
    return ops.select((wi[2] > _COS_NORMAL) | (wo[2] > _COS_NORMAL), 1.0, share)


AnySheet = Sheet | ScatteredSheet
Sheets = tuple[tuple[AnySheet, ...], ...]

FORMAT = "gonio text"
Symmetry = Literal["isotropic", "quadrant", "half", "none"]
PHI_I_RANGE_DEG: dict[Symmetry, float] = {"isotropic": 0.0, "quadrant": 90.0, "half": 180.0, "none": 360.0}
_COS_MIN = 1e-4
_MOST_FOLDS, _MOST_LEFT_OUT = 16, 400_000  # incident directions and tuples used to choose the reconstruction
_STEEPEST = 4.0  # limit relative to f of a neighbour, for wo at the horizon and a look-up direction above it


@dataclass(frozen=True)
class GonioTable(MeasuredTable):
    """A gonio-photometer's table.

    Attributes
    ----------
    name : str
        The specimen's.
    theta_i_deg : (I,) increasing in [0, 90)
    phi_i_deg : (J,) increasing in [0, 360); (0,) for an isotropic table
    reflected : I x J sheets, or none
    transmitted : I x J sheets, or none
    symmetry : str
        isotropic; quadrant: mirrored at x = 0 and y = 0, phi_i from 0 to 90; half: f(-x, -y) = f(x, y), phi_i from 0
        to 180; none.
    reconstruction : str
        How `eval` looks up between incident directions; by default as `choice_of` finds best.
    stored, file, notes, format
        As in `TableInfo`.
    """

    name: str
    theta_i_deg: Floats
    phi_i_deg: Floats
    reflected: Sheets
    transmitted: Sheets = ()
    symmetry: Symmetry = "isotropic"
    stored: Quantity = "f"
    reconstruction: Reconstruction | Literal["auto"] = AUTO
    file: str | None = None
    notes: tuple[str, ...] = ()
    format: str = FORMAT

    def __post_init__(self) -> None:
        values = np.concatenate([sheet.values.ravel() for _, _, sheet, _ in self.entries()])
        require_values(values, usable_values(values[:, None]), self.file or self.name)

    @cached_property
    def choice(self) -> Choice:
        """The reconstruction in use; for `auto`, with the errors that chose it."""
        return choice_of(self._folds()) if self.reconstruction == AUTO else Choice(self.reconstruction)

    def _folds(self) -> Iterator[Fold]:
        """Inner theta_i, at most _MOST_FOLDS spread evenly (or both of two), with predictions from their neighbours."""
        count = len(self.theta_i_deg)
        left_out = np.arange(1, count - 1) if count > 2 else np.arange(count if count == 2 else 0)
        if len(left_out) == 0:
            return
        samples = self.samples(_MOST_LEFT_OUT)
        for k in left_out[:: -(-len(left_out) // _MOST_FOLDS)]:
            neighbours = [i for i in (k - 1, k + 1) if 0 <= i < count]
            near, far = (
                tuple(rows[i] for i in neighbours) if rows else () for rows in (self.reflected, self.transmitted)
            )
            rest = replace(self, theta_i_deg=self.theta_i_deg[neighbours], reflected=near, transmitted=far)

            def predicted(way: Reconstruction, asked: MeasuredSamples, rest: GonioTable = rest) -> Floats:
                return replace(rest, reconstruction=way).eval(asked.wi, asked.wo)

            here = np.flatnonzero(np.isclose(samples.wi[:, 2], np.cos(np.radians(self.theta_i_deg[k])), atol=1e-9))
            if len(here):
                yield samples.take(here), predicted

    @property
    def proposal(self) -> Material:
        return RETRO_PROPOSAL if self.choice.way == "back_vector" else super().proposal

    @cached_property
    def info(self) -> TableInfo:  # type: ignore[override]
        first = next(sheet for _, _, sheet, _ in self.entries())
        sizes = {"theta_i": len(self.theta_i_deg), "phi_i": len(self.phi_i_deg)}
        if isinstance(first, Sheet):
            about = "o" if first.frame is None else "specular"
            sizes |= {f"theta_{about}": len(first.theta_deg), f"phi_{about}": len(first.phi_deg)}
        else:
            sizes["outgoing"] = len(first.directions)
        isotropic, channels = self.symmetry == "isotropic", first.values.shape[-1]
        file, transmits = self.file or self.name, bool(self.transmitted)
        return TableInfo(file, self.format, isotropic, transmits, channels, self.stored, sizes, self.notes)

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., C) in 1/sr; a pair seen from below equals the same pair seen from above (a two-sided sheet).

        Readings below zero are interpolated unchanged, so that they cancel noise above zero; the result is clamped at
        0.
        """
        return on_flat_pairs(self._eval, wi, wo)

    def _eval(self, wi: Floats, wo: Floats) -> Floats:
        f = np.zeros((len(wi), self.info.channels))
        product = wi[:, 2] * wo[:, 2]
        for sheets, side in ((self.reflected, product > 0), (self.transmitted, product < 0)):
            if sheets and side.any():
                f[side] = self._eval_side(sheets, *self._reduced(raised(wi[side]), raised(wo[side])))
        return np.maximum(f, 0)

    def _reduced(self, wi: Floats, wo: Floats) -> tuple[Floats, Floats]:
        """The pair, rotated or mirrored into the table's range of incident directions."""
        if self.symmetry == "isotropic":
            sin_theta = np.hypot(wi[:, 0], wi[:, 1])
            c, s = (np.divide(wi[:, a], sin_theta, out=np.full(len(wi), 1.0 - a), where=sin_theta > 0) for a in (0, 1))
            turned = np.stack([c * wo[:, 0] + s * wo[:, 1], c * wo[:, 1] - s * wo[:, 0], wo[:, 2]], axis=-1)
            return np.stack([sin_theta, np.zeros_like(sin_theta), wi[:, 2]], axis=-1), turned
        if self.symmetry == "none":
            return wi, wo
        return mirrored_to_range(wi, wo, 1.0, quadrant=self.symmetry == "quadrant")

    def _eval_side(self, sheets: Sequence[Sequence[AnySheet]], wi: Floats, wo: Floats) -> Floats:
        theta, phi = angles(wi)
        i, i1, u = bracket(self.theta_i_deg, np.degrees(theta))
        j, j1, v, turned, turned1 = self._phi_bracket(np.degrees(phi))
        asked_of = looked_up(self.choice.way, wi, wo)
        f = np.zeros((len(wi), self.info.channels))
        for a, b, turn, weight in (
            (i, j, turned, (1 - u) * (1 - v)), (i, j1, turned1, (1 - u) * v),
            (i1, j, turned, u * (1 - v)), (i1, j1, turned1, u * v),
        ):  # fmt: skip
            half_turn = np.where(turn[:, None], (-1.0, -1.0, 1.0), 1.0)
            neighbour = direction(np.radians(self.theta_i_deg[a]), np.radians(self.phi_i_deg[b])) * half_turn
            for unturned, share, about_light in asked_of(neighbour):
                asked = unturned * half_turn
                # Interpolate p, not f: f of a lobe is strongly curved over theta_i, while p falls to 0 at the horizon,
                # where
                # f = p / cos would diverge and make single pixels too bright.
                p_over_f = np.minimum(np.maximum(asked[:, 2], 0) / np.maximum(wo[:, 2], _COS_MIN), _STEEPEST)
                part = weight * p_over_f * share
                for k, rows in groups(a * len(self.phi_i_deg) + b, np.flatnonzero(part > 0)):
                    sheet = sheets[k // len(self.phi_i_deg)][k % len(self.phi_i_deg)]
                    f[rows] += sheet.at(asked[rows], about_light=about_light) * part[rows, None]
        return f

    def _phi_bracket(self, phi_deg: Floats) -> tuple[Indices, Indices, Floats, Flags, Flags]:
        """Indices of the phi_i on either side, weight of the second, and flags of those used half a turn further.

        A full or half turn wraps around.
        """
        nodes = self.phi_i_deg
        period = {"half": 180.0, "none": 360.0}.get(self.symmetry)
        unturned = np.zeros(len(phi_deg), bool)
        if period is None or len(nodes) == 1:
            return *bracket(nodes, phi_deg), unturned, unturned
        closed = nodes if nodes[-1] - nodes[0] >= period - 1e-6 else np.append(nodes, nodes[0] + period)
        j, j1, v = bracket(closed, (phi_deg - nodes[0]) % period + nodes[0])
        if self.symmetry == "none":
            return j, j1 % len(nodes), v, unturned, unturned
        turned = np.floor_divide(phi_deg - nodes[0], period) % 2 == 1
        return j, j1 % len(nodes), v, turned, turned ^ (j1 == len(nodes))

    def samples(self, max_count: int | None = None) -> MeasuredSamples:
        """The table's tuples; the weight is the solid angle of the outgoing cell, in sr."""
        columns: list[tuple[Floats, ...]] = []
        seen: set[int] = set()
        for theta_i, phi_i, sheet, far in self.entries():
            if id(sheet) not in seen:  # at theta_i = 0, one sheet may serve every phi_i
                wo = sheet.directions[sheet.measured]
                wi = np.broadcast_to(direction(np.radians(theta_i), np.radians(phi_i)), wo.shape)
                f, weight = sheet.values[sheet.measured], sheet.weights()[sheet.measured]
                columns.append((wi, wo * (FLIP_Z if far else 1.0), f, weight))
            seen.add(id(sheet))
        wi, wo, f, weight = (np.concatenate(column) for column in zip(*columns, strict=True))
        return collect(wi, wo, f, weight, self.info, np.asarray(np.isnan(f).any(axis=1)), max_count)

    def entries(self) -> Iterator[tuple[float, float, AnySheet, bool]]:
        """Yield theta_i and phi_i in degrees, the sheet, and whether it is of the far side, per incident direction."""
        for sheets, far in ((self.reflected, False), (self.transmitted, True)):
            for theta_i, row in zip(self.theta_i_deg, sheets, strict=False):
                for phi_i, sheet in zip(self.phi_i_deg, row, strict=True):
                    yield float(theta_i), float(phi_i), sheet, far


def symmetry_of(table: MeasuredTable) -> Symmetry:
    """The symmetry a table claims."""
    if isinstance(table, GonioTable):
        return table.symmetry
    return "isotropic" if table.info.isotropic else "none"


def groups(key: Indices, rows: Indices) -> list[tuple[int, Indices]]:
    """Group the chosen rows by key: (key, rows)."""
    rows = rows[np.argsort(key[rows], kind="stable")]
    found, starts = np.unique(key[rows], return_index=True)
    return list(zip(found.tolist(), np.split(rows, starts[1:]), strict=bool(len(rows))))
