"""A lobe lit by one small lamp, in closed form; lamp_light.wgsl is the shader version, tested for parity.

A lamp is a mean direction w and two vectors a, b, the principal deviations of its directions. f cos_i is a smooth
factor g times the density P = D h_z^4 of slopes s = (h_x, h_y)/h_z. With H = w + o not normalised,
    s = H_xy/H_z,  J a = (a_xy - s a_z)/H_z,  g = tint |H|^3/(2 H_z^4) cos_i^(1 - alpha)/cos_o^alpha.
A Gaussian P of the matrix diag(mx^2, my^2), averaged over a Gaussian lamp, is a Gaussian of the matrix
    M = diag(mx^2, my^2) + 2 sum (J a)(J a)^T:
the lobe is widened and keeps its integral. GGX has no variance; widening it `GGX_WIDER` times as much is closest. If
log g changes by q_a and q_b along a and b, completing the square gives the mean of g P: its value at w with
s + q_a J a + q_b J b, times exp((q_a^2 + q_b^2)/2). For a lamp that sets, the part above the horizon counts.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats
from lambent.materials.document import Lobe
from lambent.materials.lobes import fresnel

GGX_WIDER = 1.7
HORIZON = 1.2  # multiple of the summed heights of both vectors: reach of a lamp above and below its centre
COS_MIN, REACH_MIN = 1e-3, 1e-5


def lamp_response(lobe: Lobe, wo: Floats, w: Floats, axes: Floats) -> Floats:
    """Mean (..., 3) of f |cos_i| over a lamp, 1/sr, of one lobe with its colour.

    Parameters
    ----------
    wo : (..., 3) unit directions to the viewer, on the upper side
    w : (..., 3) unit mean directions to the lamp
    axes : (..., 2, 3) deviations of the lamp's directions, radians, perpendicular to w
    """
    turned = np.array([-1.0, -1.0, 1.0]) if lobe.retro else np.ones(3)
    turned = turned * ([1, 1, -1] if lobe.side == "transmission" else 1)
    wi, axes = w * turned, axes * turned
    reach = HORIZON * np.abs(axes[..., 2]).sum(axis=-1) + REACH_MIN
    up = np.clip((wi[..., 2] + reach) / (2 * reach), 0, 1)  # share above the horizon
    cos_i = np.maximum(np.where(wi[..., 2] < reach, (wi[..., 2] + reach) / 2, wi[..., 2]), COS_MIN)
    cos_o = np.maximum(wo[..., 2], COS_MIN)
    rise = axes[..., 2] * up[..., None]
    total = wi + wo
    total[..., 2] = cos_i + cos_o
    per_z = 1 / total[..., 2:]
    slope = total[..., :2] * per_z
    ja = (axes[..., :2] - slope[..., None, :] * rise[..., None]) * per_z[..., None]
    length2 = (total * total).sum(axis=-1)
    along = (axes[..., :2] * total[..., None, :2]).sum(axis=-1) + rise * total[..., 2:]
    tilt = 3 * along / length2[..., None] - rise * (4 * per_z - ((1 - lobe.alpha) / cos_i)[..., None])
    tilt = tilt.clip(-1, 1)  # beyond, g is not log-linear
    slope = slope + (tilt[..., None] * ja).sum(axis=-2)
    wider = 2 * (GGX_WIDER if lobe.distribution == "ggx" else 1.0)
    xx = lobe.mx**2 + wider * (ja[..., 0] ** 2).sum(axis=-1)
    yy = lobe.my**2 + wider * (ja[..., 1] ** 2).sum(axis=-1)
    xy = wider * (ja[..., 0] * ja[..., 1]).sum(axis=-1)
    det = xx * yy - xy * xy
    x, y = slope[..., 0], slope[..., 1]
    distance2 = (yy * x * x - 2 * xy * x * y + xx * y * y) / det
    shape = 1 / (1 + distance2) ** 2 if lobe.distribution == "ggx" else np.exp(-distance2)
    density = shape / (np.pi * np.sqrt(det)) * np.exp(0.5 * (tilt * tilt).sum(axis=-1))
    factor = up * length2**1.5 / (2 * total[..., 2] ** 4) * cos_i ** (1 - lobe.alpha) / cos_o**lobe.alpha
    f = fresnel(np.minimum(0.5 * np.sqrt(length2), 1)[..., None], np.asarray(lobe.r0))
    tint = np.asarray(lobe.k) * (1 - f if lobe.side == "transmission" else f)
    return np.asarray(tint * (density * factor)[..., None])
