"""Errors of light fields of several sizes, whose light is traced where it is read, and of the probe in their place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import NamedTuple

import numpy as np

from lambent.baked.light_fields.light_field import LightField
from lambent.baked.light_fields.lookup import Place, marched
from lambent.baked.light_fields.nearest_points import nearest_points
from lambent.baked.probes.lookups import distance_lookup, inverse_depth, planes_lookup
from lambent.baking.light_fields.acquisition import Surroundings, TracedMaps, inverse_distances
from lambent.baking.light_fields.facing import views_in
from lambent.baking.light_fields.placing import Placed, Placing
from lambent.baking.light_fields.watched import Watched
from lambent.baking.probes.selection import PLAIN, Scaling
from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import sample
from lambent.core.geometry.directions import normalize
from lambent.scenes.scene import LEAST_TEXELS, Mesh

MOST_TEXELS = 190  # along a side of a trial's maps
MOST_OF_FIELD = 1 << 24  # texels of all maps of a trial
COUNTS = (16, 64, 256, 1024)
FINENESS = (1, 2 / 3, 2)  # of maps, relative to those that a bake's quality asks for
ENOUGH = 64  # points from where on maps of a size are tried with more only if the error falls to FALLS
FALLS = 0.97


class Option(NamedTuple):
    """A light field that an object may get: how many points, and the texels along a side of their maps."""

    points: int
    texels: int


PROBE = Option(0, 0)  # no light field


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
    """Errors in what viewers see of an object: of its probe, and of the light fields that it may get.

    `held_out` has those (n,) at places that no choice is made by, the probe's under PROBE.
    """

    probe: float
    fields: dict[Option, float]
    size_sr: float
    held_out: dict[Option, Floats]

    def error(self, option: Option) -> float:
        """Error of a light field, or of the PROBE."""
        return self.fields.get(option, self.probe)

    def falls(self, before: Option, after: Option, certainty: float) -> bool:
        """Whether the error falls at places that are held out, by more than `certainty` standard errors."""
        gain = self.held_out[before] - self.held_out[after]
        return bool(gain.mean() > certainty * gain.std() / np.sqrt(len(gain)))

    def count_for(self, error: float) -> int:
        """The least number of points that comes down to an error; of those tried the best where none does."""
        enough = [option.points for option, found in self.fields.items() if found <= error]
        return min(enough, default=min(self.fields, key=lambda option: self.fields[option]).points)


def options_of(texels: int) -> list[Option]:
    """The light fields that objects may get where a bake's quality asks for maps of `texels` a side.

    Rough lobes need many points rather than fine maps, narrow ones the reverse. Of those that a trial
    cannot tell apart, the quality's own stay.
    """
    found = dict[tuple[int, int], Option]()
    for fineness in FINENESS:
        side = max(LEAST_TEXELS, texels if fineness == 1 else 4 * round((fineness * texels + 2) / 4) - 2)  # of blocks
        for count in COUNTS:
            if count * (tried_with := min(side, MOST_TEXELS)) ** 2 <= MOST_OF_FIELD:
                found.setdefault((count, tried_with), Option(count, side))
    return sorted(found.values())


def tried(
    placing: Placing, mesh: Mesh, seen: Watched, probe: ProbeLight, around: Surroundings, seed: int,
    options: Sequence[Option], level: float,
) -> Trial:  # fmt: skip
    """The errors of an object's probe, and of the light fields of `options`, rising, as far as more points help."""
    by_probe = probe.seen(seen)
    deciding, held_out = seen.halves()
    errors, checks = dict[Option, float](), dict[Option, Floats]()

    def judged(light: Floats) -> tuple[float, Floats]:
        return seen.of(deciding).error(light[deciding], level), seen.of(held_out).errors(light[held_out], level)

    by_itself, checks[PROBE] = judged(by_probe)
    views, stopped = views_in(around.scene), set[int]()
    for count, some in groupby(options, key=lambda option: option.points):
        sides = [option.texels for option in some if option.texels not in stopped]
        if not sides:
            continue
        points = placing.points(mesh, count, seed)
        near = nearest_points(seen.x, seen.normals, points.positions.astype(np.float32), views).astype(np.int64)
        every = np.arange(len(near)).repeat(seen.directions.shape[1])
        place = Place(seen.x[every], seen.normals[every], near[every])
        for side in sides:
            field = trial_field(points, min(side, MOST_TEXELS), around, seed)
            found = marched(field, place, seen.directions.reshape(-1, 3), sky=probe.far).radiance
            found = np.where(place.known.any(axis=1, keepdims=True), found, by_probe.reshape(-1, 3))
            option = Option(count, side)
            errors[option], checks[option] = judged(found.reshape(by_probe.shape))
            if count >= ENOUGH and not helps(errors, option):
                stopped.add(side)
    return Trial(by_itself, errors, seen.size_sr, checks)


def helps(errors: Mapping[Option, float], option: Option) -> bool:
    """Whether an option errs clearly less than those with fewer points or coarser maps."""
    fewer = [errors[one] for one in errors if one.texels == option.texels and one.points < option.points]
    coarser = [errors[one] for one in errors if one.points == option.points and one.texels < option.texels]
    return errors[option] < FALLS * min(fewer + coarser, default=np.inf)


def trial_field(points: Placed, texels: int, around: Surroundings, seed: int) -> LightField:
    """A light field whose light is traced where it is read, without a sample map."""
    p, n = points.positions.astype(np.float32), points.normals.astype(np.float32)
    inverse = inverse_distances(around.scene, p, texels)
    light, none = TracedMaps(around, p, texels, seed), np.zeros((0, 0, 4), np.uint16)
    return LightField(p, n, light, inverse, none, (0, 0), (1, 1), points.offset_m)
