"""The sun of a scene, removed from the light map: a directional light, or a compact bright spot of the environment.

The sun's picture is its part of the environment's picture. Both are interpolated identically, so that the light removed
from the light map is exactly the light that the renderer adds, whatever disc represents it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from lambent.baking.tracing.scene_builder import environment_dict
from lambent.core.arrays import Floats, Image, Indices
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.latlong import lat_long_direction
from lambent.core.light.colour import luminance
from lambent.core.plain import triple
from lambent.scenes.panes import panes_of
from lambent.scenes.scene import DirectionalLight, Environment, Light, Scene
from lambent.store.contract import SunRecord

BRIGHT = 8.0  # times the mean radiance: a sun is brighter
SHARE = 0.05  # of all incident light that a sun must bring: otherwise its shadow hardly shows
LARGEST_RAD = np.radians(5.0)
HALO = 3.0  # times the radius that holds half of the light: the halo beyond stays in the sky
ALIGNED = 1e-6  # of 1 - cos: directional lights this well aligned are one sun
RING_PX = 3.0  # width of the ring around the sun whose median is the sky behind it


@dataclass(frozen=True, eq=False)
class SunPicture:
    """A sun's part of a picture of `size` (H, W): `pixels` (h, w, 3) from `corner` (row, column) on.

    Rows and columns are those of Mitsuba's `envmap`; columns wrap around. `turn` (3, 3) rotates its directions to the
    world.
    """

    pixels: Image
    corner: tuple[int, int]
    size: tuple[int, int]
    turn: Floats


@dataclass(frozen=True, eq=False)
class FoundSun:
    """A sun, with its picture if it is part of the environment."""

    record: SunRecord
    picture: SunPicture | None = None


def sun_of(scene: Scene) -> FoundSun | None:
    """The sun that brings most light to a scene, or None. Other suns stay in the light map."""
    lights = [light for light in scene.lights if isinstance(light, DirectionalLight) and any(light.irradiance)]
    suns = [FoundSun(_of_lights(light, lights)) for light in lights]
    if scene.environment is not None and (found := _of_environment(scene.environment)) is not None:
        suns.append(found)
    brightest = max(suns, key=lambda one: float(luminance(np.array(one.record.irradiance))), default=None)
    if brightest is None:
        return None
    return replace(brightest, record=brightest.record.model_copy(update={"panes": panes_of(scene)}))


def _of_lights(light: DirectionalLight, lights: list[DirectionalLight]) -> SunRecord:
    """The sun of a light, combined with all lights aligned with it."""
    towards = -normalize(np.asarray(light.direction, float))
    along = [one for one in lights if _is_along(one, towards)]
    irradiance = np.sum([one.irradiance for one in along], axis=0)
    return SunRecord(direction=triple(towards), irradiance=triple(irradiance), radius_rad=0.0)


def is_sun(light: Light, found: FoundSun) -> bool:
    """Whether a light of the scene is part of its sun."""
    if found.picture is not None or not isinstance(light, DirectionalLight):
        return False
    return _is_along(light, np.array(found.record.direction))


def _is_along(light: DirectionalLight, towards: Floats) -> bool:
    return bool(-normalize(np.asarray(light.direction, float)) @ towards > 1 - ALIGNED)


@lru_cache(maxsize=4)
def _of_environment(environment: Environment) -> FoundSun | None:
    description = environment_dict(environment)
    turn = np.array(description["to_world"].matrix, float)[:3, :3]
    return sun_in(np.array(description["bitmap"])[..., :3] * np.float32(description["scale"]), turn)


def sun_in(picture: Image, turn: Floats) -> FoundSun | None:
    """Find the sun of a lat-long picture (H, W, 3) as read by Mitsuba, rotated by `turn` (3, 3); None without one.

    Rows reach from pole to pole, with the first and the last at the poles themselves. A sun is the connected spot
    brighter than BRIGHT times the mean that holds the most light, as far as HALO reaches.
    """
    height, width = picture.shape[:2]
    light = luminance(np.asarray(picture, float)) * _solid_angles(height, width)[:, None]
    total = float(light.sum())
    row, column = _brightest_spot(picture, light, BRIGHT * total / (4 * np.pi))
    if not len(row):
        return None
    w, flux = _directions(row, column, height, width), light[row, column]
    reach = _angles(w, normalize(flux @ w))
    half = float(np.quantile(reach, 0.5, weights=flux, method="inverted_cdf"))
    limit = HALO * max(half, np.pi / height)
    row, column, w, flux = (values[reach <= limit] for values in (row, column, w, flux))
    about = normalize(flux @ w)
    added = np.maximum(picture[row, column] - _behind(picture, row, column, about), 0).astype(np.float32)

    arriving = added * _solid_angles(height, width)[row, None]
    left_out = luminance(arriving.astype(float))
    if left_out.sum() < SHARE * total:
        return None
    about = normalize(left_out @ w)
    # of a disc with the second moment of the pixels, each spread by its interpolation
    spread = (np.pi / height) ** 2 * (1 + (2 * np.sin(row * np.pi / height) * height / width) ** 2) / 6
    radius_rad = float(np.sqrt(2 * (left_out @ (_angles(w, about) ** 2 + spread)) / left_out.sum()))
    if radius_rad > LARGEST_RAD:
        return None
    irradiance = triple(((w @ about)[:, None] * arriving).sum(axis=0))
    record = SunRecord(direction=triple(normalize(turn @ about)), irradiance=irradiance, radius_rad=radius_rad)
    return FoundSun(record, _cut_out(row, column, added, (height, width), turn))


def _brightest_spot(picture: Image, light: Floats, least: float) -> tuple[Indices, Indices]:
    """Rows and columns of the connected pixels above `least` with the most `light` (H, W); empty without any."""
    from scipy.ndimage import label

    bright = luminance(picture) > least
    names, count = label(bright, np.ones((3, 3)))
    if not count:
        return np.zeros(0, int), np.zeros(0, int)
    strongest = 1 + int(np.argmax(np.bincount(names.ravel(), light.ravel())[1:]))
    peak = np.unravel_index(np.argmax(np.where(names == strongest, light, -1)), light.shape)
    shift = light.shape[1] // 2 - int(peak[1])  # the spot may cross the edge of the picture
    names, _ = label(np.roll(bright, shift, axis=1), np.ones((3, 3)))
    row, column = np.nonzero(names == names[peak[0], light.shape[1] // 2])
    return row, (column - shift) % light.shape[1]


def _behind(picture: Image, row: Indices, column: Indices, about: Floats) -> Floats:
    """(3,) median of the pixels RING_PX around a spot at direction `about`."""
    height, width = picture.shape[:2]
    pixel = np.pi / height
    near = np.arange(max(0, int(row.min() - 2 * RING_PX)), min(height, int(row.max() + 2 * RING_PX + 1)))
    rows, columns = (grid.ravel() for grid in np.meshgrid(near, np.arange(width), indexing="ij"))
    spot = np.zeros((height, width), bool)
    spot[row, column] = True
    away = _angles(_directions(rows, columns, height, width), about)
    own = _angles(_directions(row, column, height, width), about).max()
    ring = ~spot[rows, columns] & (away > own + pixel) & (away < own + (1 + RING_PX) * pixel)
    around = picture[rows[ring], columns[ring]]
    return np.median(around, axis=0) if len(around) else np.zeros(3)


def _cut_out(row: Indices, column: Indices, added: Image, size: tuple[int, int], turn: Floats) -> SunPicture:
    """The picture of the pixels `added` (n, 3), with a black border."""
    first = (int(column[np.argmax(luminance(added))]) - size[1] // 2) % size[1]
    columns = (column - first) % size[1]  # centred on the spot
    top, left = int(row.min()) - 1, int(columns.min()) - 1
    pixels = np.zeros((int(row.max()) - top + 2, int(columns.max()) - left + 2, 3), np.float32)
    pixels[row - top, columns - left] = added
    return SunPicture(pixels, (top, (left + first) % size[1]), size, turn)


def _solid_angles(height: int, width: int) -> Floats:
    """(H,) integral over the sphere of the interpolation kernel of a pixel in each row."""
    step = np.pi / (height - 1)
    band = 2 * np.sin(np.arange(height) * step) * (1 - np.cos(step)) / step
    band[[0, -1]] = 1 - np.sin(step) / step
    return np.asarray(band * (2 * np.pi / width))


def _directions(row: Indices, column: Indices, height: int, width: int) -> Floats:
    """Unit directions (n, 3) of pixels in the frame of the picture."""
    return lat_long_direction(row * (np.pi / (height - 1)), (column + 0.5) * (2 * np.pi / width))


def _angles(w: Floats, about: Floats) -> Floats:
    """Angles (n,) in radians between unit vectors; accurate for small ones."""
    return np.asarray(2 * np.arcsin(np.clip(np.linalg.norm(w - about, axis=-1) / 2, 0, 1)))
