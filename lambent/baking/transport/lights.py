"""All lights of a scene, as triangles."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.sky.daylight import radiance_from
from lambent.core.arrays import Floats
from lambent.core.geometry.latlong import lat_long_directions
from lambent.core.geometry.triangles import triangle_areas
from lambent.core.plain import triple
from lambent.scenes.scene import DirectionalLight, IesLight, Light, Scene
from lambent.scenes.sky.triangle_lights import (
    TriangleLights,
    environment_triangles,
    joined,
    small_lights,
    surface_triangles,
)
from lambent.store.lamp_discs import half_axes_m

GOLDEN = np.pi * (3 - np.sqrt(5))
MOST_POINTS = 16  # of an opening
ROWS = 256  # of samples of the environment; bright samples are replaced by finer ones
LEAST_FINE, MOST_FINE = 4, 32  # fine rows per coarse row: the resolution of the environment's picture
BRIGHT = 1 / 4000  # of all light: share above which samples are bright
Samples = tuple[Floats, Floats, Floats]
DARK = DirectionalLight((0.0, -1.0, 0.0), (0.0, 0.0, 0.0))  # kernels need at least one light
LAMPS = 0.5  # share of all lights, if there are both an environment and glowing surfaces


def scene_lights(scene: Scene, samples: Samples | None, count: int) -> TriangleLights:
    """The lights of a scene: about `count` triangles, plus its point and directional lights.

    Openings of luminaires are points of their photometry, evenly distributed over them.

    `samples` are those of the environment, if there is one.
    """
    parts = []
    glowing = [o for o in scene.objects if any(o.emission) and o.luminaire is None]
    share = LAMPS if glowing and samples is not None else 1.0
    if samples is not None:
        parts.append(environment_triangles(*samples, round(count * (share if glowing else 1.0))))
    if glowing:
        corners = np.concatenate([o.mesh.corners for o in glowing])
        radiance = np.concatenate([np.broadcast_to(o.emission, (len(o.mesh.faces), 3)) for o in glowing])
        parts.append(lamp_triangles(corners, radiance, max(1, round(count * share))))
    of_each = min(MOST_POINTS, max(1, count // (4 * max(len(scene.openings), 1))))
    small = [
        one for number, light in enumerate(scene.lights)
        for one in (points_of(light, of_each) if number in scene.openings else [light])
    ]  # fmt: skip
    found = joined([*parts, small_lights(small)] if small else parts)
    return found if len(found) else small_lights([DARK])


def points_of(light: Light, count: int) -> list[Light]:
    """A luminaire as `count` equal ones at points of its opening, an ellipse across its axis."""
    if not isinstance(light, IesLight):
        return [light]
    a, b = half_axes_m(light)
    radius, turn = np.sqrt((np.arange(count) + 0.5) / count), GOLDEN * np.arange(count)
    across = np.column_stack([a * radius * np.cos(turn), b * radius * np.sin(turn)]) @ light.axes[:2]
    scale = triple(np.array(light.scale) / count)
    return [replace(light, position=triple(light.position + one), scale=scale) for one in across]


def environment_samples(environment: Any) -> Samples:
    """Directions (N, 3), solid angles (N,) and radiance (N, 3) of an environment (mi.Emitter), fine where it is bright.

    Every sample has the mean radiance of its part of the sphere, so that small lamps count with all their light.
    """
    n = int(np.clip(np.ceil(_rows_of(environment) / ROWS), LEAST_FINE, MOST_FINE))
    rows, columns = ROWS * n, 2 * ROWS * n
    weight = -np.diff(np.cos(np.linspace(0, np.pi, rows + 1))) * (2 * np.pi / columns)
    coarse_weight = weight.reshape(ROWS, n).sum(axis=1) * n
    light = np.empty((ROWS, 2 * ROWS, 3))
    for row in range(ROWS):
        fine = slice(row * n, (row + 1) * n)
        found = radiance_from(environment, _directions(rows, columns, fine).reshape(-1, 3))
        light[row] = np.einsum("rcgx,r->cx", found.reshape(n, 2 * ROWS, n, 3), weight[fine])
    bright = light.sum(axis=-1) > BRIGHT * light.sum()
    parts = [(lat_long_directions(ROWS, 2 * ROWS)[~bright], np.repeat(coarse_weight, (~bright).sum(axis=1)))]
    for row in map(int, np.flatnonzero(bright.any(axis=1))):
        fine = slice(row * n, (row + 1) * n)
        inside = np.broadcast_to(bright[row].repeat(n), (n, columns))
        parts.append((_directions(rows, columns, fine)[inside], np.repeat(weight[fine], inside.sum(axis=1))))
    w, weights = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    many = int(np.count_nonzero(~bright))
    fine_radiance = radiance_from(environment, w[many:]) if len(w) > many else np.zeros((0, 3))
    return w, weights, np.concatenate([light[~bright] / weights[:many, None], fine_radiance])


def environment_rows(environment: Any, rows: int) -> NDArray[np.float32]:
    """(rows, 2 rows, 3) lat-long picture of an environment (mi.Emitter): mean radiance per pixel."""
    n = int(np.clip(np.ceil(_rows_of(environment) / rows), 2, MOST_FINE))
    weight = -np.diff(np.cos(np.linspace(0, np.pi, rows * n + 1))).reshape(rows, n)
    picture = np.empty((rows, 2 * rows, 3), np.float32)
    for row in range(rows):
        w = _directions(rows * n, 2 * rows * n, slice(row * n, (row + 1) * n)).reshape(-1, 3)
        found = radiance_from(environment, w).reshape(n, 2 * rows, n, 3).mean(axis=2)
        picture[row] = np.einsum("ncx,n->cx", found, weight[row] / weight[row].sum())
    return picture


def _rows_of(environment: Any) -> int:
    """Number of rows of an environment's picture."""
    return int(mi.traverse(environment)["data"].shape[0])


def _directions(rows: int, columns: int, some: slice) -> Floats:
    """A slice of the rows of `lat_long_directions`."""
    theta = (np.arange(some.start, some.stop) + 0.5) / rows * np.pi
    phi = (np.arange(columns) + 0.5) / columns * (2 * np.pi) - np.pi
    across = np.stack([np.sin(phi), np.zeros(columns), -np.cos(phi)], axis=-1)
    return np.asarray(across * np.sin(theta)[:, None, None] + np.cos(theta)[:, None, None] * np.array([0.0, 1.0, 0.0]))


def lamp_triangles(corners: Floats, radiance: Floats, count: int) -> TriangleLights:
    """Glowing triangles (F, 3, 3) of radiances (F, 3) as about `count` lights, in proportion to their light.

    If there are more triangles, evenly spaced ones represent their neighbours.
    """
    areas = triangle_areas(corners)
    power = areas * radiance.sum(axis=1)
    lit = power > 0
    corners, radiance, areas, power = corners[lit], radiance[lit], areas[lit], power[lit]
    if len(corners) > count:
        reached = np.cumsum(power) / power.sum() * count
        chosen = np.searchsorted(reached, np.arange(count) + 0.5)
        share = power.sum() / count / power[chosen]
        return surface_triangles(corners[chosen], radiance[chosen] * share[:, None], np.inf)
    cuts = np.maximum(1, np.floor(np.sqrt(power / power.sum() * count))).astype(int)
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1).max(axis=1)
    parts = [
        surface_triangles(c[None], r[None], edge / n * (1 + 1e-9))
        for c, r, edge, n in zip(corners, radiance, edges, cuts, strict=True)
    ]
    return joined(parts)
