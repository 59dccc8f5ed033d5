"""What tables of every format share: albedos by quadrature, filled holes, and the refusal of files without values."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cache
from pathlib import Path

import numpy as np

from lambent.core.directions import Floats
from lambent.core.errors import UserError
from lambent.core.sequences import radical_inverse
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.protocol import LARGEST_F, Flags, MeasuredSamples, TableInfo

# The quadrature draws from a mixture that is nowhere much narrower or wider than a measured lobe can be.
_WHITE, _HALF = (1.0, 1.0, 1.0), (0.5, 0.5, 0.5)
_PROPOSAL = Material(
    kd=_WHITE, lobes=tuple(Lobe(distribution="ggx", mx=m, my=m, r0=_WHITE, k=_HALF) for m in (0.02, 0.08, 0.3))
)
_QUADRATURE_POINTS = 4096
_QUERIES_AT_ONCE = 1 << 17


class IntegratedTable(ABC):
    """Base of the tables: `eval` and `samples` are the format's, reflectivity and transmissivity follow from `eval`."""

    info: TableInfo

    @abstractmethod
    def eval(self, wi: Floats, wo: Floats) -> Floats: ...

    @abstractmethod
    def samples(self, max_count: int | None = None) -> MeasuredSamples: ...

    def reflectivity(self, wi: Floats) -> Floats:
        """r (..., C): the integral of f |cos theta_o| over the side of wi (2.7), to about .5 % of a smooth table."""
        return self._integral(wi, 1.0)

    def transmissivity(self, wi: Floats) -> Floats:
        """t (..., C): the integral of f |cos theta_o| over the far side (2.8); 0 of an opaque table."""
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
        proposal, u = MaterialBSDF(_PROPOSAL), _quadrature()
        all_wi = np.broadcast_to(wi, u.shape)
        wo = proposal.sample(all_wi, u)
        pdf = proposal.pdf(wo, all_wi)
        inside = (pdf > 0) & (wo[:, 2] * wi[2] > 0)
        weight = np.abs(wo[inside, 2]) / pdf[inside]
        f = self.eval(all_wi[inside], wo[inside] * (1, 1, side))
        return np.asarray((f * weight[:, None]).sum(axis=0) / len(u))


@cache
def _quadrature() -> Floats:
    """Low-discrepancy points of the unit cube: the first coordinate chooses the component, so it is stratified."""
    k = np.arange(_QUADRATURE_POINTS)
    return np.stack([radical_inverse(k, 3), (k + 0.5) / len(k), radical_inverse(k, 2)], axis=-1)


class ReflectionTable(IntegratedTable):
    """Base of three-channel tables of reflection alone: look-ups in pieces, 0 where wi or wo is below the surface."""

    @abstractmethod
    def _eval_above(self, wi: Floats, wo: Floats) -> Floats:
        """f (N, 3) of directions (N, 3) above the surface."""

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., 3) in 1/sr; 0 where wi or wo is below the surface."""
        wi, wo = np.broadcast_arrays(np.asarray(wi, float), np.asarray(wo, float))
        flat_i, flat_o = wi.reshape(-1, 3), wo.reshape(-1, 3)
        f = np.zeros((len(flat_i), 3))
        above = np.flatnonzero((flat_i[:, 2] > 0) & (flat_o[:, 2] > 0))
        for start in range(0, len(above), _QUERIES_AT_ONCE):
            part = above[start : start + _QUERIES_AT_ONCE]
            f[part] = self._eval_above(flat_i[part], flat_o[part])
        return f.reshape(wi.shape)


def isotropic_brdf(path: Path, reader: str, sizes: dict[str, int], notes: tuple[str, ...]) -> TableInfo:
    """What a file says about itself that holds f of an opaque isotropic material, as linear RGB."""
    return TableInfo(
        file=Path(path).name,
        format=reader,
        isotropic=True,
        transmits=False,
        channels=3,
        stored="f",
        sizes=sizes,
        notes=notes,
    )


def sensible(values: Floats) -> Flags:
    """(...) whether all channels of values (..., C) are finite and no brighter than any surface."""
    with np.errstate(invalid="ignore"):
        return np.asarray((np.isfinite(values) & (values <= LARGEST_F)).all(axis=-1))


def fill_holes(values: Floats, measured: Flags, periodic_axis: int | None = None) -> Floats:
    """`values` (grid..., C) with every cell that was not measured set to the nearest measured one, in cells.

    Parameters
    ----------
    values : (grid..., C)
    measured : (grid...) bool, with at least one True
    periodic_axis : int, optional
        Axis of the grid that wraps round.
    """
    if measured.all():
        return values
    from scipy.ndimage import distance_transform_edt

    axis = periodic_axis
    pad = [(0, 0)] * measured.ndim
    if axis is not None:
        pad[axis] = (measured.shape[axis] // 2,) * 2
    padded = np.pad(~measured, pad, mode="wrap")
    nearest = distance_transform_edt(padded, return_distances=False, return_indices=True)
    if axis is not None:
        inner = [slice(None)] * measured.ndim
        inner[axis] = slice(pad[axis][0], pad[axis][0] + measured.shape[axis])
        nearest = nearest[(slice(None), *inner)]
        nearest[axis] = (nearest[axis] - pad[axis][0]) % measured.shape[axis]
    return np.asarray(values[tuple(nearest)])


def require_values(values: Floats, measured: Flags, file: Path | str) -> None:
    """`UserError` where no cell of values (grid..., C) was measured; the message counts what is there instead."""
    if measured.any():
        return
    with np.errstate(invalid="ignore"):
        finite, negative = np.isfinite(values) & (values <= LARGEST_F), int((values < 0).sum())
    got = f"{values.size} values, {int((~finite).sum())} not finite or beyond {LARGEST_F:g} /sr, {negative} negative"
    raise UserError("holds no measured value", file=file, got=got)
