"""The light map: irradiance on both sides of surfaces, its noise, and the dominant direction of its light.

Samples stay in the store as `light_map/traced`, `gathered`, `photons` and `leaning`: an interrupted bake continues with
them, and the noise is estimated from them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from lambent.baking.context import BakeContext
from lambent.baking.methods import LightMapMethod, sorts_light
from lambent.baking.quality import MAX_DEPTH, QualityName
from lambent.baking.running.keys import group_inputs, key_of, light_inputs, material_inputs
from lambent.baking.running.tiles import run_jobs
from lambent.baking.surfaces.backs import backs_of
from lambent.core.arrays import Flags, Floats, Indices
from lambent.scenes.panes import panes_of
from lambent.scenes.scene import ConstantEnvironment, DirectionalLight, Scene
from lambent.store.contract import DOMINANT_DIRECTION, SIDES, noise_name
from lambent.store.light_groups import group_name
from lambent.store.store import Writer

if TYPE_CHECKING:
    from lambent.baking.light.groups import GroupMaps
    from lambent.baking.light.tiles import Stage
    from lambent.baking.photons.maps import PhotonMap
    from lambent.baking.tracing.lights.lit_texels import SentLight

KIND = "light_map"
NEEDS = ("geometry",)
REVISION, REVISION_OF_IRRADIANCE, REVISION_OF_SUN, REVISION_OF_PANES, REVISION_OF_GROUPS = 5, 9, 3, 1, 1
REVISION_OF_DIRECT, REVISION_OF_PARTS, REVISION_OF_LAMPS = 4, 3, 1
IRRADIANCE = tuple(f"light_map/{side}" for side in SIDES)
NOISE = tuple(noise_name(side) for side in SIDES)
TRACED, GATHERED = (f"light_map/{stage}" for stage in ("traced", "gathered"))
PHOTONS, MOMENTS = "light_map/photons", "light_map/leaning"
SIGNS = (1.0, -1.0)  # of the normal, by side
Maps = list[tuple[Floats, dict[str, float]]]  # by side: irradiance (H, W, 3) and its notes


@dataclass(frozen=True)
class Settings:
    """Samples per texel, and bounces.

    Tiles get path traced samples until their relative noise (root mean square, before denoising) is below `noise`,
    within the bounds `samples`. With `gather_samples`, that map only lights the first bounce of a second, final map,
    which gathers that many samples per texel, or as many as bring a tile below `gather_noise`, at a fraction of the
    noise. A photon map takes `photons_per_texel`, averaged over the map, without gathering. Maps are sampled and stored
    in tiles of `tile_texels` per side, the most that an interruption costs.
    """

    samples: tuple[int, int]
    noise: float
    max_depth: int
    gather_samples: int = 0
    photons_per_texel: int = 64
    gather_noise: float = 0.0
    tile_texels: int = 256


SETTINGS = {
    QualityName.preview: Settings((32, 32), 0.30, MAX_DEPTH, gather_samples=128),
    QualityName.normal: Settings(
        (64, 192), 0.15, MAX_DEPTH, gather_samples=512, photons_per_texel=512, gather_noise=0.04
    ),
    QualityName.final: Settings((256, 8192), 0.015, MAX_DEPTH, photons_per_texel=4096),
}


def keys(context: BakeContext) -> dict[str, str]:
    """All sample arrays share one key; filtered arrays (irradiance, noise, dominant direction) share another."""
    how: Settings = context.settings(KIND)
    effort: list[object] = [how.samples, how.noise, how.gather_samples, how.gather_noise]
    effort += [how.tile_texels, how.max_depth, context.seed]
    if _by_photons(context):
        effort.append([LightMapMethod.photons, how.photons_per_texel])
    elif how.gather_samples:
        effort.append(["gathered from maps, and lit texels", REVISION_OF_IRRADIANCE])
    if may_have_sun(context.scene):
        effort.append(["without the sun", REVISION_OF_SUN])
        if panes_of(context.scene):
            effort.append(["nor the sun through panes", REVISION_OF_PANES])
    if lamps_apart(context):
        effort.append(["lamps by rays", REVISION_OF_LAMPS])
    if backs := sorted(backs_of(context.store)):
        effort.append(["seen from behind", backs])
    grouped = sorts_light(context.methods)
    if grouped:
        effort.append(["by group", REVISION_OF_GROUPS, group_inputs(context.scene)])
    geometry = context.keys("geometry")["geometry/positions"]
    samples = key_of(KIND, REVISION, geometry, material_inputs(context.scene), light_inputs(context.scene), effort)
    filtered = key_of("irradiance", REVISION_OF_IRRADIANCE, samples)
    count = side_count(context)
    names = [*IRRADIANCE[:count], *NOISE[:count]]
    raw = [PHOTONS] if _by_photons(context) else [_of_side(stage, i) for stage in _stages(how) for i in range(count)]
    direct: list[str] = []  # direct light of the last stage
    parts: list[str] = []  # its samples
    if grouped:
        names += map(group_name, SIDES[:count])
        raw += [_parts(_of_side(stage, side)) for stage in _stages(how)[:-1] for side in range(count)]
    if grouped or keeps_direct(context):
        direct += [group_name(side, direct=True) for side in SIDES[:count]]
        parts += [_parts(_of_side(_stages(how)[-1], side)) for side in range(count)]
    if _bumpy_faces(context).any():
        names.append(DOMINANT_DIRECTION)
        raw.append(MOMENTS)
    of_direct, of_parts = (key_of("direct", one, filtered) for one in (REVISION_OF_DIRECT, REVISION_OF_PARTS))
    found = dict.fromkeys(raw, samples) | dict.fromkeys(names, filtered)
    return found | dict.fromkeys(direct, of_direct) | dict.fromkeys(parts, of_parts)


def bake(context: BakeContext) -> None:
    stale = context.stale(KIND)
    if stale - {DOMINANT_DIRECTION, MOMENTS, *NOISE}:
        if sorts_light(context.methods):
            maps = _sorted_maps(context)
        else:
            maps = _photon_maps(context) if _by_photons(context) else _sampled_maps(context)
        sun = context.traced.sun
        left_out = {} if sun is None else {"sun": sun.record.model_dump(mode="json")}
        for name, (irradiance, meta) in zip(IRRADIANCE, maps, strict=False):
            note = context.provenance(integrator=context.methods["light_map"], **left_out, **meta)
            context.put(KIND, name, irradiance, note)
    if stale & {DOMINANT_DIRECTION, MOMENTS}:
        _dominant_direction(context)
    if stale & set(NOISE):
        _noise(context)


def finished_maps(context: BakeContext) -> tuple[Floats, Floats | None]:
    """The stored light map (H, W, 3) of both sides; None for the back if no surface is two-sided."""
    front, *back = (context.store.read(name) for name in IRRADIANCE[: side_count(context)])
    return front, back[0] if back else None


def finished_groups(context: BakeContext) -> tuple[Floats, Floats | None]:
    """The stored light map (n, H, W, 3) of both sides by light group; None for the back if no surface is two-sided."""
    front, *back = (context.store.read(group_name(side)) for side in SIDES[: side_count(context)])
    return front, back[0] if back else None


def keeps_direct(context: BakeContext) -> bool:
    """Whether the light map stores all its direct light separately, light through lobes included.

    Final gathering knows where a path ends: at an emitter, or on cached light.
    """
    return not _by_photons(context) and bool(context.settings(KIND).gather_samples)


def _by_photons(context: BakeContext) -> bool:
    return context.methods["light_map"] == LightMapMethod.photons


def may_have_sun(scene: Scene) -> bool:
    """Whether direct light of a sun would be left out; certain only once the environment's picture is read."""
    constant = scene.environment is None or isinstance(scene.environment, ConstantEnvironment)
    return not constant or any(isinstance(light, DirectionalLight) for light in scene.lights)


def side_count(context: BakeContext) -> int:
    """1, or 2 if some surface has a light map on its back, too."""
    return 2 if any(context.two_sided) else 1


def _stages(how: Settings) -> tuple[str, ...]:
    """Sample arrays of path traced maps, the final map's last."""
    return (TRACED, GATHERED) if how.gather_samples else (TRACED,)


def _of_side(stage: str, side: int) -> str:
    return f"{stage}_back" if side else stage


def _parts(stage: str) -> str:
    """Name of the array of samples of parts for an array of samples."""
    return f"{stage}_by_group"


def _bumpy_faces(context: BakeContext) -> Flags:
    """(T,) faces with a normal map."""
    bumpy = {name for name, textures in context.scene.textures.items() if textures.normal}
    objects = context.scene.objects
    return np.repeat([o.material in bumpy for o in objects], [len(o.mesh.faces) for o in objects])


def _sampled_maps(context: BakeContext) -> Maps:
    from lambent.baking.light.direct import direct_part
    from lambent.baking.light.sampling import SMOOTH, finished, plus, sampled_halves, variance_of
    from lambent.baking.light.tiles import gathered, path_traced
    from lambent.baking.tracing.group_tally import Direct

    def maps(name: str, stage: Stage) -> Maps:
        stage, found = replace(stage, sent=_sent(context, stage)), []
        for side in range(side_count(context)):
            raw, labels = _samples(context, name, side, stage)
            context.progress(0, 1, "denoising")
            light, notes = finished(raw, context.traced.texels, labels, context.traced.cuts)
            lamps = lamp_light(context, side)
            found.append((plus(light, lamps.sum(axis=0)), notes))
            if stage.direct is not None:
                parts, (halves, known) = context.store.read(_parts(_of_side(name, side)))[0], sampled_halves(raw)
                of_samples = parts, halves.mean(axis=0), variance_of(halves)
                direct = direct_part(*of_samples, light, known, labels, SMOOTH)
                direct = plus(direct[None], lamps.sum(axis=0))
                context.put(KIND, group_name(SIDES[side], direct=True), direct, context.provenance())
        return found

    how: Settings = context.settings(KIND)
    first = maps(TRACED, path_traced(how.samples, how.noise, how.max_depth))
    if not how.gather_samples:
        return first
    back = first[1][0] if len(first) > 1 else None
    stage = gathered(how.gather_samples, how.gather_noise, how.max_depth, (first[0][0], back))
    return maps(GATHERED, replace(stage, direct=Direct.uncached))


def _sorted_maps(context: BakeContext) -> Maps:
    """The light map of each side as the sum of the maps of light groups, which are stored as well."""
    from lambent.baking.light.groups import finished_groups, group_notes
    from lambent.baking.light.tiles import gathered, path_traced
    from lambent.baking.tracing.group_tally import Direct

    how: Settings = context.settings(KIND)
    traced, count = context.traced, len(context.traced.sorted_lights.groups)

    def maps(name: str, stage: Stage, direct: Direct | None) -> list[GroupMaps]:
        stage, found = replace(stage, by_group=True, direct=direct, sent=_sent(context, stage)), []
        for side in range(side_count(context)):
            raw, labels = _samples(context, name, side, stage)
            by_group = context.store.read(_parts(_of_side(name, side)))[0]
            one = finished_groups(raw, by_group, count, traced.texels, labels, traced.cuts, context.progress)
            found.append(one.plus(lamp_light(context, side)))
        return found

    last = how.gather_samples == 0
    direct = Direct.straight if last else None
    found = maps(TRACED, path_traced(how.samples, how.noise, how.max_depth), direct)
    if not last:
        lit = found[0].light, found[1].light if len(found) > 1 else None
        found = maps(GATHERED, gathered(how.gather_samples, how.gather_noise, how.max_depth, lit), Direct.uncached)
    notes = context.provenance(groups=group_notes(traced, found[0].light))
    for side, one in zip(SIDES, found, strict=False):
        assert one.direct is not None, "the last stage has it"
        context.put(KIND, group_name(side), one.light, notes)
        context.put(KIND, group_name(side, direct=True), one.direct, notes)
    return [(one.whole, one.notes) for one in found]


def _samples(
    context: BakeContext, stage_name: str, side: int, stage: Stage, faces: Flags | None = None
) -> tuple[Floats, Indices]:
    """Samples of one side (2, H, W, 4), on `faces` (T,) if given, and the charts that viewers see (H, W).

    The store also receives samples of parts, (1, H, W, 3 parts), averaged over both halves.
    """
    from lambent.baking.light.groups import BothWriters
    from lambent.baking.light.sampling import TexelJob
    from lambent.baking.light.tiles import TileSampler

    tile, traced, name = context.settings(KIND).tile_texels, context.traced, _of_side(stage_name, side)
    texels = traced.texels
    whole = context.samples(KIND, name, (2, texels.height, texels.width, 4), (2, tile, tile, 4))
    writer: Writer | BothWriters = whole
    if parts := stage.parts(traced):
        channels = 3 * parts
        shape, chunk = (1, texels.height, texels.width, channels), (1, tile, tile, channels)
        writer = BothWriters(whole, context.samples(KIND, _parts(name), shape, chunk))
    traced.whole(diffuse=stage.diffuse)
    sides, labels = traced.in_view(SIGNS[side])
    if faces is not None:
        sides = replace(sides, valid=sides.valid & faces[texels.face])
    if writer.missing:
        lamps = lamp_light(context, side).sum(axis=0) if lamps_apart(context) else None
        covered = np.zeros(texels.width * texels.height, bool)
        covered[texels.index[sides.valid.any(axis=1)]] = True
        of_map = covered.reshape(texels.height, texels.width)
        run_jobs(
            writer,
            TileSampler(traced, stage),
            lambda region, seed: TexelJob.of(sides, region, seed, lamps),
            context.workers,
            seed=context.seed,
            progress=context.progress,
            what=f"light map, {stage_name.removeprefix('light_map/')}" + (", far sides" if side else ""),
            cost=lambda region: 1 + float(of_map[region[1], region[2]].sum()),
            wrote=_regions(context, stage_name, side, labels),
        )
    writer.finish()
    return context.store.read(name), labels


def lamps_apart(context: BakeContext) -> bool:
    """Whether light of lamps is computed apart from samples, as renderers draw it."""
    return not _by_photons(context) and bool(context.scene.lamps)


def _sent(context: BakeContext, stage: Stage) -> SentLight | None:
    """What texels send under the maps of a stage, or in direct light."""
    from lambent.baking.tracing.sent_light import sent_light

    context.traced.whole(diffuse=stage.diffuse)
    sides = range(side_count(context))
    maps = [lamp_light(context, side) for side in sides] if stage.lit is None else stage.lit[: len(sides)]
    of_sides = [context.traced.in_view(SIGNS[side])[0] for side in sides]
    return sent_light(context.traced, of_sides, maps, whole=stage.lit is not None, diffuse=stage.diffuse)


def lamp_light(context: BakeContext, side: int) -> Floats:
    """Direct light (G, H, W, 3) of lamps on a side, by light group, which samples do not have; 0 if none."""
    if not lamps_apart(context):
        return np.zeros((1, 1, 1, 3), np.float16)
    return context.traced.lamp_light(SIGNS[side]).light


def _regions(context: BakeContext, stage: str, side: int, labels: Indices) -> Callable[[], None]:
    """Callback that shows a watch finished regions of light: samples of the last stage, on the front."""
    from lambent.baking.light.regions import FinishedRegions

    if context.watch.region_pause is None or side or stage != _stages(context.settings(KIND))[-1]:
        return lambda: None
    traced, groups = context.traced, 0
    if sorts_light(context.methods):
        groups = len(traced.sorted_lights.groups)
    surface, lamps = (traced.texels, labels, traced.cuts), lamp_light(context, side)
    return FinishedRegions(context.watch, context.store, stage, _parts(stage), groups, surface, lamps).wrote


def _photon_maps(context: BakeContext) -> Maps:
    how: Settings = context.settings(KIND)
    whole = context.traced.whole(diffuse=True, photons=True)
    photon_map = _photon_map(context)
    writer = context.samples(KIND, PHOTONS, photon_map.shape, photon_map.chunk)
    if writer.missing:
        photon_map.shoot(
            writer, context.traced.scene, whole, context.progress, per_texel=how.photons_per_texel, noise=how.noise,
            max_bounces=how.max_depth, seed=context.seed, unseen=context.traced.sun,
        )  # fmt: skip
    writer.finish()
    context.progress(0, 1, "denoising")
    return photon_map.finished(context.store.read(PHOTONS), context.traced.labels, context.traced.cuts)


def _photon_map(context: BakeContext) -> PhotonMap:
    from lambent.baking.photons.maps import PhotonMap

    return PhotonMap(context.geometry, [context.traced.lit_sides(sign) for sign in SIGNS[: side_count(context)]])


def _dominant_direction(context: BakeContext) -> None:
    from lambent.baking.light.dominant_direction import dominant_direction, moments

    front, back = finished_maps(context)
    stage = moments((front, back), context.settings(KIND).max_depth)
    raw, _ = _samples(context, MOMENTS, 0, stage, _bumpy_faces(context))
    sampled = np.maximum(front - lamp_light(context, 0).sum(axis=0, dtype=np.float32), 0)
    found = dominant_direction(raw, sampled, context.traced.labels)
    context.put(KIND, DOMINANT_DIRECTION, found, context.provenance())


def _noise(context: BakeContext) -> None:
    """Estimate noise per texel from the stored samples."""
    from lambent.baking.light.noise import noise_map
    from lambent.baking.light.sampling import sampled_halves

    context.progress(0, 1, "noise of the light map")
    halves: Iterable[tuple[Floats, Flags]]
    if _by_photons(context):
        halves = _photon_map(context).halves(context.store.read(PHOTONS))
    else:
        raw = (_of_side(_stages(context.settings(KIND))[-1], side) for side in range(side_count(context)))
        of_samples = (sampled_halves(context.store.read(name)) for name in raw)
        lamps = (lamp_light(context, side).sum(axis=0, dtype=np.float32) for side in range(side_count(context)))
        halves = ((both + light, known) for (both, known), light in zip(of_samples, lamps, strict=True))
    for name, (both, known) in zip(NOISE, halves, strict=False):
        context.put(KIND, name, noise_map(both, known, context.traced.labels), context.provenance())
