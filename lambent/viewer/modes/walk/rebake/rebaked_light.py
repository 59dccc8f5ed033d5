"""Rebaked light, blended into the picture region by region: the upload of each step.

A region is the texels and the probe of an object. Texels are blended over a few frames, objects in view and near
first, then the probes in the same order. Arrays are computed in a thread; nothing here waits for the GPU.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baking.surfaces.coverage import pieces_of
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.light.light_mix import Factors
from lambent.core.views.camera import Camera, image_plane
from lambent.realtime.gpu.cube_mips import finite
from lambent.realtime.lamps.drawn import read_lamps
from lambent.realtime.light.baked import BakedScene, Probe, read_probe
from lambent.realtime.light.group_arrays import GroupArrays, groups_in
from lambent.realtime.light.group_light import GroupLight
from lambent.realtime.light.probe_light import ProbeLight
from lambent.realtime.resources import ObjectResources, SceneResources, light_layers
from lambent.realtime.sun.sun_disc import without_sun
from lambent.store.contract import DOMINANT_DIRECTION, SIDES, ObjectRecord, SceneRecord
from lambent.store.store import Store
from lambent.viewer.modes.walk.rebake.arrivals import Arrived

FADE_STEPS = 8  # frames in which one region is blended
STAGGER = 2  # frames between the starts of two regions
MOST_BATCHES = 16  # most batches of regions that are blended together
PROBE_STEPS = 3
REACH = 0.5  # reach of a look-up around a texel, in texels
Layers = list[NDArray[np.float16]]
Step = Callable[[SceneResources], None]  # what one frame uploads


@dataclass(frozen=True, eq=False)
class Rebaked:
    """The shown scene with the arrived light of the copy.

    Attributes
    ----------
    scene : BakedScene
        Light map, arrived probes and light by group from the copy, in the units of the shown scene. Before the light
        map arrives, `arrived.region` holds a part of it.
    texel_object : (H, W) int64
        Index of the object of each texel of the light map; the number of objects for texels without one.
    arrived : Arrived
    lit : bool array
        By object index, whether all of its texels have arrived.
    """

    scene: BakedScene
    texel_object: Indices
    arrived: Arrived
    lit: Flags

    @classmethod
    def read(
        cls, copy: Path, shown: BakedScene, arrived: Arrived, before: Rebaked | None = None, *, lamps: bool = False
    ) -> Rebaked:
        """Read the arrived light from the copy into memory, except light that was read `before`.

        With `lamps` that were edited, regions do not count: they do not say what they hold of lamps' direct light.
        In memory it is safe from another bake, which may change the copy.
        """
        texel_object = texel_objects(shown) if before is None else before.texel_object
        count = len(shown.record.objects)
        if not arrived.light_map:
            lit = np.ones(count + 1, bool)
            if arrived.region is not None and not lamps:
                lit[texel_object[~arrived.region.finished]] = False
            else:
                lit[:] = False
            return cls(replace(shown, probes={}), texel_object, arrived, lit[:count])
        store = Store.open(copy)
        known = before is not None and before.arrived.light_map
        scene = before.scene if before is not None and known else _with_light_map(store, shown, lamps)
        groups = None if scene.groups is None else replace(scene.groups, store=store)
        probes = dict(scene.probes)
        for name in shown.probes:
            if name not in probes and arrived.has_probe(name, by_group=groups is not None):
                probes[name] = read_probe(store, name, shown.unit)
                if groups is not None:
                    groups.probe(name)  # caches it
        return cls(replace(scene, probes=probes, groups=groups), texel_object, arrived, np.ones(count, bool))

    def layers(self, light: Factors, shown: Layers) -> Layers:
        """Layers (H, W, 4), as in `resources.light_layers`, for a light mix; `shown` for texels without new light."""
        scene, groups, region = self.scene, self.scene.groups, self.arrived.region
        if not self.arrived.light_map:
            if region is None or not self.lit.any():
                return list(shown)
            factors = np.ones((len(region.light), 3), np.float32) if groups is None else groups.factors(light)
            front = np.einsum("nhwc,nc->hwc", region.light.astype(np.float32), factors / np.float32(scene.unit))
            there = np.append(self.lit, False)[self.texel_object][..., None]
            return [np.where(there, light_layers(front, None)[0], shown[0]), *shown[1:]]
        sides = [scene.irradiance, scene.irradiance_back]
        if groups is not None:
            mixed = GroupLight(scene, groups).light_map(groups.factors(light))
            sides = [None if side is None else side[..., :3] for side in mixed]
        return list(light_layers(sides[0], sides[1], scene.dominant_direction, scene.probe_share))

    def probe(self, name: str, light: Factors) -> Probe | None:
        """An object's probe without the sun's disc, for a light mix; None before it has arrived."""
        scene, groups = self.scene, self.scene.groups
        found = scene.probes.get(name)
        if found is None:
            return None
        by_group = None if groups is None else GroupLight(scene, groups).probe(name, groups.factors(light))
        return by_group or without_sun(found, scene.sun, scene.unit)


@dataclass(frozen=True, eq=False, kw_only=True)
class RelitGroups(GroupArrays):
    """Light by group whose light map is changed, by side, by `change` (n, H, W, 3)."""

    change: Sequence[Floats]

    @cached_property
    def sides(self) -> tuple[Floats | None, ...]:
        """Light maps by group, float32; None for a side without light."""
        both = zip_longest(super().sides, self.change, fillvalue=None)
        return tuple(
            side if more is None else np.maximum((0 if side is None else side) + more, 0) for side, more in both
        )


def _with_light_map(store: Store, shown: BakedScene, lamps: bool) -> BakedScene:
    """The shown scene with the light map of a store, without probes; of edited `lamps`, it holds what `shown` does."""
    scale = np.float32(1 / shown.unit)
    front, back = (finite(store.read(name))[0] * scale if name in store else None for name in map(light_name, SIDES))
    direction = store.read(DOMINANT_DIRECTION) if DOMINANT_DIRECTION in store else None
    groups, now = groups_in(store, shown.unit), read_lamps(store, shown.unit) if lamps else None
    if now is not None and shown.lamps is not None:
        both = zip(shown.lamps.light, now.light, strict=True)
        change = [of_shown - of_store for of_shown, of_store in both]
        front, back = (
            side if side is None or k >= len(change) else np.maximum(side + change[k].sum(axis=0), 0)
            for k, side in enumerate((front, back))
        )
        groups = groups and RelitGroups(groups.records, groups.store, groups.unit, change=change)
    if groups is not None:
        _ = groups.lit_sides  # read into memory
    return replace(
        shown,
        irradiance=front,
        irradiance_back=back,
        dominant_direction=direction,
        probes={},
        groups=groups,
    )


def light_name(side: str) -> str:
    """Name of the array of a side of the light map."""
    return f"light_map/{side}"


def texel_objects(scene: BakedScene) -> Indices:
    """(H, W) index of the object on each texel of the light map; the number of objects for texels without one."""
    assert scene.irradiance is not None, "there is a light map"
    height, width = scene.irradiance.shape[:2]
    geometry: dict[str, Any] = {"positions": scene.positions, "faces": scene.faces, "uv2": scene.uv2}
    pieces = pieces_of(geometry, width, height, reach=REACH)
    owner = np.zeros(len(scene.faces), np.int64)
    for number, record in enumerate(scene.record.objects):
        owner[record.first_face : record.first_face + record.face_count] = number
    found = np.full(height * width, len(scene.record.objects), np.int64)
    order = np.argsort(pieces.area, kind="stable")  # the largest piece of a texel wins
    found[pieces.cell[order]] = owner[pieces.face[order]]
    return found.reshape(height, width)


def in_view_order(record: SceneRecord, camera: Camera, size: tuple[int, int]) -> list[int]:
    """Indices of the objects: objects in view first, each group sorted by distance."""
    across, up, forward = image_plane(camera, *size)

    def place(o: ObjectRecord) -> tuple[bool, float]:
        low, high = np.array(o.bounds)
        nearest = np.clip(camera.position, low, high) - np.array(camera.position)
        corners = np.array([[(low, high)[(k >> axis) & 1][axis] for axis in range(3)] for k in range(8)])
        rays = np.concatenate([corners, [(low + high) / 2]]) - np.array(camera.position)
        return not _meets(rays, across, up, forward), float(np.linalg.norm(nearest))

    return sorted(range(len(record.objects)), key=lambda number: place(record.objects[number]))


def _meets(rays: Floats, across: Floats, up: Floats, forward: Floats) -> bool:
    """Whether a box with corners along these rays (n, 3) may be in the picture."""
    depth = rays @ forward / (forward @ forward)
    x, y = rays @ across / (across @ across), rays @ up / (up @ up)
    beyond = [depth <= 0, x > depth, x < -depth, y > depth, y < -depth]
    return not any(side.all() for side in beyond)


def texel_steps(before: Layers, after: Layers, batch: Indices) -> Iterator[Layers]:
    """Light maps, frame by frame, in which one batch of texels (H, W) after the other is blended to `after`.

    The last one equals `after` bit for bit.
    """
    last = STAGGER * int(batch.max()) + FADE_STEPS
    for frame in range(1, last):
        share = np.clip((frame - STAGGER * batch) / FADE_STEPS, 0, 1).astype(np.float32)[..., None]
        share = share * share * (3 - 2 * share)  # smoothstep
        yield [_between(a, b, share) for a, b in zip(before, after, strict=True)]
    yield after


def _between(a: NDArray[np.float16], b: NDArray[np.float16], share: Floats) -> NDArray[np.float16]:
    wide = a.astype(np.float32)
    return np.asarray(wide + (b - wide) * share, np.float16)


def batches_of(texel_object: Indices, order: Sequence[int], objects: int) -> Indices:
    """(H, W) batch in which each texel is blended; texels of no object in `order` come last."""
    count = len(order)
    rank = np.full(objects + 1, min(count, MOST_BATCHES) - 1 if count else 0)
    for place, number in enumerate(order):
        rank[number] = place * min(count, MOST_BATCHES) // count
    return np.asarray(rank[texel_object])


def steps(
    rebaked: Rebaked,
    since: Rebaked | None,
    shown: BakedScene,
    resources: SceneResources,
    light: Factors,
    camera: Camera,
    size: tuple[int, int],
) -> Iterator[Step]:
    """All uploads of light that arrived `since`, in order, one per frame. Iterate in a thread: each takes a while."""
    order = in_view_order(shown.record, camera, size)
    if _has_more_texels(rebaked, since):
        before = list(resources.light_layers)
        after = rebaked.layers(light, before)
        there = [number for number in order if rebaked.lit[number]]
        for layers in texel_steps(before[: len(after)], after, batches_of(rebaked.texel_object, there, len(order))):
            yield _uploads_map(layers)
    for owner, users in probe_users(shown, resources, order).items():
        found = None if since is not None and owner in since.scene.probes else rebaked.probe(owner, light)
        if found is None:
            continue
        old, new = users[0].light, finite(found.radiance)[0]
        was = finite(old.probe.radiance)[0]
        for step in range(1, PROBE_STEPS + 1):
            between = new if step == PROBE_STEPS else was + (new - was) * np.float32(step / PROBE_STEPS)
            yield _relights(users, old.relit(between, found.irradiance))


def _has_more_texels(rebaked: Rebaked, since: Rebaked | None) -> bool:
    """Whether more of the light map has arrived than in `since`: all of it, or texels of further objects."""
    if rebaked.arrived.light_map:
        return since is None or not since.arrived.light_map
    return bool((rebaked.lit if since is None else rebaked.lit & ~since.lit).any())


def _uploads_map(layers: Layers) -> Step:
    return lambda resources: resources.show_light_map(layers)


def _relights(users: Sequence[ObjectResources], light: ProbeLight) -> Step:
    def upload(_: SceneResources) -> None:
        for item in users:
            item.relight(light, item.emission)

    return upload


def probe_users(
    shown: BakedScene, resources: SceneResources, order: Sequence[int]
) -> Mapping[str, list[ObjectResources]]:
    """Objects that show each probe, by its owner, in the order of their first object."""
    names = {id(probe.radiance): name for name, probe in shown.probes.items()}
    found: dict[str, list[ObjectResources]] = {}
    for number in order:
        item = resources.objects[number]
        probe = shown.probe_of(item.record)
        owner = None if probe is None else names.get(id(probe.radiance))
        if owner is not None:
            found.setdefault(owner, []).append(item)
    return found
