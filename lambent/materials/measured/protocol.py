"""Measured tables, whatever their file format: metadata, look-up, albedos and raw tuples.

Conventions: directions are unit vectors (..., 3) in the local frame with n = +z, pointing away from the surface; `wi`
to the light, `wo` to the viewer. f is in 1/sr per channel without a cosine; the transfer probability is
p(wo|wi) = f |cos theta_o| (2.4), and readers convert their file's quantity to f. One channel is grey; three are linear
RGB with Rec.709 primaries.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass, field, replace
from functools import cache
from typing import Literal

import numpy as np

from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.errors import UserError
from lambent.core.geometry.sequences import radical_inverse
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import SIDES, Lobe, Material, Side

GRAZING_DEG = 84.0  # beyond it, errors of gonio-photometers and grids dominate
LARGEST_F = 1e9  # 1/sr; no surface is that bright, and its square still fits float32
_COS_GRAZING = float(np.cos(np.radians(GRAZING_DEG)))
Quantity = Literal["f", "f_cos", "p"]
# The quadrature's mixture has lobes of every width that measured lobes can have.
_WHITE, _HALF = (1.0, 1.0, 1.0), (0.5, 0.5, 0.5)
_PROPOSAL = Material(
    kd=_WHITE, lobes=tuple(Lobe(distribution="ggx", mx=m, my=m, r0=_WHITE, k=_HALF) for m in (0.02, 0.08, 0.3))
)
_RETRO = tuple(Lobe(retro=True, mx=m, my=m, r0=_WHITE, k=_HALF) for m in (0.004, 0.02, 0.1))
RETRO_PROPOSAL = _PROPOSAL.model_copy(update={"lobes": (*_PROPOSAL.lobes, *_RETRO)})  # for peaks about the light
_QUADRATURE_POINTS = 4096


@dataclass(frozen=True)
class LeftOut:
    """Numbers of unusable raw tuples, by the first applicable reason in this order."""

    shadowed: int = 0  # not measured: the device was in the way, or the file marks the cell as empty
    not_finite: int = 0  # or impossible: above LARGEST_F, or further below zero than the brightest tuple is above it
    grazing: int = 0  # theta_i or theta_o beyond GRAZING_DEG

    @property
    def total(self) -> int:
        return sum(asdict(self).values())


@dataclass(frozen=True)
class TableInfo:
    """Metadata of a measured table.

    Attributes
    ----------
    file : str
        Name of the file, without folders; the specimen's name for a table made in memory.
    format : str
        Name of the reader.
    isotropic, transmits : bool
        Whether f depends on phi_i - phi_o alone; whether tuples with theta_o > 90 degrees exist.
    channels : int
        1 (grey) or 3 (linear RGB, Rec.709 primaries).
    stored : str
        The quantity in the file; `eval` and `samples` give f in 1/sr in any case.
    sizes : dict
        Grid dimensions by name, as stored.
    notes : tuple of str
        Repairs and assumptions of the reader, for the user to read.
    """

    file: str
    format: str
    isotropic: bool
    transmits: bool
    channels: int
    stored: Quantity
    sizes: dict[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    units: Literal["1/sr"] = "1/sr"


@dataclass(frozen=True)
class MeasuredSamples:
    """The raw tuples of a table, for fitting.

    Attributes
    ----------
    wi, wo : (N, 3) float64
        Unit directions to the light and to the viewer; wi.z > 0; wo.z < 0 is transmission.
    f : (N, C) float64
        BSDF in 1/sr, without the cosine; C = 1 or 3; finite. Dark readings are noise about zero, so a channel can be
        negative: clamping at 0 would raise the mean.
    weight : (N,) float64
        Solid angle of the tuple, in sr: sin(theta_o) dtheta_o dphi_o of its cell if the table has incident directions
        (the sin(theta_o) of (3.7)); otherwise (MERL, Cornell) the share of the joint measure d_wi d_wo, in sr^2. Only
        ratios within a table are meaningful.
    left_out : LeftOut
        Tuples of the table that were left out.
    """

    wi: Floats
    wo: Floats
    f: Floats
    weight: Floats
    left_out: LeftOut
    info: TableInfo

    def __len__(self) -> int:
        return len(self.wi)

    def take(self, index: Indices) -> MeasuredSamples:
        """The tuples `index`."""
        return replace(self, **{name: getattr(self, name)[index] for name in ("wi", "wo", "f", "weight")})

    @property
    def p(self) -> Floats:
        """(N, C) transfer probability f |cos theta_o| in 1/sr (2.4)."""
        return self.f * np.abs(self.wo[:, 2:])

    @property
    def below_zero(self) -> int:
        """Number of tuples with a negative channel."""
        return int((self.f < 0).any(axis=1).sum())

    @property
    def counts(self) -> dict[str, int]:
        """Number of tuples: used, below zero among these, and left out by reason."""
        return {"used": len(self), "below_zero": self.below_zero, **asdict(self.left_out)}

    @property
    def transmitted(self) -> Flags:
        """(N,) whether wo is on the far side."""
        return np.asarray(self.wo[:, 2] < 0)

    def on(self, side: Side) -> Flags:
        """(N,) whether the tuple is one of reflection or of transmission."""
        return self.transmitted if side == "transmission" else ~self.transmitted

    @property
    def sides(self) -> list[Side]:
        """The sides that have tuples."""
        return [side for side in SIDES if self.on(side).any()]


class MeasuredTable(ABC):
    """One measured material; its albedos are integrals of the format's `eval`."""

    info: TableInfo

    @property
    def proposal(self) -> Material:
        """A material with lobes wherever the table may have peaks; its samples integrate the table."""
        return _PROPOSAL

    @abstractmethod
    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., C) in 1/sr without the cosine, of wi, wo (..., 3); >= 0; holes are filled from their neighbours."""

    @abstractmethod
    def samples(self, max_count: int | None = None) -> MeasuredSamples:
        """The raw tuples, or a uniform, deterministic choice of at most `max_count` of them."""

    def reflectivity(self, wi: Floats) -> Floats:
        """r (..., C): the integral of f |cos theta_o| over the side of wi (2.7), to about .5 % for a smooth table."""
        return self._integral(wi, 1.0)

    def transmissivity(self, wi: Floats) -> Floats:
        """t (..., C): the integral of f |cos theta_o| over the far side (2.8); 0 for an opaque table."""
        if not self.info.transmits:
            return np.zeros((*wi.shape[:-1], self.info.channels))
        return self._integral(wi, -1.0)

    def albedo(self, wi: Floats) -> Floats:
        """r + t (..., C)."""
        return np.asarray(self.reflectivity(wi) + self.transmissivity(wi))

    def _integral(self, wi: Floats, side: float) -> Floats:
        flat = np.asarray(wi, dtype=float).reshape(-1, 3)
        value = [self._integral_of_one(w, side) for w in flat]
        return np.array(value).reshape(*wi.shape[:-1], self.info.channels)

    def _integral_of_one(self, wi: Floats, side: float) -> Floats:
        wo, weight = quadrature(wi, self.proposal)
        f = self.eval(np.broadcast_to(wi, wo.shape), wo * (1, 1, side))
        return np.asarray((f * weight[:, None]).sum(axis=0))


def quadrature(wi: Floats, toward: Material = _PROPOSAL, points: int = _QUADRATURE_POINTS) -> tuple[Floats, Floats]:
    """wo (N, 3) on the side of wi (3,), drawn from `toward`, and weights (N,) whose sum times f is r."""
    proposal, u = MaterialBSDF(toward), _low_discrepancy(points)
    all_wi = np.broadcast_to(wi, u.shape)
    wo = proposal.sample(all_wi, u)
    pdf = proposal.pdf(wo, all_wi)
    inside = (pdf > 0) & (wo[:, 2] * wi[2] > 0)
    return wo[inside], np.abs(wo[inside, 2]) / (pdf[inside] * points)


@cache
def _low_discrepancy(points: int) -> Floats:
    """Points of the unit cube: the first coordinate chooses the component, so it is stratified."""
    k = np.arange(points)
    return np.stack([radical_inverse(k, 3), (k + 0.5) / len(k), radical_inverse(k, 2)], axis=-1)


def collect(
    wi: Floats, wo: Floats, f: Floats, weight: Floats, info: TableInfo, shadowed: Flags, max_count: int | None = None
) -> MeasuredSamples:
    """`MeasuredSamples` of raw tuples: leaves out and counts unusable tuples, then thins.

    Parameters
    ----------
    wi, wo : (N, 3)
    f : (N, C) in 1/sr, as measured
    weight : (N,)
    shadowed : (N,) bool
        Tuples the file marks as not measured.
    max_count : int, optional
        Keep at most this many, spread evenly in storage order with a fixed seed.

    Raises
    ------
    UserError
        Nothing is left.
    """
    finite = (np.isfinite(f) & (np.abs(f) <= LARGEST_F)).all(axis=1)
    grazing = (np.abs(wi[:, 2]) < _COS_GRAZING) | (np.abs(wo[:, 2]) < _COS_GRAZING)
    used = np.ones(len(f), dtype=bool)
    counts = []
    for reason in (shadowed, ~finite | too_negative(f, wo, ~shadowed & finite), grazing):
        counts.append(int((used & reason).sum()))
        used &= ~reason
    left_out = LeftOut(*counts)
    chosen = np.flatnonzero(used)
    if len(chosen) == 0:
        raise UserError("has no measured value", file=info.file, got=f"{len(f)} tuples, {describe(left_out)}")
    if max_count is not None and len(chosen) > max_count:
        chosen = chosen[even_choice(len(chosen), max_count)]
    return MeasuredSamples(wi[chosen], wo[chosen], f[chosen], weight[chosen], left_out, info)


def too_negative(f: Floats, wo: Floats, measured: Flags) -> Flags:
    """(N,) whether f cos theta_o is further below zero than any measured value is above it: a mark, not noise."""
    p = np.where(measured[:, None], f, 0) * np.abs(wo[:, 2:])
    return np.asarray(p.min(axis=1) < -p.max(initial=0))


def even_choice(count: int, most: int) -> Indices:
    """(most,) indices below `count` >= `most`, jittered and evenly spread, deterministic."""
    return ((np.arange(most) + np.random.default_rng(0).random(most)) * (count / most)).astype(np.int64)


def negative_readings(samples: MeasuredSamples) -> str:
    """A sentence on the number, channels and size of negative readings; empty without any."""
    count = samples.below_zero
    if not count:
        return ""
    names = ("red", "green", "blue") if samples.f.shape[1] == 3 else ("f",)
    each = zip(names, (samples.f < 0).sum(axis=0), samples.f.min(axis=0), strict=True)
    found = ", ".join(f"{name} in {times}, down to {lowest:.2g} /sr" for name, times, lowest in each if times)
    share = f"{count} of {len(samples)} tuples ({percentage(100 * count / len(samples))})"
    return f"{share} are below zero: {found}"


def percentage(value: float) -> str:
    """A value in per cent with two digits, such as '.3 %'."""
    return f"{value:.0f} %" if value >= 10 else f"{value:.2g} %"


def describe(left_out: LeftOut) -> str:
    """The counts in words, such as '12 shadowed, 3 grazing'."""
    counts = asdict(left_out).items()
    return ", ".join(f"{count} {reason.replace('_', ' ')}" for reason, count in counts if count) or "none left out"
