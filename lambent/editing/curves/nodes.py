"""Curves of a material document as nodes to pull: the shape of a lobe, its Fresnel reflectance, the diffuse term.

Values are absolute, so that pulling one node leaves the light at the others: of a shape, k times the density of slopes
relative to that of a Beckmann lobe's centre; of Fresnel, k times the reflectance (or k (1 - F) through a surface); of
the diffuse term, kd times the curve squared. A material whose term has no curve yet gets one at the first change.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.plain import triple
from lambent.materials.bsdf import diffuse_seen
from lambent.materials.document import COEFFICIENT_MAX, COSINE_NODES, Lobe, Material
from lambent.materials.lobes import reflectance, with_distribution
from lambent.materials.slope_curve import NODES_RHO, ROW, normalised, slope_table

Kind = Literal["shape", "fresnel", "diffuse"]
KINDS: tuple[Kind, ...] = get_args(Kind)
LEAST = 1e-9  # of the largest value: what a pull can start from
REACH_NODES = 1.5  # standard deviation of a soft pull


@dataclass(frozen=True)
class Which:
    """One curve of a material: its kind, and the number of its lobe."""

    kind: Kind
    lobe: int = 0


def curves_of(material: Material) -> list[Which]:
    """The curves that a material has or can have."""
    found = [Which(kind, i) for i in range(len(material.lobes)) for kind in ("shape", "fresnel")]
    return [*found, *([Which("diffuse")] if any(material.kd) else [])]


TITLES = {"shape": "highlight", "fresnel": "reflectance by angle", "diffuse": "diffuse by angle"}


def titled(material: Material) -> dict[str, Which]:
    """The curves by title; those of several lobes are numbered."""
    many = len(material.lobes) > 1
    numbers = (f" {which.lobe + 1}" if which.kind != "diffuse" and many else "" for which in curves_of(material))
    return {TITLES[which.kind] + number: which for which, number in zip(curves_of(material), numbers, strict=True)}


def angles_deg(material: Material, which: Which) -> Floats:
    """(K,) angles of the nodes: theta_h, theta_d, or theta of either direction; the last falls for the latter two."""
    if which.kind != "shape":
        return np.degrees(np.arccos(np.linspace(0, 1, COSINE_NODES)))
    lobe = material.lobes[which.lobe]
    return np.asarray(np.degrees(np.arctan(NODES_RHO * np.sqrt(lobe.mx * lobe.my))))


def values_of(material: Material, which: Which) -> Floats:
    """(K, C) values at the nodes; C is 1 for a shape and the diffuse term, 3 for Fresnel."""
    if which.kind == "diffuse":
        nodes = np.array(_kd_curve(material))
        return np.asarray(float(np.mean(material.kd)) * nodes * nodes)[:, None]
    lobe = material.lobes[which.lobe]
    if which.kind == "shape":
        rows = slope_table(with_distribution(lobe, "curve").shape or ()).reshape(-1, ROW)
        return np.asarray(float(np.mean(lobe.k)) * np.exp(rows[:, 0]))[:, None]
    return np.asarray(lobe.k) * _passed(lobe, np.array(_fresnel(lobe)).T)


def with_values(material: Material, which: Which, values: Floats) -> Material:
    """The material whose curve has these values (K, C) >= 0; values that are all 0 change nothing."""
    if not np.isfinite(values).all() or values.max() <= 0:
        return material
    if which.kind == "diffuse":
        return _with_diffuse(material, values[:, 0])
    lobe = material.lobes[which.lobe]
    changed = (_with_shape if which.kind == "shape" else _with_fresnel)(lobe, np.maximum(values, 0.0))
    return with_lobe(material, which.lobe, changed)


def with_lobe(material: Material, number: int, lobe: Lobe) -> Material:
    """The material with another lobe in place of one."""
    lobes = (*material.lobes[:number], lobe, *material.lobes[number + 1 :])
    return material.model_copy(update={"lobes": lobes})


def pulled(values: Floats, node: int, to: float, channels: tuple[int, ...], soft: bool) -> Floats:
    """The values with one node moved to a value; a soft pull takes its neighbours along, by the same factor."""
    found = values.copy()
    for c in channels:
        least = LEAST * max(float(values[:, c].max()), 1e-30)
        ratio = max(to, 0.0) / max(float(values[node, c]), least)
        if not soft:
            found[node, c] = max(to, 0.0)
            continue
        weight = np.exp(-0.5 * ((np.arange(len(values)) - node) / REACH_NODES) ** 2)
        found[:, c] = values[:, c] * max(ratio, LEAST) ** weight
    return found


def smoothed(values: Floats) -> Floats:
    """Each logarithm, averaged with its neighbours by 1, 2, 1; the ends stay."""
    logs = np.log(np.maximum(values, LEAST * values.max()))
    logs[1:-1] = (logs[:-2] + 2 * logs[1:-1] + logs[2:]) / 4
    return np.asarray(np.exp(logs))


def copied(material: Material, which: Which, other: Material) -> Material | None:
    """The material with a curve of the other: of its first lobe of that kind, or its diffuse term; None without."""
    if which.kind == "diffuse":
        return (
            material.model_copy(update={"kd_curve": _kd_curve(other), "kd_coupled": False}) if any(other.kd) else None
        )
    lobe = material.lobes[which.lobe]
    source = next((one for one in other.lobes if one.kind == lobe.kind), None)
    if source is None:
        return None
    if which.kind == "fresnel":
        changed = lobe.model_copy(update={"fresnel": _fresnel(source), "r0": source.r0})
    else:
        curve = with_distribution(source, "curve")
        changed = lobe.model_copy(
            update={"distribution": "curve", "shape": curve.shape, "mx": source.mx, "my": source.my}
        )
    return with_lobe(material, which.lobe, changed)


def _with_shape(lobe: Lobe, values: Floats) -> Lobe:
    curve = with_distribution(lobe, "curve")
    before, after = curve.shape or (), tuple((values[:, 0] / values[:, 0].max()).tolist())
    old, new = (slope_table(shape)[::ROW].max() for shape in (before, after))  # ln of the largest density
    peak = float(np.mean(lobe.k)) * np.exp(old)
    factor = float(values[:, 0].max() / max(peak, 1e-30) * np.exp(old - new))
    k = triple(np.minimum(np.multiply(lobe.k, factor), COEFFICIENT_MAX))
    return curve.model_copy(update={"shape": after, "k": k})


def _with_fresnel(lobe: Lobe, values: Floats) -> Lobe:
    k = np.minimum(values.max(axis=0), COEFFICIENT_MAX)
    share = np.divide(np.minimum(values, k), k, out=np.zeros_like(values), where=k > 0)
    red, green, blue = (tuple(channel) for channel in _passed(lobe, share).T.tolist())
    update = {"k": triple(k), "fresnel": (red, green, blue), "r0": (red[-1], green[-1], blue[-1])}
    return lobe.model_copy(update=update)


def _with_diffuse(material: Material, values: Floats) -> Material:
    """kd grows with the curve; a white surface cannot get brighter."""
    nodes = tuple(np.sqrt(np.maximum(values, 0.0) / values.max()).tolist())
    factor = (values.max() / max(normalised(nodes)) ** 2) / max(float(np.mean(material.kd)), 1e-30)
    kd = triple(np.minimum(np.multiply(material.kd, factor), 1.0))
    return material.model_copy(update={"kd": kd, "kd_curve": nodes, "kd_coupled": False})


def _fresnel(lobe: Lobe) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
    if lobe.fresnel is not None:
        return lobe.fresnel
    cosine = np.linspace(0, 1, COSINE_NODES)
    red, green, blue = (tuple(np.asarray(reflectance(cosine, lobe, c)).tolist()) for c in range(3))
    return red, green, blue


def _passed(lobe: Lobe, reflected: Floats) -> Floats:
    """Share of the light that goes on in the lobe; its own inverse."""
    return 1 - reflected if lobe.side == "transmission" else reflected


def _kd_curve(material: Material) -> tuple[float, ...]:
    if material.kd_curve is not None:
        return normalised(material.kd_curve)
    seen = diffuse_seen(np.linspace(0, 1, COSINE_NODES), material)
    return normalised(tuple(np.asarray(seen).tolist()))
