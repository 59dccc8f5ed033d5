"""Light through thin pieces of glass, refracted on entry and on exit.

Thesis R, "Thin Lens Refractions", looks light up along the refracted direction. Here both faces refract; the second is
approximated by a plane (`light_field.Glass`): by the one behind the surface along its normal, it is found where the ray
leaves about, and the plane behind that place is taken. A pane then displaces light and keeps its direction, a lens
bends it, and a thick body is approximate. Light mirrored by inner faces comes from the surface's
own mirror direction, as if all faces were parallel: clear glass in even light is then as bright as its background.
Directions are unit, of rays from the viewer onwards. The shader is realtime/shading/thin_glass.wgsl.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.core.arrays import Floats

MOST_R0 = 0.9  # largest r0 from which an index of refraction is derived
SAME_FACE = 0.7  # least cosine between normals of one face at neighbouring places
LEAST_COSINE = 0.1  # to the second face: at grazing rays the exit would be too far away


def eta_of(r0: float) -> float:
    """Index of refraction that reflects r0 at normal incidence (Fresnel)."""
    root = float(np.sqrt(np.clip(r0, 0.0, MOST_R0)))
    return (1 + root) / (1 - root)


def normal_transmittance(lobe: Any) -> Floats:
    """(3,) transmittance at normal incidence of an interface with this transmission lobe."""
    return np.asarray(np.asarray(lobe.k, float) * (1 - np.asarray(lobe.r0, float)))


def mirrored_back(cosine: Floats, share: Floats, eta: float, tint: tuple[float, float, float]) -> Floats:
    """Share (k,) of the light within the glass that its second face and further faces mirror instead of passing.

    Parameters
    ----------
    cosine, share : (k,) as from `through_glass`.
    eta : index of refraction, inside over outside.
    tint : transmittance of an interface at normal incidence: 1 - r0 (Fresnel), less for coloured glass.
    """
    passes = 1 - ((eta - 1) / (eta + 1)) ** 2
    colourless = np.log(passes) / min(float(np.log(max(float(np.mean(np.asarray(tint))), 1e-6))), -1e-6)  # of each face
    under_fresnel = 1 - (1 - np.minimum(cosine, 1)) ** 5
    return np.asarray(1 - passes * under_fresnel * np.maximum(share, 1e-6) ** min(colourless, 1.0))


def refracted(w: Floats, n: Floats, ratio: float) -> tuple[Floats, Floats]:
    """Refract rays w (k, 3) at faces whose normals n (k, 3) oppose them; returns rays and flags (k,): refracted.

    The others are mirrored. `ratio` is the index of refraction on the incoming side over that on the outgoing side.
    """
    cosine = -np.sum(w * n, axis=-1, keepdims=True)
    square = 1 - ratio**2 * (1 - cosine**2)
    through = ratio * w + (ratio * cosine - np.sqrt(np.maximum(square, 0))) * n
    passes = square[..., 0] >= 0
    return np.where(passes[..., None], through, w + 2 * cosine * n), passes


def sideways(offset: Floats, n: Floats) -> Floats:
    """Offsets (k, 3) along surfaces of normals n (k, 3): from a place to the one above a ray's exit."""
    return np.asarray(offset - np.sum(offset * n, axis=-1, keepdims=True) * n)


def exits_beside(exits: Floats, beside: Floats, step: Floats, n: Floats) -> Floats:
    """The face behind another place of the surface, as exits (k, 4) of the first place.

    Parameters
    ----------
    exits, beside : (k, 4) as in `light_field.Glass`, of the place and of the other one.
    step : (k, 3) from the place to the other one, across the normal.
    n : (k, 3) normals of the place, towards the viewer.

    Exits that do not continue the face (sheets, or normals more than acos(SAME_FACE) apart, as beyond an edge) are
    left as they are.
    """
    share, other = (np.maximum(np.linalg.norm(of[:, :3], axis=-1), 1e-6) for of in (exits, beside))
    along = np.sum(n * beside[:, :3], axis=-1)
    same = np.sum(exits[:, :3] * beside[:, :3], axis=-1) > SAME_FACE * share * other
    same &= (exits[:, 3] >= 0) & (beside[:, 3] >= 0) & (along < 0)
    depth = beside[:, 3] - np.sum(step * beside[:, :3], axis=-1) / np.where(along < 0, along, -1.0)
    return np.where(same[:, None], np.column_stack([beside[:, :3], np.maximum(depth, 0)]), exits)


def through_glass(w: Floats, n: Floats, exits: Floats, eta: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Trace rays w (k, 3) through a surface of normals n (k, 3) and the face behind it.

    Parameters
    ----------
    exits : (k, 4) as in `light_field.Glass`.
    eta : index of refraction, inside over outside.

    Returns
    -------
    offset (k, 3) from the surface to the exit from the glass, direction (k, 3) there, cosine (k,) to the second face's
    normal outside, and transmittance (k,) of further faces.
    """
    is_sheet = exits[:, 3] < 0
    share = np.where(is_sheet, 1.0, np.linalg.norm(exits[:, :3], axis=-1))
    out = np.where(is_sheet[:, None], -n, exits[:, :3] / np.maximum(share, 1e-6)[:, None])
    inside, _ = refracted(w, n, 1 / eta)
    towards = np.maximum(np.sum(inside * out, axis=-1), LEAST_COSINE)
    length = np.maximum(-exits[:, 3] * np.sum(n * out, axis=-1) / towards, 0)
    leaving, _ = refracted(inside, -out, eta)
    cosine = np.abs(np.sum(leaving * out, axis=-1))
    sheet = is_sheet[:, None]
    offset = np.where(sheet, 0.0, length[:, None] * inside)
    return offset, np.where(sheet, w, leaving), np.where(is_sheet, 1.0, cosine), share
