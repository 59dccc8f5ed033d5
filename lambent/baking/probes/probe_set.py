"""All probes of a scene, baked one by one with their objects left out, sharing meshes and light map."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baking.light.cache import GroupedCache
from lambent.baking.probes.centre import encloses, flat_axis, places_above, probe_centre
from lambent.baking.probes.division import HIDDEN, family
from lambent.baking.probes.hidden import RAYS as HIDDEN_RAYS
from lambent.baking.probes.hidden import hidden_share, parallax_deg, seen_along, seen_from, spread
from lambent.baking.probes.planes import bounding_planes
from lambent.baking.probes.probe import MIRROR_DEPTH, Surroundings, bake_probe
from lambent.baking.probes.selection import (
    OWN,
    RAYS,
    TRIAL_SAMPLES,
    TRIAL_TEXELS,
    WORTH,
    Mirrored,
    judged,
    largest_r0,
    mirrored,
)
from lambent.baking.tracing.path_tracer import Tally
from lambent.baking.tracing.solids import SolidTest
from lambent.baking.tracing.traced_scene import TracedScene
from lambent.core.arrays import Floats
from lambent.core.light.colour import halves, in_halves

LEAST_POINTS = 512  # least number of mirrored rays per object that shares a probe...
MOST_POINTS = 16384  # ...as long as the total does not exceed this


@dataclass(frozen=True)
class ProbeJob:
    """The probe of an object, shared by the objects `sharing`; `texels`, `samples` and `noise` as of `bake_probe`."""

    name: str
    texels: int
    samples: int
    noise: float
    seed: int
    sharing: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Lit:
    """What lights probes: the light map (H, W, 3), and that of backs; without it, paths are traced whole.

    With `by_group`, probes are stored by light group too, from the groups' maps (n, H, W, 3).
    """

    irradiance: Floats | None = None
    irradiance_back: Floats | None = None
    by_group: bool = False
    groups: Floats | None = None
    groups_back: Floats | None = None


class ProbeSet:
    """Bakes the probes of a scene: in this process or, pickled, in another.

    With the light map, a path ends at the first diffuse surface; mirrors in mirrors are traced either way. Without it,
    paths have at most `max_depth` vertices. `backs` are the opaque objects that are seen from behind too, and `held`
    are those that stay in every probe (`sharing`).
    """

    def __init__(
        self, traced: TracedScene, lit: Lit, max_depth: int, backs: frozenset[str] = frozenset(),
        held: frozenset[str] = frozenset(),
    ) -> None:  # fmt: skip
        self._made_of = traced, lit, max_depth, backs, held
        whole_paths = lit.irradiance is None
        self._traced, self._depth = traced, max_depth if whole_paths else MIRROR_DEPTH
        self._builder, self._whole = traced.builder(diffuse=whole_paths), traced.whole(diffuse=whole_paths)
        self._scene, self._backs, self._held = self._builder.scene, backs, held
        self._left_out: tuple[frozenset[str], Any] | None = None
        self._seen = self._builder.without(traced.apart, self._whole)
        self._cache = None if lit.irradiance is None else traced.cache(lit.irradiance, lit.irradiance_back)
        self._sorting: tuple[Tally, GroupedCache | None] | None = None
        if lit.by_group:
            cache = None if lit.groups is None else traced.grouped_cache(lit.groups, lit.groups_back)
            self._sorting = traced.tally(diffuse=whole_paths, direct=None), cache

    def __reduce__(self) -> tuple[Any, ...]:
        return ProbeSet, self._made_of

    @cached_property
    def _solids(self) -> SolidTest:
        return SolidTest(self._builder, self._whole)

    def _without(self, names: frozenset[str]) -> Any:
        """What probes see without these objects, cached until other ones are left out: parts of one object share it."""
        if not names:
            return self._seen
        if self._left_out is None or self._left_out[0] != names:
            self._left_out = None
            self._left_out = names, self._builder.build(leave_out=names | self._traced.apart)
        return self._left_out[1]

    def _mirrored(self, names: tuple[str, ...], seed: int) -> Mirrored | None:
        """Rays that viewers see mirrored in objects, or through them; None if there are too few."""
        if self._cache is None:
            return None
        numbers = list(self._builder.meshes)
        own = [numbers.index(part) for part in self._own(names)]
        count = max(RAYS // len(names), min(LEAST_POINTS, MOST_POINTS // len(names)))
        surfaces = [spread(self._scene.object(name).mesh, count) for name in names]
        for i, name in enumerate(names):
            if name in self._backs:
                points, normals = surfaces[i]
                surfaces[i] = np.concatenate([points, points]), np.concatenate([normals, -normals])
        points, normals = (np.concatenate(a) for a in zip(*surfaces, strict=True))
        each = [len(mine) for mine, _ in surfaces]
        materials = [self._scene.materials[self._scene.object(name).material] for name in names]
        clear = np.repeat([material.transmits for material in materials], each)
        r0 = np.repeat([largest_r0(material) for material in materials], each)
        return mirrored(
            points,
            normals,
            clear,
            r0,
            self._traced.places,
            self._seen,
            self._cache,
            MIRROR_DEPTH,
            self._builder.numbers,
            own,
            seed,
        )

    def _own(self, names: tuple[str, ...]) -> frozenset[str]:
        """The objects and all other parts of their wholes, which a probe leaves out."""
        return frozenset().union(*(family(self._scene.parts, name) for name in names))

    def _error(self, rays: Mirrored, first: Any, centre: Floats, seed: int) -> float:
        """Error of a small probe at `centre`; `first` is the scene that it sees itself."""
        around = Surroundings(first, self._whole, self._cache, MIRROR_DEPTH)
        return judged(rays, bake_probe(around, centre, TRIAL_TEXELS, TRIAL_SAMPLES, seed), centre).best

    def _centre(self, name: str, without: Any, rays: Mirrored | None, seed: int) -> Floats:
        """Position of the probe: above the centre of a flat object if little is hidden from there.

        Otherwise, among the places that see more, the one with the smallest error in viewers' mirrored rays.
        """
        scene, mesh = self._scene, self._scene.object(name).mesh
        if name in scene.probe_centres or rays is None or self._transmits(name) or flat_axis(mesh) is None:
            return probe_centre(self._builder, name, without, self._solids.within(without))
        seen = seen_along(rays.origins, rays.directions, without)
        places = places_above(mesh, np.mean(scene.bounds, axis=0), rays.directions, without)
        first, *hidden = (hidden_share(seen, place, without) for place in places)
        if first <= HIDDEN:
            return np.asarray(places[0])
        tried = [0, *(i for i, share in enumerate(hidden, 1) if share < WORTH * first)]
        errors = [self._error(rays, without, places[i], seed) for i in tried]
        best = int(np.argmin(errors))
        return np.asarray(places[tried[best] if errors[best] < WORTH * errors[0] else 0])

    def _transmits(self, name: str) -> bool:
        return self._scene.materials[self._scene.object(name).material].transmits

    def __call__(self, job: ProbeJob) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Arrays radiance, distance and planes of one object's probe, and its meta.

        The meta has the centre, whether the object was left out, and how well one centre represents the whole surface:
        `hidden_share` and `parallax_deg` (`hidden`), `mirror_error`, `seen_irradiance`, `occlusion_gain` and
        `even_niches` (`selection`).

        Planes given by the scene are used as they are; otherwise they are found from the probe itself.
        """
        name, names, seed = job.name, (job.name, *job.sharing), job.seed
        without = self._without(self._own(tuple(one for one in names if one not in self._held)))
        rays = self._mirrored(names, seed)
        centre = self._centre(name, without, rays, seed)
        left_out = name not in self._held and not encloses(self._builder, name, centre, self._whole)
        if left_out and rays is not None and not self._transmits(name) and rays.own.mean() > OWN:
            alone, held = (self._error(rays, first, centre, seed) for first in (without, self._seen))
            left_out = held >= WORTH * alone
        seen = without if left_out or name in self._held else self._seen
        around = Surroundings(seen, self._whole, self._cache, self._depth)
        if self._sorting is not None:
            tally, cache = self._sorting
            around = replace(around, cache=cache, tally=tally)
        probe = bake_probe(around, centre, job.texels, job.samples, seed, job.noise)
        given = self._scene.probe_planes.get(name)
        if given is None:
            planes = bounding_planes(probe.distance, probe.normals)
            planes[:, 3] -= planes[:, :3] @ centre.astype(np.float32)
        else:
            planes = np.asarray(given, np.float32).reshape(-1, 4)
        about = planes + np.outer(planes[:, :3] @ centre, [0, 0, 0, 1])
        radiance, unit = in_halves(probe.radiance)
        arrays: dict[str, NDArray[Any]] = {"radiance": radiance, "distance": probe.distance, "planes": planes}
        if probe.groups is not None:
            arrays["groups"] = halves(probe.groups, unit)
        meta: dict[str, Any] = {"centre": [float(x) for x in centre], "object_left_out": left_out, "unit": unit}
        meta["traced"] = self._cache is None
        if rays is not None:
            found = judged(rays, probe, centre, about, through=self._transmits(name))
            if found.needs_distance and given is None:
                arrays["planes"] = planes[:0]
            meta["mirror_error"] = round(found.best, 3)
            if found.scaling.gain:
                meta["occlusion_gain"], meta["even_niches"] = found.scaling.gain, found.scaling.even
                meta["seen_irradiance"] = [float(value) for value in found.irradiance]
        if rays is None:
            of_surface = seen_from(*spread(self._scene.object(name).mesh, HIDDEN_RAYS), seen)
        else:
            of_surface = seen_along(rays.origins, rays.directions, seen)
        meta["hidden_share"] = round(hidden_share(of_surface, centre, seen), 3)
        meta["parallax_deg"] = round(parallax_deg(of_surface, centre, about), 2)
        return arrays, meta
