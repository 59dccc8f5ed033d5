"""Whether dividing an object into pieces with their own probes lowers viewers' error enough to pay for a cut.

A cut is visible as a seam, and each piece costs a probe. So both are tried, before there is a light map: small probes
are path traced whole, and compared with the light that viewers see mirrored. Directions are spread by the object's
widest lobe, and light is compared as means over them: rough surfaces blur the errors of probes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lambent.baked.probes.lookups import distance_lookup, inverse_depth, planes_lookup
from lambent.baking.probes.planes import bounding_planes
from lambent.baking.probes.probe import Probe, Surroundings, bake_small
from lambent.baking.probes.selection import (
    TRIAL_TEXELS,
    WORTH,
    difference,
    light_along,
    spread_mirrored,
    viewers_of,
    widest_lobe,
)
from lambent.baking.tracing.rays import array_of, leaving
from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import sample
from lambent.core.geometry.directions import normalize
from lambent.core.light.colour import luminance
from lambent.materials.document import Material

POINTS = 512  # per object
SPREAD = 16  # directions per point
LEAST = 16  # points in view; with fewer, the result is unknown
DEPTH = 4  # surfaces on a path
SAMPLES = 4  # per texel of a probe; the reference has fewer


@dataclass(frozen=True)
class Seen:
    """Light seen mirrored in n points: origins and directions (n, SPREAD, 3), mean luminance (n,) over directions."""

    origins: Floats
    directions: Floats
    light: Floats


def seen_in(surfaces: list[tuple[Floats, Floats]], places: Floats, material: Material, whole: Any) -> list[Seen | None]:
    """What viewers at `places` (m, 3) see in each surface, points and unit normals (n, 3); None for too few points."""
    rng = np.random.default_rng(0)
    points, normals = (np.concatenate(one) for one in zip(*surfaces, strict=True))
    found, eyes = viewers_of(points, normals, places, whole, rng)
    if not found.any():
        return [None] * len(surfaces)
    at, n, view = points[found], normals[found], normalize(eyes[found] - points[found])
    if material.transmits:
        w = np.repeat(-view[:, None], SPREAD, axis=1)
    else:
        w = spread_mirrored(view, n, widest_lobe(material), SPREAD, rng)
    ray = leaving(whole, np.repeat(at, SPREAD, axis=0), np.repeat(n, SPREAD, axis=0), w.reshape(-1, 3))
    light = luminance(light_along(whole, ray, DEPTH, None, 1)).reshape(-1, SPREAD).mean(axis=1)
    origins = array_of(ray.o).astype(float).reshape(w.shape)
    counts = [int(mine.sum()) for mine in np.split(found, np.cumsum([len(p) for p, _ in surfaces])[:-1])]
    ends = np.cumsum(counts)[:-1]
    each = zip(*(np.split(values, ends) for values in (origins, w, light)), strict=True)
    return [Seen(*one) if count >= LEAST else None for one, count in zip(each, counts, strict=True)]


def small_probes(first: Any, whole: Any, centres: Floats) -> list[Probe]:
    """Probes at centres (m, 3) for a trial; `first` is the scene that they see themselves."""
    return bake_small(Surroundings(first, whole, None, DEPTH), centres, TRIAL_TEXELS, SAMPLES, 0)


def differences(seen: Seen, probe: Probe, centre: Floats) -> Floats:
    """(n,) in log(1 + L/median), by bounding planes or the distance map, whichever is better on average."""
    origins, w = (seen.origins - centre).reshape(-1, 3), seen.directions.reshape(-1, 3)
    planes = bounding_planes(probe.distance, probe.normals).astype(float)
    ways = planes_lookup(origins, w, planes), distance_lookup(origins, w, inverse_depth(probe.distance.astype(float)))
    errors = []
    for directions in ways:
        found = luminance(sample(probe.radiance.astype(float), normalize(directions)))
        errors.append(difference(found.reshape(-1, SPREAD).mean(axis=1), seen.light))
    return np.asarray(min(errors, key=lambda error: float(error.mean())))


def pays(seen: list[Seen], pieces: list[tuple[Probe, Floats]], one: tuple[Probe, Floats]) -> bool:
    """Whether probes of pieces, each with its centre, lower the error of one to WORTH in every piece's view."""
    cut = np.concatenate([differences(s, *own) for s, own in zip(seen, pieces, strict=True)])
    return bool(cut.mean() < WORTH * np.concatenate([differences(s, *one) for s in seen]).mean())
