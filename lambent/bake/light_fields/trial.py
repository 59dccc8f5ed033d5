"""Errors of light fields of more and more points, found with small maps, and of the probe in their place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.bake.light_fields.acquisition import Around, inverse_distances, radiance_maps
from lambent.bake.light_fields.placing import Placing
from lambent.bake.light_fields.watched import Watched
from lambent.core.arrays import Floats
from lambent.core.cubemap import sample
from lambent.core.directions import normalize
from lambent.core.light_field import LightField
from lambent.core.light_field_lookup import Place, marched
from lambent.core.nearest_points import nearest_points
from lambent.core.probe_lookups import distance_lookup, inverse_depth, planes_lookup
from lambent.scenes.scene import Mesh

TEXELS = 64  # along a side of a trial's maps
COUNTS = (16, 64, 256)


class ProbeLight:
    """Look-ups of a probe: radiance (6, N, N, 3), distance (6, N, N), planes (P, 4) in world space, or none."""

    def __init__(self, radiance: Floats, distance: Floats, planes: Floats, centre: Floats) -> None:
        self._radiance, self._centre = radiance, centre
        self._planes = planes + np.outer(planes[:, :3] @ centre, [0, 0, 0, 1])
        self._inverse = None if len(planes) else inverse_depth(distance)

    def along(self, origins: Floats, w: Floats) -> Floats:
        """Radiance (..., 3) along rays, as the renderer finds it."""
        x, directions = (origins - self._centre).reshape(-1, 3), w.reshape(-1, 3)
        if self._inverse is None:
            found = planes_lookup(x, directions, self._planes)
        else:
            found = distance_lookup(x, directions, self._inverse)
        return sample(self._radiance, normalize(found)).reshape(w.shape)

    def far(self, w: Floats) -> Floats:
        """Radiance (..., 3) from far away."""
        return sample(self._radiance, w)


@dataclass(frozen=True)
class Trial:
    """Errors in what viewers see: of the probe, and of light fields by their numbers of points, rising."""

    probe: float
    fields: dict[int, float]
    size_sr: float

    def count_for(self, error: float) -> int:
        """The least number of points that comes down to an error; of those tried the best where none does."""
        enough = [count for count, found in self.fields.items() if found <= error]
        return min(enough, default=min(self.fields, key=lambda count: self.fields[count]))


def tried(
    placing: Placing, mesh: Mesh, seen: Watched, probe: ProbeLight, around: Around, seed: int, most: int = COUNTS[-1]
) -> Trial:
    """The errors of an object's probe, and of light fields of COUNTS points and of `most`, as far as it has room."""
    by_probe = probe.along(seen.origins, seen.directions)
    errors = dict[int, float]()
    for count in (*(count for count in COUNTS if count < most), most):
        field = small_field(placing, mesh, count, around, seed)
        near = nearest_points(seen.x, seen.normals, field.points).astype(np.int64)
        every = np.arange(len(near)).repeat(seen.directions.shape[1])
        place = Place(seen.x[every], seen.normals[every], near[every])
        found = marched(field, place, seen.directions.reshape(-1, 3), sky=probe.far).radiance
        light = np.where(place.known.any(axis=1, keepdims=True), found, by_probe.reshape(-1, 3))
        errors[count] = seen.error(light.reshape(by_probe.shape).mean(axis=1))
    return Trial(seen.error(by_probe.mean(axis=1)), errors, seen.size_sr)


def small_field(placing: Placing, mesh: Mesh, count: int, around: Around, seed: int) -> LightField:
    """A light field of small maps, without a sample map."""
    found = placing.points(mesh, count, seed)
    p, n = found.positions.astype(np.float32), found.normals.astype(np.float32)
    radiance = radiance_maps(around, p, TEXELS, 1, seed, normals=n)
    inverse = inverse_distances(around.scene, p, TEXELS)
    return LightField(p, n, radiance, inverse, np.zeros((0, 0, 4), np.uint16), (0, 0), (1, 1), found.offset_m)
