"""Errors of light fields of more and more points, found with small maps, and of the probe in their place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lambent.bake.light_fields.acquisition import Around, inverse_distances, radiance_maps
from lambent.bake.light_fields.facing import views_in
from lambent.bake.light_fields.placing import Placing
from lambent.bake.light_fields.watched import Watched
from lambent.bake.probes.selection import PLAIN, Scaling
from lambent.core.arrays import Floats
from lambent.core.cubemap import sample
from lambent.core.directions import normalize
from lambent.core.light_field import LightField
from lambent.core.light_field_lookup import Place, marched
from lambent.core.nearest_points import nearest_points
from lambent.core.probe_lookups import distance_lookup, inverse_depth, planes_lookup
from lambent.scenes.scene import Mesh

MOST_TEXELS = 94  # along a side of a trial's maps
COUNTS = (16, 64, 256)
ENOUGH = 64  # points that are not nearer than the probe: then more are not tried


class ProbeLight:
    """Look-ups of a probe: radiance (6, N, N, 3), distance (6, N, N), planes (P, 4) in world space, or none."""

    def __init__(
        self,
        radiance: Floats,
        distance: Floats,
        planes: Floats,
        centre: Floats,
        irradiance: Floats | None = None,
        scaling: Scaling = PLAIN,
    ) -> None:
        """`irradiance`, nine numbers, is what the probe alone would give, where its light is scaled."""
        self._radiance, self._centre, self._irradiance = radiance, centre, irradiance
        self._scaling = scaling
        self._planes = planes + np.outer(planes[:, :3] @ centre, [0, 0, 0, 1])
        self._inverse = None if len(planes) else inverse_depth(distance)

    def seen(self, watched: Watched) -> Floats:
        """Radiance (n, S, 3) along the rays of what is watched, as the renderer shows it."""
        found = self.along(watched.origins, watched.directions)
        if self._irradiance is None:
            return found
        return self._scaling.shown(found, watched.irradiance, watched.normals, self._irradiance)

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
    """Errors in what viewers see: of the probe, and of light fields by their numbers of points, rising.

    `held_out` has those at points that no choice is made by, the probe's as that of 0 points.
    """

    probe: float
    fields: dict[int, float]
    size_sr: float
    held_out: dict[int, float]

    def count_for(self, error: float) -> int:
        """The least number of points that comes down to an error; of those tried the best where none does."""
        enough = [count for count, found in self.fields.items() if found <= error]
        return min(enough, default=min(self.fields, key=lambda count: self.fields[count]))


def tried(
    placing: Placing, mesh: Mesh, seen: Watched, probe: ProbeLight, around: Around, seed: int, texels: int,
    level: float, most: int = COUNTS[-1], patch_density: Sequence[float] | None = None,
) -> Trial:  # fmt: skip
    """The errors of an object's probe, and of light fields of COUNTS points and of `most`, as far as it has room."""
    by_probe = probe.seen(seen)
    deciding, held_out = seen.halves()
    by_itself = seen.of(deciding).error(by_probe[deciding], level)
    errors, checks = dict[int, float](), {0: seen.of(held_out).error(by_probe[held_out], level)}
    views = views_in(around.scene)
    for count in (*(count for count in COUNTS if count < most), most):
        field = small_field(placing, mesh, count, min(texels, MOST_TEXELS), around, seed, patch_density)
        near = nearest_points(seen.x, seen.normals, field.points, views).astype(np.int64)
        every = np.arange(len(near)).repeat(seen.directions.shape[1])
        place = Place(seen.x[every], seen.normals[every], near[every])
        found = marched(field, place, seen.directions.reshape(-1, 3), sky=probe.far).radiance
        found = np.where(place.known.any(axis=1, keepdims=True), found, by_probe.reshape(-1, 3)).reshape(by_probe.shape)
        errors[count] = seen.of(deciding).error(found[deciding], level)
        checks[count] = seen.of(held_out).error(found[held_out], level)
        if count >= ENOUGH and min(errors.values()) > by_itself:
            break  # more points see no better
    return Trial(by_itself, errors, seen.size_sr, checks)


def small_field(
    placing: Placing, mesh: Mesh, count: int, texels: int, around: Around, seed: int,
    patch_density: Sequence[float] | None = None,
) -> LightField:  # fmt: skip
    """A light field of small maps, without a sample map."""
    found = placing.points(mesh, count, seed, patch_density=patch_density)
    p, n = found.positions.astype(np.float32), found.normals.astype(np.float32)
    radiance = radiance_maps(around, p, texels, 1, seed, normals=n)
    inverse = inverse_distances(around.scene, p, texels)
    return LightField(p, n, radiance, inverse, np.zeros((0, 0, 4), np.uint16), (0, 0), (1, 1), found.offset_m)
