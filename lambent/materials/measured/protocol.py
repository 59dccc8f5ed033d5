"""What every measured table offers, whatever its file format.

Conventions: directions are unit vectors (..., 3) in the local frame with n = +z, pointing away from the surface; `wi`
to the light, `wo` to the viewer. f is in 1/sr per channel and holds no cosine; the transfer probability is
p(wo|wi) = f |cos theta_o| (2.4), and a reader converts what its file holds to f. One channel is grey; three are linear
RGB with Rec.709 primaries.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from lambent.core.errors import UserError

Floats = NDArray[np.floating]
Flags = NDArray[np.bool_]

GRAZING_DEG = 84.0  # beyond this, gonio-photometers and grids see mostly their own errors
LARGEST_F = 1e9  # 1/sr; no surface is that bright, and its square still fits float32
_COS_GRAZING = float(np.cos(np.radians(GRAZING_DEG)))


@dataclass(frozen=True)
class LeftOut:
    """How many raw tuples are not fit to be used, by the first reason that holds, in this order."""

    shadowed: int = 0  # not measured: the device was in the way, or the file marks the cell as empty
    not_finite: int = 0
    negative: int = 0  # any channel
    grazing: int = 0  # theta_i or theta_o beyond GRAZING_DEG

    @property
    def total(self) -> int:
        return self.shadowed + self.not_finite + self.negative + self.grazing


@dataclass(frozen=True)
class TableInfo:
    """What a file says about itself.

    Attributes
    ----------
    file : str
        Name of the file, without folders; the specimen's name for a table that was made in memory.
    format : str
        Name of the reader that took it.
    isotropic, transmits : bool
        Whether f depends on phi_i - phi_o alone; whether tuples with theta_o > 90 degrees exist.
    channels : int
        1 (grey) or 3 (linear RGB, Rec.709 primaries).
    stored : str
        The quantity as the file holds it; `eval` and `samples` give f in 1/sr all the same.
    sizes : dict
        Grid dimensions by name, as stored.
    notes : tuple of str
        What the reader repaired or assumed, for the user to read.
    """

    file: str
    format: str
    isotropic: bool
    transmits: bool
    channels: int
    stored: Literal["f", "f_cos", "p"]
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
        BSDF in 1/sr, without the cosine; C = 1 or 3; finite and >= 0.
    weight : (N,) float64
        Solid angle that the tuple stands for, in sr: sin(theta_o) dtheta_o dphi_o of its cell where the table has
        incident directions (the sin(theta_o) of (3.7)); the share of the joint measure d_wi d_wo, in sr^2, where it has
        none (MERL, Cornell). Only ratios within a table have a meaning.
    left_out : LeftOut
        Tuples of the table that are not among these.
    info : TableInfo
    """

    wi: Floats
    wo: Floats
    f: Floats
    weight: Floats
    left_out: LeftOut
    info: TableInfo

    def __len__(self) -> int:
        return len(self.wi)

    @property
    def p(self) -> Floats:
        """(N, C) transfer probability f |cos theta_o| in 1/sr (2.4)."""
        return self.f * np.abs(self.wo[:, 2:])

    @property
    def transmitted(self) -> Flags:
        """(N,) whether wo is on the far side."""
        return np.asarray(self.wo[:, 2] < 0)


class MeasuredTable(Protocol):
    """One measured material."""

    @property
    def info(self) -> TableInfo: ...

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., C) in 1/sr without the cosine, of wi, wo (..., 3); >= 0; holes are filled from their neighbours."""
        ...

    def reflectivity(self, wi: Floats) -> Floats:
        """r (..., C) in [0, 1]: the integral of p over the near side (2.7)."""
        ...

    def transmissivity(self, wi: Floats) -> Floats:
        """t (..., C) in [0, 1]: the integral of p over the far side (2.8)."""
        ...

    def albedo(self, wi: Floats) -> Floats:
        """r + t (..., C)."""
        ...

    def samples(self, max_count: int | None = None) -> MeasuredSamples:
        """The raw tuples, or an even, deterministic choice of at most `max_count` of them."""
        ...


def collect(
    wi: Floats, wo: Floats, f: Floats, weight: Floats, info: TableInfo, shadowed: Flags, max_count: int | None = None
) -> MeasuredSamples:
    """`MeasuredSamples` of raw tuples: leaves out and counts what cannot be used, then thins.

    Parameters
    ----------
    wi, wo : (N, 3)
    f : (N, C) in 1/sr, as measured
    weight : (N,)
    shadowed : (N,) bool
        Tuples the file marks as not measured.
    max_count : int, optional
        Keep at most so many, spread evenly in storage order with a fixed seed.

    Raises
    ------
    UserError
        Where nothing is left.
    """
    finite = (np.isfinite(f) & (f <= LARGEST_F)).all(axis=1)
    negative = (np.where(np.isfinite(f), f, 0) < 0).any(axis=1)
    grazing = (np.abs(wi[:, 2]) < _COS_GRAZING) | (np.abs(wo[:, 2]) < _COS_GRAZING)
    used = np.ones(len(f), dtype=bool)
    counts = []
    for reason in (shadowed, ~finite, negative, grazing):
        counts.append(int((used & reason).sum()))
        used &= ~reason
    left_out = LeftOut(*counts)
    chosen = np.flatnonzero(used)
    if len(chosen) == 0:
        raise UserError("holds no measured value", file=info.file, got=f"{len(f)} tuples, {describe(left_out)}")
    if max_count is not None and len(chosen) > max_count:
        jitter = np.random.default_rng(0).random(max_count)
        chosen = chosen[((np.arange(max_count) + jitter) * (len(chosen) / max_count)).astype(np.int64)]
    return MeasuredSamples(wi[chosen], wo[chosen], f[chosen], weight[chosen], left_out, info)


def describe(left_out: LeftOut) -> str:
    """The counts in words, such as '12 shadowed, 3 negative'."""
    named = {"shadowed": left_out.shadowed, "not finite": left_out.not_finite}
    named |= {"negative": left_out.negative, "grazing": left_out.grazing}
    return ", ".join(f"{count} {reason}" for reason, count in named.items() if count) or "none left out"
