"""All probes of a scene: one after another with its object left out, sharing meshes and light map."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.bake.groundwork import Groundwork
from lambent.bake.planes import bounding_planes
from lambent.bake.probe import MIRROR_DEPTH, LightMapCache, Surroundings, bake_probe
from lambent.bake.probe_centre import encloses, flat_axis, places_above, probe_centre
from lambent.bake.probe_modes import (
    CLOSE,
    OWN,
    RAYS,
    TRIAL_SAMPLES,
    TRIAL_TEXELS,
    WORTH,
    Mirrored,
    judged,
    mirrored,
)
from lambent.bake.probe_parts import HIDDEN, family, hidden_share, parallax_deg, seen_along, seen_from, spread
from lambent.bake.quality import Quality
from lambent.bake.solids import SolidTest

Array = NDArray[np.floating]


class ProbeSet:
    """Bakes the probes of a scene from its light map (H, W, 3), or, where that is None, path traced whole.

    With the light map a path ends at the first diffuse surface; mirrors in mirrors are traced either way.
    """

    def __init__(self, ground: Groundwork, irradiance: Array | None, irradiance_back: Array | None) -> None:
        traced = irradiance is None
        self._builder, self._whole = ground.builder(diffuse=traced), ground.whole(diffuse=traced)
        self._ground = ground
        self._left_out: tuple[frozenset[str], Any] | None = None
        self._cache = None if traced else LightMapCache(self._builder, irradiance, irradiance_back)

    @cached_property
    def _solids(self) -> SolidTest:
        return SolidTest(self._builder, self._whole)

    def _without(self, names: frozenset[str]) -> Any:
        """The scene without these objects; kept until others are asked for, as parts of one object share it."""
        if self._left_out is None or self._left_out[0] != names:
            self._left_out = None
            self._left_out = names, self._builder.build(leave_out=names)
        return self._left_out[1]

    def _mirrored(self, name: str, seed: int) -> Mirrored | None:
        """What viewers see mirrored in an object, or through it; None where that is too little."""
        scene = self._builder.scene
        o = scene.object(name)
        material = scene.materials[o.material]
        if self._cache is None:
            return None
        points, normals = spread(o.mesh, RAYS)
        lifted = points + normals * (CLOSE * float(np.ptp(o.mesh.positions, axis=0).max()))
        own = [self._builder.shape_number(part) for part in family(scene.parts, name)]
        return mirrored(
            lifted, normals, self._ground.places, material, self._whole, self._cache, MIRROR_DEPTH, own, seed
        )

    def _centre(self, name: str, without: Any, rays: Mirrored | None, seed: int) -> Array:
        """Where the probe stands: of a flat object, where it shows best what viewers see mirrored.

        Over the middle where little is hidden from there; else one of the places which see more, if it shows it better.
        """
        scene = self._builder.scene
        mesh = scene.object(name).mesh
        if name in scene.probe_centres or rays is None or self._transmits(name) or flat_axis(mesh) is None:
            return probe_centre(self._builder, name, without, self._solids.within(without))
        seen = seen_along(rays.origins, rays.directions, without)
        places = places_above(mesh, np.mean(scene.bounds, axis=0), without)
        first, *hidden = (hidden_share(seen, place, without) for place in places)
        if first <= HIDDEN:
            return np.asarray(places[0])
        tried = [0, *(i for i, share in enumerate(hidden, 1) if share < WORTH * first)]
        around = Surroundings(without, self._whole, self._cache, MIRROR_DEPTH)
        trials = (bake_probe(around, places[i], TRIAL_TEXELS, TRIAL_SAMPLES, seed) for i in tried)
        errors = [judged(rays, trial, places[i]).best for i, trial in zip(tried, trials, strict=True)]
        best = int(np.argmin(errors))
        return np.asarray(places[tried[best] if errors[best] < WORTH * errors[0] else 0])

    def _transmits(self, name: str) -> bool:
        scene = self._builder.scene
        return scene.materials[scene.object(name).material].transmits

    def _better_held(self, rays: Mirrored, centre: Array, without: Any, seed: int) -> bool:
        """Whether a probe that holds its object shows what it mirrors better than one without."""
        errors = []
        for first in (without, self._whole):
            around = Surroundings(first, self._whole, self._cache, MIRROR_DEPTH)
            trial = bake_probe(around, centre, TRIAL_TEXELS, TRIAL_SAMPLES, seed)
            errors.append(judged(rays, trial, centre).best)
        return errors[1] < WORTH * errors[0]

    def bake(self, name: str, quality: Quality, seed: int) -> tuple[dict[str, Array], dict[str, Any]]:
        """Arrays radiance, distance and planes of one object's probe, and what to note.

        Noted are the centre, whether the object was left out, and how well one centre stands for the whole surface:
        `hidden_share` and `parallax_deg` of `probe_parts`, `mirror_error` and `seen_irradiance` of `probe_modes`.

        Planes that the scene gives are taken as they are; others are found from what the probe sees.
        """
        without = self._without(frozenset(family(self._builder.scene.parts, name)))
        rays = self._mirrored(name, seed)
        centre = self._centre(name, without, rays, seed)
        left_out = not encloses(self._builder, name, centre, self._whole)
        if left_out and rays is not None and not self._transmits(name) and rays.own.mean() > OWN:
            left_out = not self._better_held(rays, centre, without, seed)
        seen = without if left_out else self._whole
        depth = quality.max_depth if self._cache is None else MIRROR_DEPTH
        around = Surroundings(seen, self._whole, self._cache, depth)
        probe = bake_probe(around, centre, quality.probe_texels, quality.probe_samples, seed, quality.probe_noise)
        given = self._builder.scene.probe_planes.get(name)
        if given is None:
            planes = bounding_planes(probe.distance, probe.normals)
            planes[:, 3] -= planes[:, :3] @ centre.astype(np.float32)
        else:
            planes = np.asarray(given, np.float32)
        arrays = {"radiance": probe.radiance, "distance": probe.distance, "planes": planes}
        of_surface = seen_from(self._builder.scene.object(name).mesh, seen)
        meta = {"centre": [float(x) for x in centre], "object_left_out": left_out, "traced": self._cache is None}
        if rays is not None:
            about = planes.reshape(-1, 4) + np.outer(planes.reshape(-1, 4)[:, :3] @ centre, [0, 0, 0, 1])
            clear = self._transmits(name)
            found = judged(rays, probe, centre, about, through=clear)
            if found.needs_distance and given is None:
                arrays["planes"] = planes[:0]
            meta["mirror_error"] = round(found.best, 3)
            if found.scales:
                meta["seen_irradiance"] = [float(value) for value in found.irradiance]
        meta["hidden_share"] = round(hidden_share(of_surface, centre, seen), 3)
        meta["parallax_deg"] = round(parallax_deg(of_surface, centre, planes), 2)
        return arrays, meta
