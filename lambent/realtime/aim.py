"""The table of a probe's lamps that the progressive mode aims samples by; shaders/aim.wgsl draws directions from it.

Lamps are all texels brighter than the mean of all directions. Samples of the lobe find the rest at least as well: this
is the best density beside another technique (Karlik et al. 2019, "MIS compensation"). Over a texel the density is
constant in the face's own coordinates, so its solid angle enters exactly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.cubemap import texel_solid_angles
from lambent.materials.document import Material
from lambent.realtime.cube_mips import blurred, overlaps

LEVELS = 6  # at most: 64 texels along a face
HEAD_ROWS = 3
INTERPOLATED = (1 / 8, 6 / 8, 1 / 8)  # mean over a texel of what bilinear look-ups show there


def lamp_probabilities(cube: Floats) -> tuple[Floats, float]:
    """Probabilities (6, m, m) of a cube map's texels, and the variance of its light that comes from lamps.

    Parameters
    ----------
    cube : (6, N, N, 3) radiance, finite and not negative

    Returns
    -------
    probabilities : (6, m, m) float64, sum 1; m is a power of two, at least 2, at most N or 64
    variance : 4 pi C^2/omega, relative to the squared mean, of lamps that hold the share C of all light and fill omega
        sr: 20 to 100 in rooms and at night, .2 under a sky without a sun; 0, and even probabilities, of uniform light
    """
    n = cube.shape[1]
    m = 1 << min(LEVELS, max(1, n.bit_length() - 1))
    omega = texel_solid_angles(n)
    light = blurred(cube.mean(axis=-1, keepdims=True), INTERPOLATED)[..., 0] * omega
    share = overlaps(n, m)
    coarse = share @ light @ share.T
    solid = share @ omega @ share.T
    total = coarse.sum()
    lamps = np.maximum(coarse - solid * (total / (4 * np.pi)), 0)
    if lamps.sum() <= 1e-6 * total:
        return np.broadcast_to(solid / (4 * np.pi), coarse.shape), 0.0
    return lamps / lamps.sum(), float(4 * np.pi * (lamps**2 / solid).sum() / total**2)


def prominence(variance: float) -> float:
    """How much aiming pays, 0 to 1: not at all up to a variance of 1, as much as the lobe allows from 4 on."""
    return float(np.clip(np.log2(max(variance, 1e-9)) / 2, 0, 1))


def aimed_share(roughness: float, prominent: float) -> float:
    """Share of a lobe's samples that aim, before rounding (wanted_sixteenths of aim.wgsl): 0 to 12/16.

    `roughness` is sqrt(mx my). At .1 and a `prominent` of 1 half of the samples aim, 2.5/16 more for each doubling of
    the roughness; by experiment (docs/decisions.md).
    """
    return float(np.clip(prominent * (8 + 2.5 * np.log2(roughness / 0.1)), 0, 12)) / 16


def widest_lobe(material: Material, textured: bool) -> float:
    """The largest sqrt(mx my) of a material's lobes; 1 where textures change them."""
    return 1.0 if textured else max((float(np.sqrt(lobe.mx * lobe.my)) for lobe in material.lobes), default=1e-3)


def aim_table(cube: Floats) -> NDArray[np.float32]:
    """(rows, 4): the head, then the probabilities of the quarters of every quarter, level by level (see aim.wgsl)."""
    probabilities, variance = lamp_probabilities(cube)
    levels = probabilities.shape[1].bit_length() - 1
    pyramid = [probabilities]
    while pyramid[-1].shape[1] > 1:
        m = pyramid[-1].shape[1] // 2
        pyramid.append(pyramid[-1].reshape(6, m, 2, m, 2).sum(axis=(2, 4)))
    head = np.zeros((HEAD_ROWS, 4))
    head[0, :2] = levels, prominence(variance)
    head[1:].flat[:6] = pyramid[-1].ravel()
    return np.concatenate([head, *(_in_morton_order(level) for level in pyramid[-2::-1])]).astype(np.float32)


def _in_morton_order(level: Floats) -> Floats:
    """(6 m m/4, 4) of (6, m, m): a row's four are left above, right above, left below, right below."""
    bits = level.shape[1].bit_length() - 1
    split = level.reshape(6, *[2] * (2 * bits))
    order = [0] + [axis for bit in range(bits) for axis in (1 + bit, 1 + bits + bit)]
    return split.transpose(order).reshape(-1, 4)
