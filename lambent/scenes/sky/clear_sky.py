"""Illuminance of clear daylight by published models, to which daylight is calibrated.

Turbidity is the number of clean, dry atmospheres with the same extinction of sunlight: of all energy (Linke's), or of
visible light. Models of the two kinds differ by up to half at low sun; the result is their geometric mean.

    sun   ESRA's beam (Rigollier, Bauer & Wald 2000) by Perez's efficacy; and Kittler's luminous turbidity with the
          extinction of Clear (1982), 133.8 klx outside the atmosphere
    sky   ESRA's diffuse by Perez's efficacy; and the CIE clear sky (1973) with the zenith of Karayel, Navvab, Ne'eman &
          Selkowitz (1984), which is valid from turbidity 2 on

`docs/scenes.md` compares the results with each. Efficacies are those of Perez et al. (1990), for 2 cm of water.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats
from lambent.scenes.scene import SunSky

SOLAR_W_M2, SOLAR_LX = 1367.0, 133_800.0
WATER_CM = 2.0
_CLEARNESS = (1.065, 1.23, 1.5, 1.95, 2.8, 4.5, 6.2)  # edges of Perez's eight bins
_BEAM = np.array(
    [
        (57.20, -4.55, -2.98, 117.12), (98.99, -3.46, -1.21, 12.38), (109.83, -4.90, -1.71, -8.81),
        (110.34, -5.84, -1.99, -4.56), (106.36, -3.97, -1.75, -6.16), (107.19, -1.25, -1.51, -26.73),
        (105.75, 0.77, -1.26, -34.44), (101.18, 1.58, -1.10, -8.29),
    ]
)  # fmt: skip
_DIFFUSE = np.array(
    [
        (97.24, -0.46, 12.00, -8.91), (107.22, 1.15, 0.59, -3.95), (104.97, 2.96, -5.53, -8.77),
        (102.39, 5.59, -13.95, -13.90), (100.71, 5.94, -22.75, -23.74), (106.42, 3.83, -36.15, -28.83),
        (141.88, 1.90, -53.24, -14.03), (152.23, 0.35, -45.27, -7.98),
    ]
)  # fmt: skip
_ZENITH_FROM, _ZENITH_UP_TO_DEG = 2.0, 70.0  # turbidity and elevation for which Karayel's zenith is valid


def sun_illuminance(height_deg: float, turbidity: float) -> float:
    """Illuminance, lx, by the sun alone on a surface that faces it; `height_deg` from 0 to 90."""
    beam_w_m2, diffuse_w_m2 = esra(height_deg, turbidity)
    linke_lx = beam_w_m2 * efficacies(height_deg, beam_w_m2, diffuse_w_m2)[0]
    return float(np.sqrt(linke_lx * kittler_sun(height_deg, turbidity)))


def sky_illuminance(height_deg: float, turbidity: float) -> float:
    """Illuminance, lx, by the sky without the sun on level ground."""
    beam_w_m2, diffuse_w_m2 = esra(height_deg, turbidity)
    esra_lx = diffuse_w_m2 * efficacies(height_deg, beam_w_m2, diffuse_w_m2)[1]
    within = min(height_deg, _ZENITH_UP_TO_DEG), max(turbidity, _ZENITH_FROM)
    return float(np.sqrt(esra_lx * cie_clear_sky(*within)))


def daylight_in_words(sky: SunSky) -> str:
    """One line on daylight: its sun, its illuminances, and the ground below the horizon."""
    height_deg = float(np.degrees(np.arcsin(np.clip(sky.sun_direction[1], 0, 1))))
    sun_klx = sky.sun_scale * sun_illuminance(height_deg, sky.turbidity) / 1000
    sky_klx = sky.sky_scale * sky_illuminance(height_deg, sky.turbidity) / 1000
    ground = "nothing" if sky.ground == "black" else f"a diffuse ground of albedo {sky.albedo:g}"
    return (
        f"sun {height_deg:.0f} degrees high, {sun_klx:.1f} klx facing it; sky {sky_klx:.1f} klx, turbidity "
        f"{sky.turbidity:g}; below the horizon {ground}"
    )


def air_mass(height_deg: float) -> float:
    """Relative optical air mass (Kasten & Young 1989)."""
    return float(1 / (np.sin(np.radians(height_deg)) + 0.50572 * (height_deg + 6.07995) ** -1.6364))


def esra(height_deg: float, turbidity: float) -> tuple[float, float]:
    """Irradiance, W/m^2, by the beam on a surface that faces it, and by the sky on level ground; Linke's turbidity."""
    m, sine = air_mass(height_deg), np.sin(np.radians(height_deg))
    rayleigh = 10.4 + 0.718 * m if m > 20 else np.polyval((-0.00013, 0.0065, -0.1202, 1.7513, 6.6296), m)  # 1/delta
    beam = SOLAR_W_M2 * np.exp(-0.8662 * turbidity * m / rayleigh)
    through = np.polyval((3.797e-4, 3.0543e-2, -1.5843e-2), turbidity)
    a0 = max(np.polyval((0.0031408, -0.061581, 0.26463), turbidity), 0.002 / through)
    a1 = np.polyval((-0.011161, 0.018945, 2.0402), turbidity)
    a2 = np.polyval((0.0085079, 0.039231, -1.3025), turbidity)
    return float(beam), float(SOLAR_W_M2 * through * (a0 + a1 * sine + a2 * sine**2))


def kittler_sun(height_deg: float, turbidity: float) -> float:
    """Illuminance, lx, by the sun alone on a surface that faces it; luminous turbidity."""
    m = air_mass(height_deg)
    return float(SOLAR_LX * np.exp(-m * turbidity / (9.9 + 0.043 * m)))


def cie_clear_sky(height_deg: float, turbidity: float) -> float:
    """Illuminance, lx, by the CIE standard clear sky (1973) with Karayel's zenith on level ground."""
    height = np.radians(height_deg)
    zenith_kcd_m2 = (1.376 * turbidity - 1.81) * np.tan(height) + 0.38
    y = (np.arange(4096) + 0.5) / 4096  # a spiral of equal solid angles over the sky
    around = np.pi * (1 + 5**0.5) * np.arange(4096)
    cos_gamma = np.sin(height) * y + np.cos(height) * np.sqrt(1 - y**2) * np.cos(around)
    shape = (1 - np.exp(-0.32 / y)) / (1 - np.exp(-0.32))
    relative = shape * _cie_indicatrix(cos_gamma) / _cie_indicatrix(np.sin(height))
    return float(1000 * zenith_kcd_m2 * 2 * np.pi * np.mean(relative * y))


def _cie_indicatrix(cos_gamma: Floats) -> Floats:
    return np.asarray(0.91 + 10 * np.exp(-3 * np.arccos(np.clip(cos_gamma, -1, 1))) + 0.45 * cos_gamma**2)


def efficacies(height_deg: float, beam_w_m2: float, diffuse_w_m2: float) -> tuple[float, float]:
    """Luminous efficacies, lm/W, of the beam and of the sky (Perez et al. 1990, table 4)."""
    zenith = np.radians(90 - height_deg)
    diffuse = max(diffuse_w_m2, 1e-6)
    clearness = ((diffuse + beam_w_m2) / diffuse + 1.041 * zenith**3) / (1 + 1.041 * zenith**3)
    brightness = float(np.clip(diffuse * air_mass(height_deg) / SOLAR_W_M2, 0.01, 0.6))
    found = int(np.searchsorted(_CLEARNESS, clearness))
    beam = _BEAM[found] @ (1, WATER_CM, np.exp(5.73 * zenith - 5), brightness)
    sky = _DIFFUSE[found] @ (1, WATER_CM, np.cos(zenith), np.log(brightness))
    return max(float(beam), 0.0), max(float(sky), 0.0)
