"""Probes: the surroundings of each object from one point, and their bounding planes."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from lambent.baking.artefacts.light_map import finished_groups, finished_maps
from lambent.baking.context import BakeContext
from lambent.baking.engine import engine
from lambent.baking.methods import ProbeMethod, sorts_light
from lambent.baking.probes.division import HIDDEN
from lambent.baking.quality import QualityName
from lambent.baking.running.keys import geometry_inputs, key_of
from lambent.baking.running.tiles import seed_of
from lambent.baking.surfaces.backs import backs_of
from lambent.core.plain import first_of
from lambent.scenes.looks.variants import documents_of
from lambent.store.contract import SHARED_PROBES, needs_probe, probe_name, shared_probes
from lambent.store.store import Store

if TYPE_CHECKING:
    from lambent.baking.probes.sharing import Sharing

KIND = "probe"
NEEDS = ("geometry", "light_map")
REVISION = 7
HELD = "held"  # key in the document of shared probes: objects that no probe leaves out
SHARING = "sharing"  # the step that assigns shared probes
PARTS = ("radiance", "distance", "planes")
GROUPS = "groups"  # an additional part if light is separated
TOO_FEW = "one probe does not see all that the object mirrors: %s"
MISSED = "{} ({:.0f} % hidden, a tenth of its look-ups {:.0f} degrees or more off)"
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Settings:
    """Cube maps of `texels` along a side of a face.

    Texels get `samples` paths, and up to sixteen times as many until their noise is below `noise`.
    """

    texels: int
    samples: int
    noise: float = 0.14


SETTINGS = {
    QualityName.preview: Settings(128, 16),
    QualityName.normal: Settings(256, 16, 0.1),
    QualityName.final: Settings(256, 64, 0.05),
}


def keys(context: BakeContext) -> dict[str, str]:
    how: Settings = context.settings(KIND)
    scene, light = context.scene, context.keys("light_map")["light_map/irradiance"]
    owners, backs, found = _owners(context), backs_of(context.store), dict[str, str]()
    for name in _objects(context):
        if name in owners:
            continue
        inputs = [light, name, scene.probe_centres.get(name), how.texels, how.samples, how.noise, context.seed]
        if others := sharing(owners, name):
            inputs += [*others, "mirrored together"]
        if staying := sorted({name, *others} & _held(context.store)):
            inputs += [*staying, "not left out"]
        if name in backs:
            inputs.append("from both sides")
        if not cached(context):
            inputs += [context.methods["probes"], context.settings("light_map").max_depth]
        key = key_of(KIND, REVISION, *inputs)
        given = scene.probe_planes.get(name)
        of_planes = key_of(KIND, REVISION, key, None if given is None else np.asarray(given, float))
        found |= {probe_name(name, part): of_planes if part == "planes" else key for part in _parts(context)}
    return found


def bake(context: BakeContext) -> None:
    stale, how, owners, parts = context.stale(KIND), context.settings(KIND), _owners(context), _parts(context)
    missing = [name for name in _objects(context) if stale & {probe_name(name, part) for part in parts}]
    context.store.forget(probe_name(name, part) for name in owners for part in (*PARTS, GROUPS))
    context.watch.arrived(KIND, context.keys(KIND).keys() - stale)
    from lambent.baking.probes.probe_set import Lit, ProbeJob, ProbeSet

    sorts = sorts_light(context.methods)
    lit = Lit(by_group=sorts)
    if cached(context):
        lit = Lit(*finished_maps(context), sorts, *(finished_groups(context) if sorts else ()))
    depth = context.settings("light_map").max_depth
    probes = ProbeSet(context.traced, lit, depth, backs_of(context.store), _held(context.store))
    poor: list[tuple[float, str]] = []  # hidden share, and its words
    effort = how.texels, how.samples, how.noise
    jobs = (ProbeJob(name, *effort, seed_of(context.seed, "probe", name), sharing(owners, name)) for name in missing)
    context.progress(0, len(missing), "probes")
    for done, (job, (result, meta)) in enumerate(context.workers.each(probes, jobs), 1):
        name = job.name
        if meta["hidden_share"] > HIDDEN:
            poor.append((meta["hidden_share"], MISSED.format(name, 100 * meta["hidden_share"], meta["parallax_deg"])))
        for part in parts:
            context.put(KIND, probe_name(name, part), result[part], context.provenance(**meta))
        context.watch.arrived(KIND, [probe_name(name, part) for part in parts])
        context.progress(done, len(missing), f"probe of {name}")
    if poor:
        log.warning(TOO_FEW, first_of([words for _, words in sorted(poor, reverse=True)]))


def _parts(context: BakeContext) -> tuple[str, ...]:
    return (*PARTS, GROUPS) if sorts_light(context.methods) else PARTS


def sharing(owners: Mapping[str, str], name: str) -> tuple[str, ...]:
    """The objects that show the probe of object `name`."""
    return tuple(sorted(other for other, owner in owners.items() if owner == name))


def _owners(context: BakeContext) -> dict[str, str]:
    """Owner of the shown probe, by object without its own; recomputed only if geometry or materials changed.

    Empty before the geometry is baked, because viewers are searched in it.
    """
    scene, names, store = context.scene, _objects(context), context.store
    if not names or context.stale("geometry"):
        return {}
    given = [sorted(scene.probe_centres), sorted(scene.probe_planes)]
    materials = [scene.materials[scene.object(name).material] for name in names]
    look = [(m.transmits, [(lobe.mx, lobe.my) for lobe in m.lobes]) for m in materials]
    lamps = [o.name for o in scene.objects if any(o.emission)]
    key = key_of(SHARED_PROBES, 8, names, look, given, lamps, *geometry_inputs(scene))
    said = store.documents.get(SHARED_PROBES)
    if not isinstance(said, dict) or said.get("key") != key:
        with context.timed(SHARING):
            found = _shared(context, names)
        store.set_document(SHARED_PROBES, {"key": key, "owners": found.owners, HELD: sorted(found.held)})
    return shared_probes(store)


def _held(store: Store) -> frozenset[str]:
    """Names of the objects that no probe leaves out."""
    return frozenset(store.documents.get(SHARED_PROBES, {}).get(HELD, []))


def _shared(context: BakeContext, names: list[str]) -> Sharing:
    engine()  # before Mitsuba is imported
    from lambent.baking.probes.sharing import shared

    traced, how = context.traced, {"diffuse": not cached(context)}
    return shared(traced.builder(**how), traced.whole(**how), traced.places, names)


def cached(context: BakeContext) -> bool:
    """Whether paths of probes and light fields end at the light map."""
    return context.methods["probes"] == ProbeMethod.cached


def _objects(context: BakeContext) -> list[str]:
    """Names of the objects that need a probe, with their materials or those of a variant."""
    scene = context.scene
    return [o.name for o in scene.objects if any(map(needs_probe, documents_of(scene, o.material)))]
