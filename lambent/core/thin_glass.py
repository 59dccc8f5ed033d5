"""Light that passes a thin piece of glass: refracted where it enters and where it leaves.

Thesis R, "Thin Lens Refractions", looks light up along the refracted direction. Here both faces refract: the second is
taken for the plane that lies behind the first one along its normal (`light_field.Glass`). So a pane displaces light and
keeps its direction, a lens turns it, and a thick body is approximate. What faces mirror instead of passing comes from
where the surface itself mirrors, as if all were parallel: so clear glass in even light is not darker than what is
behind it. Directions are unit, of rays that go on from the viewer. The shader is realtime/shaders/thin_glass.wgsl.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.core.arrays import Floats

MOST_R0 = 0.9  # of which an index of refraction is derived
LEAST_COSINE = 0.1  # to the second face: rays along it would leave it far away


def eta_of(r0: float) -> float:
    """Index of refraction that reflects r0 at normal incidence (Fresnel)."""
    root = float(np.sqrt(np.clip(r0, 0.0, MOST_R0)))
    return (1 + root) / (1 - root)


def normal_transmittance(lobe: Any) -> Floats:
    """(3,) share of light that an interface with this lobe of transmission passes at normal incidence."""
    return np.asarray(np.asarray(lobe.k, float) * (1 - np.asarray(lobe.r0, float)))


def mirrored_back(cosine: Floats, share: Floats, eta: float, tint: tuple[float, float, float]) -> Floats:
    """Share (k,) of the light within the glass that its second face and those beyond mirror, and so do not pass.

    Parameters
    ----------
    cosine, share : (k,) as from `through_glass`.
    tint : what an interface lets pass at normal incidence: 1 - r0 (Fresnel), and less where glass is coloured.
    """
    passes = 1 - ((eta - 1) / (eta + 1)) ** 2
    colourless = np.log(passes) / min(
        float(np.log(max(float(np.mean(np.asarray(tint))), 1e-6))), -1e-6
    )  # of each face's share
    under_fresnel = 1 - (1 - np.minimum(cosine, 1)) ** 5
    return np.asarray(1 - passes * under_fresnel * np.maximum(share, 1e-6) ** min(colourless, 1.0))


def refracted(w: Floats, n: Floats, ratio: float) -> tuple[Floats, Floats]:
    """Rays w (k, 3) through a face of normals n (k, 3) against them, and which are (k,); others are mirrored.

    `ratio` is the index of refraction that they come from over that they go to.
    """
    cosine = -np.sum(w * n, axis=-1, keepdims=True)
    square = 1 - ratio**2 * (1 - cosine**2)
    through = ratio * w + (ratio * cosine - np.sqrt(np.maximum(square, 0))) * n
    passes = square[..., 0] >= 0
    return np.where(passes[..., None], through, w + 2 * cosine * n), passes


def through_glass(w: Floats, n: Floats, exits: Floats, eta: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Rays w (k, 3) that pass the surface of normals n (k, 3), and then what lies behind it.

    Parameters
    ----------
    exits : (k, 4) as in `light_field.Glass`.

    Returns
    -------
    offset (k, 3) from the surface to where they leave the glass, their direction (k, 3) there, the cosine (k,) to the
    second face's normal outside, and the share (k,) that further faces let pass.
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
