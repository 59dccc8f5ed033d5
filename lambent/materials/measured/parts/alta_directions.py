"""ALTA's parametrisations (params.h): conversion of their columns to directions of light (wi) and view (wo).

Written from the definitions: H is the half vector of view V and light L, K that of V and the mirrored light. If a
parametrisation drops an azimuth, the other columns suffice for an isotropic BRDF, up to mirroring and reciprocity.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import direction, reflect

Pair = tuple[Floats, Floats]


@dataclass(frozen=True)
class Parametrisation:
    """One of ALTA's parametrisations.

    Attributes
    ----------
    inputs : int
        Number of columns.
    directions : function
        (N, columns) -> wi, wo (N, 3); NaN, or below the horizon, where a row is no pair of directions.
    isotropic : bool
        Whether the azimuth of the light is dropped.
    gridded : bool
        Whether the light's direction has columns of its own, so that incident directions can form a grid.
    bivariate : bool
        Whether the azimuth between the vectors is dropped as well; `directions` takes it as a further column.
    notes : tuple of str
    """

    inputs: int
    directions: Callable[[Floats], Pair]
    isotropic: bool = True
    gridded: bool = False
    bivariate: bool = False
    notes: tuple[str, ...] = ()


def _half_difference(theta_h: Floats, phi_h: Floats, theta_d: Floats, phi_d: Floats) -> Pair:
    """Rusinkiewicz's angles; V is the difference vector, turned by theta_h about y and by phi_h about n."""
    d = direction(theta_d, phi_d)
    c, s = np.cos(theta_h), np.sin(theta_h)
    x, z = c * d[:, 0] + s * d[:, 2], c * d[:, 2] - s * d[:, 0]
    c, s = np.cos(phi_h), np.sin(phi_h)
    view = np.stack([c * x - s * d[:, 1], s * x + c * d[:, 1], z], axis=-1)
    return reflect(view, direction(theta_h, phi_h)), view


def _polar(x: Floats, y: Floats) -> Pair:
    """theta and phi of theta (cos phi, sin phi)."""
    return np.hypot(x, y), np.arctan2(y, x)


def _back(p: Floats) -> Pair:
    """Light, and K in polar form: V is the mirrored light, mirrored about K."""
    light, back = direction(p[:, 0], 0.0), direction(*_polar(p[:, 1], p[:, 2]))
    return light, reflect(light * (-1, -1, 1), back)


def _retro(p: Floats) -> Pair:
    """Light, and V in polar form about it, from the side of the normal."""
    light, from_light, phi = direction(p[:, 0], 0.0), *_polar(p[:, 1], p[:, 2])
    up = np.stack([-np.cos(p[:, 0]), np.zeros(len(p)), np.sin(p[:, 0])], axis=-1)
    aside = np.cos(phi)[:, None] * up + np.sin(phi)[:, None] * np.array([0.0, 1.0, 0.0])
    return light, np.cos(from_light)[:, None] * light + np.sin(from_light)[:, None] * aside


def _halved(h_xy: Floats, b_xy: Floats) -> Pair:
    """Light and view whose half sum and half difference have these projections (Neumann & Neumann)."""
    with np.errstate(invalid="ignore"):
        lit, seen = (np.column_stack([w, np.sqrt(1 - (w**2).sum(axis=1))]) for w in (h_xy + b_xy, h_xy - b_xy))
    return lit, seen


def _stark(h: Floats, b: Floats, phi: Floats) -> Pair:
    """Light and view from |H_p| and |B| of their half sum and half difference, which are perpendicular."""
    with np.errstate(invalid="ignore"):
        z = np.sqrt(1 - h**2 - b**2)
    half = np.stack([h, np.zeros_like(h), z], axis=-1)
    tilt = np.arctan2(z, -h * np.cos(phi))  # elevation from n at which H.B = 0
    difference = b[:, None] * direction(tilt, phi)
    return half + difference, half - difference


def _stereographic(xy: Floats) -> Floats:
    """Directions (N, 3) of their projections x / (1 + z), y / (1 + z)."""
    square = (xy**2).sum(axis=1, keepdims=True)
    return np.asarray(np.concatenate([2 * xy, 1 - square], axis=1) / (1 + square))


def _unit(w: Floats) -> Floats:
    """Vectors (N, 3) at unit length; NaN for a zero vector in the file."""
    length = np.linalg.norm(w, axis=1, keepdims=True)
    return np.where(np.abs(length - 1) < 0.01, w / np.where(length > 0, length, 1), np.nan)


def _acos(x: Floats) -> Floats:
    with np.errstate(invalid="ignore"):
        return np.arccos(np.where(np.abs(x) <= 1 + 1e-6, x.clip(-1, 1), np.nan))


def _xy(r: Floats, phi: Floats) -> Floats:
    return np.stack([r * np.cos(phi), r * np.sin(phi)], axis=-1)


def _rusinkiewicz(p: Floats) -> Pair:
    return _half_difference(p[:, 0], np.zeros(len(p)), p[:, 1], p[:, 2])


def _cosines(p: Floats) -> Pair:
    return _rusinkiewicz(np.stack([_acos(p[:, 0]), _acos(p[:, 1]), p[:, 2]], axis=-1))


def _neumann(p: Floats) -> Pair:
    return _halved(_xy(p[:, 0], np.zeros(len(p))), _xy(p[:, 1], p[:, 2]))


AZIMUTHS = np.radians((0.0, 30.0, 60.0, 90.0))  # copies of tables without an azimuth; the rest mirrors them
_LIGHT_UP = ("the light is along the normal alone",)

PARAMETRISATIONS: dict[str, Parametrisation] = {
    "RUSIN_TH_TD_PD": Parametrisation(3, _rusinkiewicz),
    "RUSIN_TH_PH_TD_PD": Parametrisation(4, lambda p: _half_difference(*p.T), isotropic=False),
    "RUSIN_TH_TD": Parametrisation(2, _rusinkiewicz, bivariate=True),
    "COS_TH_TD": Parametrisation(2, _cosines, bivariate=True),
    "STARK_3D": Parametrisation(3, lambda p: _stark(*p.T)),
    "STARK_2D": Parametrisation(2, lambda p: _stark(*p.T), bivariate=True),
    "NEUMANN_3D": Parametrisation(3, _neumann),
    "NEUMANN_2D": Parametrisation(2, _neumann, bivariate=True),
    "ISOTROPIC_TV_TL_DPHI": Parametrisation(
        3, lambda p: (direction(p[:, 1], p[:, 2]), direction(p[:, 0], 0.0)), gridded=True
    ),
    "ISOTROPIC_TL_TV_PROJ_DPHI": Parametrisation(
        3, lambda p: (direction(p[:, 0], 0.0), direction(*_polar(p[:, 1], p[:, 2]))), gridded=True
    ),
    "ISOTROPIC_TV_PROJ_DPHI": Parametrisation(
        2, lambda p: (direction(0 * p[:, 0], 0.0), direction(*_polar(*p.T))), gridded=True, notes=_LIGHT_UP
    ),
    "SCHLICK_TL_TK_PROJ_DPHI": Parametrisation(3, _back, gridded=True),
    "RETRO_TL_TVL_PROJ_DPHI": Parametrisation(3, _retro, gridded=True),
    "SPHERICAL_TL_PL_TV_PV": Parametrisation(
        4, lambda p: (direction(p[:, 0], p[:, 1]), direction(p[:, 2], p[:, 3])), isotropic=False, gridded=True
    ),
    "STEREOGRAPHIC": Parametrisation(
        4, lambda p: (_stereographic(p[:, 2:]), _stereographic(p[:, :2])), isotropic=False, gridded=True
    ),
    "CARTESIAN": Parametrisation(6, lambda p: (_unit(p[:, 3:]), _unit(p[:, :3])), isotropic=False, gridded=True),
}
SLICES: dict[str, str] = {
    "COS_TH": "values over the cosine between n and the half vector alone",
    "COS_TK": "values over the cosine between n and the back vector alone",
    "COS_TLV": "values over the cosine between light and view alone",
    "COS_TLR": "values over the cosine between light and mirrored view alone",
    "RUSIN_VH": "values over the half vector alone",
    "SCHLICK_VH": "values over the back vector alone",
    "SCHLICK_VK": "values over the back vector alone",
}
