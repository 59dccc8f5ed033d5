"""Discomfort glare at an eye, from a picture: daylight glare probability and unified glare rating.

Angles refer to the view direction of a person who looks at the picture's centre, with the picture's up. Sources:

- DGP: J. Wienold, J. Christoffersen, "Evaluation methods and development of a new glare prediction model for daylight
  environments with the use of CCD cameras", Energy and Buildings 38 (2006), eq. 8. Radiance's evalglare 3 uses .092
  and .159 as its last two constants; the results differ by .001 at most.
- UGR: CIE 117 (1995).
- Position index: R. E. Levin, "Position index in VCP calculations", Journal of the IES 4 (1975), eq. 6, above the line
  of sight; below it the formula of evalglare after T. Iwata, M. Tokura (1997).
- Glare sources: evalglare 3's default rule. Pixels above 2000 cd/m2 are grouped if closer than .1 rad; peaks above
  50,000 cd/m2 are sources of their own.
"""

from __future__ import annotations

import colorsys
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lambent.core.arrays import Flags, Floats, components
from lambent.core.errors import UserError
from lambent.core.light.colour import luminance, shown
from lambent.core.light.photometry import photometric
from lambent.core.pictures.images import to_bytes
from lambent.core.views.camera import camera_axes
from lambent.core.views.projections import View

THRESHOLD_CD_M2, PEAK_CD_M2 = 2000.0, 50_000.0
GAP_RAD = 0.1
MOST_INDEX = 16.0
LEAST_LX = 380.0  # below, DGP underestimates people's ratings
COMFORT = ((0.35, "imperceptible"), (0.40, "perceptible"), (0.45, "disturbing"))  # of DGP; above, intolerable
MARK_SHARE = 0.6  # opacity of the mark over a source
COVERED_SR = 2 * math.pi * 0.97  # solid angle of a view that counts as the half space ahead


@dataclass(frozen=True)
class Source:
    """One glare source: mean luminance in cd/m2, solid angle in sr, position index and direction of its centre.

    `azimuth_deg` is to the right of the view direction, `elevation_deg` above it.
    """

    luminance: float
    solid_angle: float
    position_index: float
    azimuth_deg: float
    elevation_deg: float


@dataclass(frozen=True, eq=False)
class Glare:
    """Glare at an eye.

    Attributes
    ----------
    dgp : float
        Daylight glare probability, about .16 to 1.
    ugr : float
        Unified glare rating, with all that is not a source as background; 0 without sources.
    illuminance_lx : float
        At the eye, facing the view direction.
    background : float
        Mean luminance without the sources, cd/m2.
    sources : tuple of Source
        In descending order of brightness at the eye.
    numbers : ndarray
        (H, W) number of each pixel's source, from 1; 0 outside sources.
    radiance : ndarray
        (H, W, 3), W/(sr m2): the picture.
    """

    dgp: float
    ugr: float
    illuminance_lx: float
    background: float
    sources: tuple[Source, ...]
    numbers: NDArray[np.int32]
    radiance: Floats

    @property
    def comfort(self) -> str:
        """The DGP in words, or a note that it is too dark for one."""
        if self.illuminance_lx < LEAST_LX and not self.sources:
            return f"too dark for DGP (below {LEAST_LX:g} lx)"
        return next((word for limit, word in COMFORT if self.dgp < limit), "intolerable")

    def marked(self) -> NDArray[np.uint8]:
        """(H, W, 3) display values: the background at a fitting exposure, each source in its own hue."""
        lit = luminance(self.radiance)[(self.numbers == 0) & (self.radiance.max(axis=-1) > 0)]
        exposure_ev = float(np.log2(0.18 / np.exp(np.log(lit).mean()))) if len(lit) and lit.min() > 0 else 0.0
        picture = np.asarray(shown(self.radiance, "filmic", exposure_ev), float)
        hues = [colorsys.hsv_to_rgb((0.618034 * k) % 1, 0.9, 1.0) for k in range(len(self.sources))]
        colours = np.array([(0.0, 0.0, 0.0), *hues])[self.numbers]
        share = MARK_SHARE * (self.numbers > 0)[..., None]
        return to_bytes(picture * (1 - share) + colours * share)


def glare(radiance: Floats, view: View, threshold: float = THRESHOLD_CD_M2) -> Glare:
    """Glare in a picture (H, W, 3) of radiance in W/(sr m2) that shows the half space ahead, such as a fisheye.

    Raises
    ------
    UserError
        If the picture shows less than the half space ahead.
    """
    rays, solid_angle = view.directions(radiance.shape[1], radiance.shape[0])
    right, up, ahead = (rays @ axis for axis in camera_axes(view.camera))
    seen = ahead > 0
    if (covered := float(solid_angle[seen].sum())) < COVERED_SR:
        raise UserError(
            "picture shows too little of the surroundings for glare", got=f"{covered:.2f} sr",
            expected="the half space ahead, 6.28 sr", hint="render it with --projection fisheye",
        )  # fmt: skip
    visible = np.where(seen, photometric(radiance), 0.0)
    numbers = _numbered(visible, rays, threshold)
    flux = visible * solid_angle * np.maximum(ahead, 0)
    illuminance = float(flux.sum())
    background = max(illuminance - float(flux[numbers > 0].sum()), 0.0) / math.pi
    sources, weights = [], []
    for number in range(1, int(numbers.max()) + 1):
        of = numbers == number
        omega = float(solid_angle[of].sum())
        mean = [np.average(v[of], weights=solid_angle[of]) for v in (visible, right, up, ahead)]
        index = float(position_index(*mean[1:]))
        azimuth, elevation = np.arctan2(mean[1], mean[3]), np.arctan2(mean[2], np.hypot(mean[1], mean[3]))
        sources.append(Source(float(mean[0]), omega, index, *np.degrees([azimuth, elevation]).tolist()))
        weights.append(sources[-1].luminance ** 2 * omega / index**2)
    total = sum(weights)
    dgp = 5.87e-5 * illuminance + 0.0918 * math.log10(1 + total / max(illuminance, 1e-9) ** 1.87) + 0.16
    ugr = max(0.0, 8 * math.log10(0.25 / max(background, 1e-9) * total)) if total > 0 else 0.0
    order = np.argsort(weights)[::-1]
    renamed = np.zeros(len(sources) + 1, np.int32)
    renamed[order + 1] = np.arange(1, len(sources) + 1)
    ranked = tuple(sources[k] for k in order)
    return Glare(min(dgp, 1.0), ugr, illuminance, background, ranked, renamed[numbers], radiance)


def position_index(right: ArrayLike, up: ArrayLike, ahead: ArrayLike) -> Floats:
    """Guth's position index (...), at least 1, of directions with components (...) `right`, `up` and `ahead`."""
    right, up, ahead = (np.asarray(part, float) for part in (right, up, ahead))
    across = np.hypot(right, up)
    sigma = np.degrees(np.arctan2(across, ahead))
    tau = np.degrees(np.arctan2(np.abs(right), up))  # angle from straight above the line of sight
    above = (35.2 - 0.31889 * tau - 1.22 * np.exp(-2 * tau / 9)) * 1e-3 * sigma
    above += (21 + 0.26667 * tau - 0.002963 * tau * tau) * 1e-5 * sigma * sigma
    lower = across * np.sqrt(1 + 0.3225 * np.cos(np.radians(tau)) ** 2)
    beta = np.degrees(np.arctan2(lower, ahead))
    below = 6.49e-3 * beta + 21e-5 * beta * beta
    return np.asarray(np.clip(np.exp(np.where(up >= 0, above, below)), 1.0, MOST_INDEX))


def _numbered(shown: Floats, rays: Floats, threshold: float) -> NDArray[np.int32]:
    """(H, W) source numbers from 1: groups of bright pixels, and the peaks within them as groups of their own."""
    groups = _groups(shown > threshold, rays)
    count = int(groups.max())
    if count == 0:
        return groups
    peaks = _groups((groups > 0) & (shown > PEAK_CD_M2), rays)
    both = np.where(peaks > 0, count + peaks, groups)
    kept = np.unique(both[both > 0])
    return np.asarray(np.where(both > 0, np.searchsorted(kept, both) + 1, 0), np.int32)


def _groups(bright: Flags, rays: Floats) -> NDArray[np.int32]:
    """(H, W) group numbers from 1, 0 where not bright; different groups are at least `GAP_RAD` apart.

    The spherical Delaunay triangulation, computed as a convex hull, contains the shortest links between groups.
    """
    from scipy.ndimage import binary_erosion, label
    from scipy.spatial import ConvexHull

    touching, count = label(bright, np.ones((3, 3)))
    if count < 2:
        return np.asarray(touching, np.int32)
    rim = bright & ~binary_erosion(bright, np.ones((3, 3)))
    points, mine = rays[rim], touching[rim] - 1
    corners = np.stack(np.meshgrid(*[(-1.0, 1.0)] * 3), axis=-1).reshape(-1, 3) / math.sqrt(3)
    found = ConvexHull(np.concatenate([points, corners])).simplices
    links = np.concatenate([found[:, [0, 1]], found[:, [1, 2]], found[:, [2, 0]]])
    links = links[(links < len(points)).all(axis=1)]
    near = (points[links[:, 0]] * points[links[:, 1]]).sum(axis=1) > math.cos(GAP_RAD)
    merged = components(mine[links[near]], count)
    return np.where(touching > 0, np.concatenate([[0], merged + 1])[touching], 0).astype(np.int32)
