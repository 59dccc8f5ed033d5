"""Environments as cube maps (6, n, n, 3) of linear radiance, computed or read from lat-long images.

They light scenes without a bake: the benches' shapes and the preview of the material editor. The daylight is Preetham,
Shirley & Smits 1999, "A practical analytic model for daylight"; bakes use Mitsuba's sky instead.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import face_directions, texel_solid_angles
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.latlong import lat_long_uv
from lambent.core.light.colour import xyz_to_rgb
from lambent.core.light.photometry import LM_PER_W


def studio(n: int = 256) -> Floats:
    """Environment (6, n, n, 3): dim ceiling and floor, one large, one small and one coloured area light."""
    w = normalize(face_directions(n))
    light = 0.08 + 0.12 * np.clip(w[..., 1:2], 0, 1) * np.array([0.7, 0.85, 1.0])
    light = light + 0.05 * (w[..., 1:2] < -0.2) * np.array([1.0, 0.8, 0.6])
    for towards, wide, high, radiance in (
        ((-0.6, 0.5, 0.7), 0.25, 0.4, (6, 6, 6)),
        ((0.8, 0.3, 0.5), 0.06, 0.06, (60, 52, 40)),
        ((0.2, -0.1, -1.0), 0.9, 0.1, (1.0, 2.0, 4.0)),
    ):
        axis = normalize(np.array(towards, float))
        right = normalize(np.cross(axis, [0, 1, 0]))
        up = np.cross(right, axis)
        front = np.maximum(w @ axis, 1e-6)
        inside = (w @ axis > 0) & (np.abs(w @ right) < wide * front) & (np.abs(w @ up) < high * front)
        light = np.where(inside[..., None], np.array(radiance, float), light)
    return np.asarray(light, np.float32)


def night(n: int = 256) -> Floats:
    """Environment (6, n, n, 3): a row of small bright lamps in the dark, the hardest case for few samples."""
    w = normalize(face_directions(n))
    light = 0.02 + 0.03 * (w[..., 1:2] < 0) * np.array([1.0, 1.0, 1.0])
    for k in range(9):
        phi, height = 2 * np.pi * k / 9, 0.25 + 0.2 * np.sin(5.0 * k)
        axis = normalize(np.array([np.cos(phi), height, np.sin(phi)]))
        colour = 0.5 + 0.5 * np.cos(k + np.array([0.0, 2.0, 4.0]))
        light = np.where((w @ axis > np.cos(0.05))[..., None], 80 * colour, light)
    return np.asarray(light, np.float32)


def dusk(n: int = 256) -> Floats:
    """Environment (6, n, n, 3): a smooth sky over a checkered floor, no lamps."""
    w = normalize(face_directions(n))
    height = w[..., 1:2]
    sky = np.exp(-3 * np.clip(height, 0, 1)) * np.array([1.2, 0.6, 0.3]) + np.array([0.1, 0.15, 0.35])
    down = np.maximum(-height, 1e-3)
    squares = np.sign(np.sin(3 * w[..., :1] / down) * np.sin(3 * w[..., 2:] / down)) * np.clip(4 * down, 0, 1)
    return np.asarray(np.where(height > 0, sky, 0.25 + 0.15 * squares), np.float32)


# Perez coefficients A..E and the zenith's chromaticity (Preetham et al. 1999, appendix A.2), in turbidity T.
_PEREZ: dict[str, tuple[tuple[float, float], ...]] = {
    "Y": ((0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771), (-0.0670, 0.3703)),
    "x": ((-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989), (-0.0033, 0.0452)),
    "y": ((-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537), (-0.0109, 0.0529)),
}
_ZENITH = {
    "x": (
        (0.00166, -0.00375, 0.00209, 0.0),
        (-0.02903, 0.06377, -0.03202, 0.00394),
        (0.11693, -0.21196, 0.06052, 0.25886),
    ),
    "y": (
        (0.00275, -0.00610, 0.00317, 0.0),
        (-0.04214, 0.08970, -0.04153, 0.00516),
        (0.15346, -0.26756, 0.06670, 0.26688),
    ),
}
_SUN_KLUX, _SUN_RADIUS_RAD = 100.0, np.radians(1.0)  # the sun is drawn larger, with the same light


def daylight(
    n: int = 256, sun_direction: tuple[float, float, float] = (0.45, 0.62, 0.64), turbidity: float = 3.0
) -> Floats:
    """Environment (6, n, n, 3): clear sky with its sun over a grey ground of albedo 0.3, W/(sr m^2)."""
    w = normalize(face_directions(n))
    sun = normalize(np.array(sun_direction, float))
    theta_s = float(np.arccos(sun[1]))
    cos_theta = np.maximum(w[..., 1], 0.02)
    cos_gamma = np.clip(w @ sun, -1, 1)
    chi = (4 / 9 - turbidity / 120) * (np.pi - 2 * theta_s)
    zenith = {"Y": (4.0453 * turbidity - 4.9710) * np.tan(chi) - 0.2155 * turbidity + 2.4192}
    powers = theta_s ** np.array([3, 2, 1, 0])
    for name, rows in _ZENITH.items():
        zenith[name] = float(np.array([turbidity**2, turbidity, 1]) @ (np.array(rows) @ powers))
    sky = {}
    for name, lines in _PEREZ.items():
        shape = [slope * turbidity + start for slope, start in lines]
        at_zenith = _perez(shape, np.array(1.0), np.array(np.cos(theta_s)))
        sky[name] = zenith[name] * _perez(shape, cos_theta, cos_gamma) / at_zenith
    y = np.maximum(sky["Y"], 0)
    xyz = np.stack([sky["x"] * y / sky["y"], y, (1 - sky["x"] - sky["y"]) * y / sky["y"]], axis=-1)
    light = np.maximum(xyz_to_rgb(xyz), 0)
    lamp = _SUN_KLUX / (2 * np.pi * (1 - np.cos(_SUN_RADIUS_RAD))) * np.array([1.0, 0.93, 0.83])
    light = np.where((cos_gamma > np.cos(_SUN_RADIUS_RAD))[..., None], light + lamp, light)
    up = w[..., 1:2] > 0
    seen = light[np.broadcast_to(up, light.shape)].reshape(-1, 3)
    omega = np.broadcast_to(texel_solid_angles(n), w.shape[:3])[up[..., 0]]
    ground = 0.3 / np.pi * (seen * (omega * w[..., 1][up[..., 0]])[:, None]).sum(axis=0)
    return np.asarray(np.where(up, light, ground) * 1000 / LM_PER_W, np.float32)


def _perez(shape: Sequence[float], cos_theta: Floats, cos_gamma: Floats) -> Floats:
    """Perez's distribution (eq. 3): theta from the zenith, gamma from the sun."""
    a, b, c, d, e = shape
    near_sun = 1 + c * np.exp(d * np.arccos(cos_gamma)) + e * cos_gamma**2
    return np.asarray((1 + a * np.exp(b / cos_theta)) * near_sun)


def from_lat_long(image: Floats, n: int = 256) -> Floats:
    """Environment (6, n, n, 3) of a lat-long image (H, W, 3), see `core.geometry.latlong`; means over 3x3 samples."""
    height, width = image.shape[:2]
    total = np.zeros((6, n, n, 3))
    fine = face_directions(3 * n).reshape(6, n, 3, n, 3, 3)
    for i in range(3):
        for j in range(3):
            w = normalize(fine[:, :, i, :, j])
            column, row = lat_long_uv(w)
            at_row = np.clip((row * height).astype(int), 0, height - 1)
            total += image[at_row, (column * width).astype(int) % width]
    return (total / 9).astype(np.float32)
