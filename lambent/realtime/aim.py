"""Table of a probe's lamps: shaders/aim.wgsl draws directions from it for the progressive mode.

Lamps are all texels brighter than the mean over all directions. Samples of the lobe find darker light at least as well:
subtracting the mean gives the best density beside a second technique (Karlik et al. 2019, "MIS compensation"). The
density is constant over a texel in the coordinates of its face, so the texel's solid angle enters exactly.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.cubemap import texel_solid_angles
from lambent.materials.document import Material
from lambent.realtime.cube_mips import blurred, overlaps

LEVELS = 6  # most levels: 64 texels along a face
HEAD_ROWS = 3
INTERPOLATED = (1 / 8, 6 / 8, 1 / 8)  # mean of bilinear look-ups over a texel


def lamp_probabilities(cube: Floats) -> tuple[Floats, float]:
    """Probabilities (6, m, m) of a cube map's texels, and the variance of its light due to lamps.

    Parameters
    ----------
    cube : (6, N, N, 3) radiance, finite and not negative

    Returns
    -------
    probabilities : (6, m, m) float64, sum 1; m is a power of two, at least 2, at most N or 64
    variance : relative to the squared mean, 4 pi C^2/omega for lamps that give the share C of all light from omega sr:
        20 to 100 in rooms and at night, .2 under a sky without a sun. Uniform light has variance 0 and even
        probabilities.
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
    """Gain from aiming, 0 to 1, of lamps with this variance: 0 up to a variance of 1, 1 from a variance of 4 on."""
    return float(np.clip(np.log2(max(variance, 1e-9)) / 2, 0, 1))


def aimed_share(roughness: float, prominent: float) -> float:
    """Share of a lobe's samples that aim, 0 to 12/16, before rounding (wanted_sixteenths of aim.wgsl).

    `roughness` is sqrt(mx my), `prominent` the lamps' `prominence`. With a roughness of .1 and a prominence of 1, half
    of the samples aim; each doubling of the roughness adds 2.5/16. Found by experiment (docs/decisions.md).
    """
    return float(np.clip(prominent * (8 + 2.5 * np.log2(roughness / 0.1)), 0, 12)) / 16


def widest_lobe(material: Material, textured: bool) -> float:
    """The largest sqrt(mx my) of a material's lobes; 1 where textures change them."""
    return 1.0 if textured else max((float(np.sqrt(lobe.mx * lobe.my)) for lobe in material.lobes), default=1e-3)


def aim_table(cube: Floats) -> NDArray[np.float32]:
    """Table (rows, 4) of a cube map (6, N, N, 3): the head, then probabilities of quarters by level (see aim.wgsl)."""
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
    """(6 m m/4, 4) of (6, m, m): each row holds the upper left, upper right, lower left and lower right texel."""
    bits = level.shape[1].bit_length() - 1
    split = level.reshape(6, *[2] * (2 * bits))
    order = [0] + [axis for bit in range(bits) for axis in (1 + bit, 1 + bits + bit)]
    return split.transpose(order).reshape(-1, 4)
