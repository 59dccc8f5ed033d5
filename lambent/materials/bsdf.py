"""A whole material as a BSDF: diffuse terms plus lobes, one mixture for eval, sample and pdf.

As in lobes.py, directions are component tuples and `ops` is their array library.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.plain import Triple
from lambent.materials import lobes
from lambent.materials.document import BLACK, Material
from lambent.materials.lobes import COS_MIN, NUMPY, Vector
from lambent.materials.slope_curve import at_cosine, normalised

ENERGY_TOLERANCE = 0.01  # excess over 1 attributed to rounding, quadrature and devices
SELECTION_FLOOR = 0.02  # share of k: Fresnel can vanish at wo (r0 = 0, wo = n) but not at the half vector


def more_than_arrives(albedo: Floats) -> Flags:
    """(...) whether albedos (...) exceed 1 by more than ENERGY_TOLERANCE; all energy warnings use this test."""
    return np.asarray(np.asarray(albedo) > 1 + ENERGY_TOLERANCE)


def under_fresnel(cosine: Any, ops: Any = NUMPY) -> Any:
    """t = 1 - (1 - cos)^5: Schlick's transmittance at this cosine over that at normal incidence, (1 - F)/(1 - r0).

    Built as cos (1 + m + ... + m^4) with m = 1 - cos, which does not cancel at grazing.
    """
    cosine = ops.minimum(cosine, 1.0)
    m = 1 - cosine
    return cosine * (1 + m * (1 + m * (1 + m * (1 + m))))


def coupling(cos_i: Any, cos_o: Any, ops: Any = NUMPY) -> Any:
    """Factor of kd/pi of a coupled diffuse term, (21/20) t(cos_i) t(cos_o); cosines in [0, 1].

    Reciprocal; the albedo at wo is exactly kd t(cos_o). After Ashikhmin & Shirley 2000 (5), with Schlick's fifth power
    of the cosine.
    """
    return 21 / 20 * under_fresnel(cos_i, ops) * under_fresnel(cos_o, ops)


def diffuse_share(cos_i: Any, cos_o: Any, material: Material, ops: Any = NUMPY) -> Any:
    """Factor of kd/pi between two directions of one side; cosines in [0, 1]."""
    if material.kd_curve is not None:
        curve = normalised(material.kd_curve)
        return at_cosine(cos_i, curve, ops) * at_cosine(cos_o, curve, ops)
    return coupling(cos_i, cos_o, ops) if material.kd_coupled else 1.0


def diffuse_seen(cos_o: Any, material: Material, ops: Any = NUMPY) -> Any:
    """The mean of `diffuse_share` over cosine-weighted light: albedo of the diffuse reflection over kd."""
    if material.kd_curve is not None:
        return at_cosine(cos_o, normalised(material.kd_curve), ops)
    return under_fresnel(cos_o, ops) if material.kd_coupled else 1 + 0 * cos_o


def evaluate(wi: Vector, wo: Vector, material: Material, ops: Any = NUMPY) -> Vector:
    """f in 1/sr per RGB channel, without the cosine (3.6), for unit directions on any side of the sheet."""
    same, across = wi[2] * wo[2] > 0, wi[2] * wo[2] < 0
    share = diffuse_share(ops.abs(wi[2]), ops.abs(wo[2]), material, ops)
    value = [
        ops.select(same, material.kd[c] / np.pi * share, 0.0) + ops.select(across, material.kt_d[c] / np.pi, 0.0)
        for c in range(3)
    ]
    for lobe in material.lobes:
        value = [v + f for v, f in zip(value, lobes.evaluate(wi, wo, lobe, ops), strict=True)]
    return value[0], value[1], value[2]


def _mean(rgb: Triple) -> float:
    return sum(rgb) / 3


def selection(wo: Vector, material: Material, ops: Any = NUMPY) -> list[Any]:
    """Probability of each component at `wo`: diffuse reflection, diffuse transmission, then the lobes.

    It depends on wo alone, which keeps the mixture's pdf exact, and is roughly proportional to the returned energy.
    """
    cos_o = ops.abs(wo[2])
    seen = diffuse_seen(cos_o, material, ops)
    weights: list[Any] = [_mean(material.kd) * seen, _mean(material.kt_d) + 0 * cos_o]
    for lobe in material.lobes:
        f = lobes.mean_reflectance(cos_o, lobe, ops)
        f = f if lobe.side == "reflection" else 1 - f
        weights.append(_mean(lobe.k) * ops.maximum(f, SELECTION_FLOOR))
    total = sum(weights[1:], weights[0])
    scale = ops.select(total > 0, 1 / ops.maximum(total, 1e-12), 0.0)
    return [w * scale for w in weights]


def pdf(wi: Vector, wo: Vector, material: Material, ops: Any = NUMPY) -> Any:
    """Density in 1/sr of `sample` at wi, given wo."""
    chosen = selection(wo, material, ops)
    cosine = ops.abs(wi[2]) / np.pi
    value = ops.select(wi[2] * wo[2] > 0, chosen[0] * cosine, 0.0)
    value = value + ops.select(wi[2] * wo[2] < 0, chosen[1] * cosine, 0.0)
    for p, lobe in zip(chosen[2:], material.lobes, strict=True):
        value = value + p * lobes.pdf(wi, wo, lobe, ops)
    return ops.select(ops.abs(wo[2]) > COS_MIN, value, 0.0)


def sample(wo: Vector, u_select: Any, u1: Any, u2: Any, material: Material, ops: Any = NUMPY) -> Vector:
    """Sample wi from the mixture; u_* uniform in [0, 1).

    A lobe sample at or below the horizon is returned with wi.z = 0, where value and pdf are 0. Returned as it is, the
    pdf of the other components would accept it, and the estimate would be too bright.
    """
    chosen = selection(wo, material, ops)
    side = ops.select(wo[2] > 0, 1.0, -1.0)
    x, y, z = lobes.sample_cosine(u1, u2, ops)
    up_to = chosen[0]
    z = ops.select(u_select < up_to, z, -z) * side
    up_to = up_to + chosen[1]
    for p, lobe in zip(chosen[2:], material.lobes, strict=True):
        lx, ly, lz = lobes.sample(wo, u1, u2, lobe, ops)
        towards = -side if lobe.side == "transmission" else side
        lz = ops.select(lz * towards > COS_MIN, lz, 0.0)
        here = u_select >= up_to
        x, y, z = ops.select(here, lx, x), ops.select(here, ly, y), ops.select(here, lz, z)
        up_to = up_to + p
    return x, y, z


def components(w: Floats) -> Vector:
    """The components of (..., 3) directions, in float64."""
    w = np.asarray(w, np.float64)
    return w[..., 0], w[..., 1], w[..., 2]


class MaterialBSDF:
    """A material as a BSDF on (..., 3) arrays; computes in float64."""

    def __init__(self, material: Material) -> None:
        self.material = material

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., 3) in 1/sr, without the cosine."""
        return np.stack(evaluate(components(wi), components(wo), self.material), axis=-1)

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        """Density (...) in 1/sr of `sample` given wo."""
        value: Floats = np.asarray(pdf(components(wi), components(wo), self.material))
        return value

    def sample(self, wo: Floats, u: Floats) -> Floats:
        """wi (..., 3) from wo (..., 3) and u (..., 3) uniform in [0, 1)."""
        return np.stack(sample(components(wo), u[..., 0], u[..., 1], u[..., 2], self.material), axis=-1)

    def albedo(self, wo: Floats, samples: int = 4096) -> Floats:
        """Directional albedo (..., 3) of wo (..., 3): the integral of f |cos| over all wi, by importance sampling."""
        u = np.random.default_rng(0).random((samples, 3))
        wo_all = np.broadcast_to(wo[..., None, :], (*wo.shape[:-1], samples, 3))
        wi = self.sample(wo_all, np.broadcast_to(u, wo_all.shape))
        return np.asarray((self.eval(wi, wo_all) * cos_over_pdf(wi, self.pdf(wi, wo_all))[..., None]).mean(axis=-2))


def cos_over_pdf(wi: Floats, pdf: Floats) -> Floats:
    """|cos theta| / pdf (...) of sampled directions (..., 3); 0 for rejected samples, whose pdf is 0."""
    return np.divide(np.abs(wi[..., 2]), pdf, out=np.zeros_like(pdf), where=pdf > 0)


def specular_only(material: Material) -> Material:
    """The material without its diffuse terms."""
    return material.model_copy(update={"kd": BLACK, "kt_d": BLACK})
