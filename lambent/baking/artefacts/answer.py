"""Arrays from which indirect light follows edits of materials: see `baked.answering`, `stored` and `answer`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lambent.baked.answering.delta_bytes import delta_bytes
from lambent.baked.answering.rays import Rays
from lambent.baked.answering.stored import DIRECT, NO_PATCH, answer_name, probe_spots_name
from lambent.baking.artefacts.light_map import (
    IRRADIANCE,
    SIGNS,
    finished_groups,
    finished_maps,
    keeps_direct,
    lamp_light,
    side_count,
)
from lambent.baking.artefacts.probe import sharing
from lambent.baking.context import BakeContext
from lambent.baking.methods import sorts_light
from lambent.baking.quality import QualityName
from lambent.baking.running.keys import key_of
from lambent.baking.running.tiles import run_jobs, run_tiles
from lambent.core.arrays import Flags, Floats, Indices
from lambent.store.contract import SIDES, probe_name, shared_probes
from lambent.store.light_groups import group_name
from lambent.store.store import Writer

if TYPE_CHECKING:
    from lambent.baking.answering.patches import Clusters
    from lambent.baking.answering.points import GatherPoints
    from lambent.baking.answering.rays import RayEnds
    from lambent.baking.answering.spots import Spots

KIND = "answer"
NEEDS = ("geometry", "light_map", "probe")
REVISION = 11
TRACED = tuple(answer_name(part) for part in ("traced", "traced_back"))
MAPS = tuple(answer_name(part) for part in DIRECT)
PATCH = ("patch", "patch_material", "patch_paired", "patch_direct")
RAYS = ("rays", "receiver_rays")
POINTS = ("points", "point_sun", "point_direct", "point_light", "point_other", "texels", "near", "shares")
BETWEEN = ("transfer", *RAYS, *POINTS)
SEEN = ("spots", "tint", "sun")
TILES = 16  # tiles of rays


@dataclass(frozen=True)
class Settings:
    """Patches, and samples for direct and gathered light.

    If the light map keeps no direct light, texels get `direct_samples` of it; if light is separated by group, light
    through lobes takes `lobe_samples`. Each block of `block` x `block` texels gathers with `gather_rays`, which start
    all over it; points near contacts, which do not send, trace half as many and keep `receiver_rays` of these.
    """

    patches: int = 1000
    gather_rays: int = 192
    receiver_rays: int = 64
    block: int = 4
    direct_samples: int = 32
    lobe_samples: int = 8
    importance_rays: int = 16


SETTINGS = {
    QualityName.preview: Settings(),
    QualityName.normal: Settings(block=8, direct_samples=64, lobe_samples=16),
    QualityName.final: Settings(gather_rays=512, receiver_rays=128, block=12, direct_samples=256, lobe_samples=64),
}


def keys(context: BakeContext) -> dict[str, str]:
    how: Settings = context.settings(KIND)
    of_map, ready = context.keys("light_map"), keeps_direct(context)
    light = [of_map[name] for name in (IRRADIANCE[0], group_name(SIDES[0], direct=True)) if name in of_map]
    count = side_count(context)
    samples = 0 if ready else how.lobe_samples if sorts_light(context.methods) else how.direct_samples
    effort = [how.patches, how.gather_rays, how.receiver_rays, how.block, samples, how.importance_rays]
    key = key_of(KIND, REVISION, light, effort, context.seed)
    sampled = () if ready else TRACED[:count]
    by_group = map(_by_group, sampled) if sorts_light(context.methods) else ()
    found = dict.fromkeys((*sampled, *by_group, *(() if ready else MAPS[:count])), key)
    by_object = [(o.name, o.material) for o in context.scene.objects]  # each patch has one material, by name
    found |= dict.fromkeys(map(answer_name, (*PATCH, *BETWEEN)), key_of(KIND, REVISION, key, by_object))
    of_probes = context.keys("probe")
    for o in context.scene.objects:
        if radiance := of_probes.get(probe_name(o.name, "radiance")):
            found |= {probe_spots_name(o.name, part): key_of(KIND, REVISION, key, radiance) for part in SEEN}
    return found


def _by_group(name: str) -> str:
    """Name of the array of samples by light group for an array of samples."""
    return f"{name}_by_group"


def bake(context: BakeContext) -> None:
    from lambent.baking.answering.rays import RayEnds

    stale = context.stale(KIND)
    if stale & {*TRACED, *MAPS, *map(answer_name, (*PATCH, *BETWEEN))}:
        directs = [_direct(context, side) for side in range(side_count(context))]
        spots = _spots(context, directs)
        ends = RayEnds(context.traced)
        clusters = _clusters(context, ends, spots)
        _between(context, ends, spots, clusters)
    _seen_by_probes(context, stale)


def _direct(context: BakeContext, side: int) -> Floats:
    """Direct light (G, H, W, 3) of a side by group, at most that of the light map.

    Light that arrives through lobes alone counts as direct.
    """
    if not keeps_direct(context) and MAPS[side] in context.stale(KIND):
        lit = _lit(context)[side]
        direct = _sampled_direct(context, side, lit)
        if not sorts_light(context.methods):  # else the light map's own has it
            direct = direct + lamp_light(context, side).sum(axis=0)
        direct = np.minimum(direct, np.asarray(lit, np.float16))
        context.put(KIND, MAPS[side], direct, context.provenance())
    return np.asarray(context.store.read(_direct_name(context, side)))


def _direct_name(context: BakeContext, side: int) -> str:
    """Name of the array of a side's direct light: the light map's, if it keeps all of it."""
    return group_name(SIDES[side], direct=True) if keeps_direct(context) else MAPS[side]


def _sampled_direct(context: BakeContext, side: int, lit: Floats) -> Floats:
    """Direct light (G, H, W, 3) of a side, sampled for a light map `lit` (G, H, W, 3) that keeps none."""
    from lambent.baking.light.direct import cleaned_direct
    from lambent.baking.light.sampling import closed, sampled_halves

    labels = _direct_samples(context, side)
    halves, known = sampled_halves(context.store.read(TRACED[side]))
    if sorts_light(context.methods):
        clean = _direct_by_group(context, side, lit, known, labels)
    else:
        clean = cleaned_direct(halves, known, lit[0], labels)[None]
    if not known.any():
        return clean
    return closed(clean, known, context.traced.texels, labels, context.traced.cuts)  # as in the light map


def _lit(context: BakeContext) -> list[Floats]:
    """All light (G, H, W, 3) by group, for each side of the light map."""
    if sorts_light(context.methods):
        return [light for light in finished_groups(context) if light is not None]
    return [light[None] for light in finished_maps(context) if light is not None]


def _direct_by_group(context: BakeContext, side: int, lit: Floats, known: Flags, labels: Indices) -> Floats:
    """Direct light (G, H, W, 3) of separated light: the light map's own, denoised, plus light through lobes alone."""
    from lambent.baking.light.direct import cleaned_direct

    parts = context.store.read(_by_group(TRACED[side]))[0].reshape(*known.shape, -1, 3)
    whole, straight = np.split(np.moveaxis(parts, 2, 0), 2)
    by_lobes = np.clip(whole - straight, 0, lit.astype(np.float32))
    sent = np.stack(
        [cleaned_direct(np.stack([one, one]), known, light, labels) for one, light in zip(by_lobes, lit, strict=True)]
    )
    straight_map = context.store.read(group_name(SIDES[side], direct=True)).astype(np.float32)
    return np.asarray(straight_map + sent)


def _direct_samples(context: BakeContext, side: int) -> Indices:
    """Sample direct light of a side, by group too; returns the charts that viewers see (H, W)."""
    from lambent.baking.light.groups import BothWriters
    from lambent.baking.light.sampling import TexelJob
    from lambent.baking.light.tiles import Stage, TileSampler
    from lambent.baking.tracing.group_tally import Direct

    how: Settings = context.settings(KIND)
    traced, tile = context.traced, context.settings("light_map").tile_texels
    size = traced.texels.height, traced.texels.width
    whole = context.samples(KIND, TRACED[side], (2, *size, 4), (2, tile, tile, 4))
    writer: Writer | BothWriters = whole
    grouped, depth = sorts_light(context.methods), context.settings("light_map").max_depth
    half = max(1, (how.lobe_samples if grouped else how.direct_samples) // 2)
    # By group: all direct light, and the part straight from emitters.
    direct = Direct.straight if grouped else None
    stage = Stage((2 * half, 2 * half), 0.0, depth, half, by_group=grouped, direct=direct)
    if parts := stage.parts(traced):
        of_parts = context.samples(KIND, _by_group(TRACED[side]), (1, *size, 3 * parts), (1, tile, tile, 3 * parts))
        writer = BothWriters(whole, of_parts)
    traced.whole(diffuse=False)
    sides, labels = traced.in_view(SIGNS[side])
    if writer.missing:
        run_jobs(
            writer, TileSampler(traced, stage), lambda region, seed: TexelJob.of(sides, region, seed), context.workers,
            seed=context.seed, progress=context.progress, what="direct light" + (", far sides" if side else ""),
        )  # fmt: skip
    writer.finish()
    return labels


def _spots(context: BakeContext, directs: list[Floats]) -> Spots:
    from lambent.baking.answering.spots import spots_of

    of_sun = context.traced.sorted_lights.sun if sorts_light(context.methods) else 0
    return spots_of(context.traced, _lit(context), directs, of_sun)


def _clusters(context: BakeContext, ends: RayEnds, spots: Spots) -> Clusters:
    """The stored patches, or new ones."""
    from lambent.baking.answering.patches import Clusters, clustered
    from lambent.baking.answering.transfer import hits_from_viewed, patch_means

    texels, store = context.traced.texels, context.store
    if not context.stale(KIND) & set(map(answer_name, PATCH)):
        patch, material, paired = (store.read(answer_name(part)).astype(np.int64) for part in PATCH[:3])
        of = patch.reshape(2, -1)[:, spots.index]
        return Clusters(np.where(of == NO_PATCH, -1, of), material, paired)
    how: Settings = context.settings(KIND)
    context.progress(0, 1, "patches")
    sides = [context.traced.in_view(sign)[0] for sign in SIGNS[: side_count(context)]]
    hits = hits_from_viewed(ends, spots, sides, how.importance_rays, context.seed)
    found = clustered(spots, hits, how.patches)
    patch = np.full((2, texels.width * texels.height), NO_PATCH, np.uint16)
    patch[:, spots.index] = np.where(found.of >= 0, found.of, NO_PATCH)
    numbers = {"patch_material": found.material, "patch_paired": found.paired}
    for part, values in numbers.items():
        context.put(KIND, answer_name(part), values.astype(np.uint16), context.provenance())
    direct = np.stack([patch_means(spots, found, of_group) for of_group in spots.direct]).astype(np.float32)
    context.put(KIND, answer_name("patch_direct"), direct, context.provenance())
    directs = [_direct_name(context, side) for side in range(len(sides))]
    note = context.provenance(materials=list(context.scene.materials), direct=directs)
    context.put(KIND, answer_name("patch"), patch.reshape(2, texels.height, texels.width), note)
    return found


def _between(context: BakeContext, ends: RayEnds, spots: Spots, clusters: Clusters) -> None:
    """Compute the transfer between patches, and the rays between points."""
    from lambent.baking.answering.points import (
        bounded_points,
        neighbours,
        points_near,
        receiving_points,
        refined_points,
        seeing,
    )
    from lambent.baking.answering.transfer import Between, light_seen, neighbouring_texels, sender_means, transfer_of

    how: Settings = context.settings(KIND)
    width = context.traced.texels.width
    sides = [context.traced.in_view(sign)[0] for sign in SIGNS[: side_count(context)]]
    coarse = bounded_points(spots, width, how.block, clusters.count)
    distance = np.zeros(len(coarse.texel))
    for side, of_side in enumerate(sides):
        mine = np.flatnonzero(coarse.side == side)
        distance[mine] = ends.distance_in_texels(of_side, coarse.texel[mine], how.importance_rays, context.seed)
    exitance = spots.exitance(context.scene)

    def not_blind(of: GatherPoints) -> GatherPoints:
        return seeing(spots, of, light_seen(ends, spots, sides, of, exitance, how.importance_rays // 2, context.seed))

    points = not_blind(refined_points(spots, width, coarse, distance))
    receivers = not_blind(receiving_points(spots, width, coarse, distance, points))
    everyone = points.followed_by(receivers)
    closest = points_near(spots, *neighbours(spots, points))
    codes, near = neighbours(spots, everyone)
    across = closest[1 - points.side, points.texel]
    other = np.where(across >= 0, across, np.arange(len(across)))
    between = Between(ends, spots, sides, closest, exitance, len(points.texel))

    def gather(part: str, of: GatherPoints, starts: Indices, count: int, kept: int, what: str) -> None:
        """Write the rays of points from texels `starts` (n, m): `kept` of `count` rays each."""

        def tile(region: tuple[slice, ...], seed: int) -> NDArray[np.uint8]:
            return np.moveaxis(between.gathered_rays(of[region[1]], starts[region[1]], count, kept, seed), -1, 0)

        name, shape, chunk = answer_name(part), (3, len(of.texel), kept), (3, max(1, -(-len(of.texel) // TILES)), kept)
        key, meta = context.keys(KIND)[name], context.provenance()
        writer = context.store.begin(name, KIND, shape, chunk, "uint8", key=key, meta=meta)
        run_tiles(writer, tile, seed=context.seed, progress=context.progress, what=what)
        writer.finish()

    gather(RAYS[0], points, neighbouring_texels(spots, closest, points), how.gather_rays, how.gather_rays, "gathering")
    of_contacts, kept = max(how.gather_rays // 2, how.receiver_rays), how.receiver_rays
    gather(RAYS[1], receivers, receivers.texel[:, None], of_contacts, kept, "gathering beside contacts")
    sending = Rays.of(np.moveaxis(context.store.read(answer_name("rays")), 0, -1))
    sends = closest >= 0
    areas: Floats = np.broadcast_to(spots.area, closest.shape)[sends]
    area = np.asarray(np.bincount(closest[sends], areas, len(across)), float)
    transfer = transfer_of(sending, clusters.of[points.side, points.texel], area, clusters.count)
    context.put(KIND, answer_name("transfer"), transfer.astype(np.float16), context.provenance())
    own_sun = spots.sun[everyone.side, everyone.texel]
    numbers = spots.index[everyone.texel] * 2 + everyone.side, other, codes, near.points
    of_points, of_other, of_texels, of_near = map(delta_bytes, numbers)
    of_group = (spots.direct, spots.irradiance)
    sent = (np.stack([sender_means(spots, closest, one, len(points.texel)) for one in light]) for light in of_group)
    values = (of_points, own_sun, *(one.astype(np.float32) for one in sent), of_other, of_texels, of_near, near.shares)
    for part, array in zip(POINTS, values, strict=True):
        context.put(KIND, answer_name(part), array, context.provenance())


def _seen_by_probes(context: BakeContext, stale: set[str]) -> None:
    """Store which texels of the light map each probe sees."""
    from lambent.baking.answering.probe_spots import ProbeEyes
    from lambent.baking.probes.division import family

    scene, store = context.scene, context.store
    names = [o.name for o in scene.objects if probe_spots_name(o.name, SEEN[-1]) in stale]
    if not names:
        return
    eyes, owners = ProbeEyes(context.traced), shared_probes(store)
    for number, name in enumerate(names):
        context.progress(number, len(names), f"answer of the probe of {name}")
        radiance = store.artefact(probe_name(name, "radiance"))
        own: set[str] = set()
        if radiance.meta.get("object_left_out", True):
            own = set().union(*(family(scene.parts, one) for one in (name, *sharing(owners, name))))
        spots, tint, sun = eyes.look(np.array(radiance.meta["centre"]), radiance.shape[1], own)
        arrays: tuple[NDArray[Any], ...] = delta_bytes(spots), tint, sun
        for part, values in zip(SEEN, arrays, strict=True):
            context.put(KIND, probe_spots_name(name, part), values, context.provenance())
    context.progress(len(names), len(names), "answer of probes")
