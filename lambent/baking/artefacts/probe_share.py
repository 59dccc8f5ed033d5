"""Directional shares of probes' light, per texel of the light map (`probes.shares`)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from lambent.baking.artefacts.light_map import finished_maps, lamps_apart
from lambent.baking.context import BakeContext
from lambent.baking.running.keys import key_of
from lambent.baking.running.tiles import seed_of
from lambent.core.light.colour import luminance
from lambent.store.contract import needs_probe, probe_irradiance, probe_name, radiance_unit, scene_record, shared_probes
from lambent.store.occlusion import PROBE_SHARE, has_even_niches, occlusion_gain

if TYPE_CHECKING:
    from lambent.baking.probes.shares import Shown

KIND = "probe_share"
NEEDS = ("geometry", "light_map", "probe")
REVISION = 3


def keys(context: BakeContext) -> dict[str, str]:
    probes = context.keys("probe")
    light = context.keys("light_map")["light_map/irradiance"]
    return {PROBE_SHARE: key_of(KIND, REVISION, light, sorted(probes.items()), context.seed)} if probes else {}


def bake(context: BakeContext) -> None:
    from lambent.baking.probes.shares import ShareTracer

    traced, maps = context.traced, finished_maps(context)
    sides, labels = traced.in_view(1.0)
    counts = [len(o.mesh.faces) for o in traced.scene.objects]
    owner = np.repeat(np.arange(len(counts)), counts)[sides.texels.face[:, 0]]
    of_probes = maps[0].astype(np.float32)
    if lamps_apart(context):  # probes do not see them
        of_probes = np.maximum(of_probes - traced.lamp_light(1.0).drawn.sum(axis=0, dtype=np.float32), 0)
    luminous = luminance(of_probes.reshape(-1, 3)[sides.texels.index].astype(float))
    cache, unseen = traced.cache(*maps), traced.unseen(diffuse=False)
    tracer = ShareTracer(traced.bare, cache, sides, owner, luminous, unseen)
    seed = seed_of(context.seed, KIND)
    values, worth = tracer.shares(list(_shown(context)), labels, seed, context.progress)
    names = [traced.scene.objects[number].name for number in worth]
    context.put(KIND, PROBE_SHARE, values, context.provenance(objects=names))


def _shown(context: BakeContext) -> Iterator[Shown]:
    """Opaque objects that show a probe; reflectors look up by distance what their mirrored views miss."""
    from lambent.baking.probes.device_lookup import DeviceProbe
    from lambent.baking.probes.selection import UNSCALED, Scaling, largest_r0, widest_lobe
    from lambent.baking.probes.shares import Shown

    store, scene, owners = context.store, context.scene, shared_probes(context.store)
    reflecting = {part.object for reflector in scene_record(store).reflectors for part in reflector.parts}
    for number, o in enumerate(scene.objects):
        material, whose = scene.materials[o.material], owners.get(o.name, o.name)
        name = probe_name(whose, "radiance")
        if not needs_probe(material) or material.transmits or name not in store:
            continue
        centre = np.array(store.artefact(name).meta["centre"], float)
        planes = store.read(probe_name(whose, "planes")).reshape(-1, 4).astype(float)
        planes[:, 3] += planes[:, :3] @ centre
        by_distance = not len(planes) or o.name in reflecting
        distance = store.read(probe_name(whose, "distance")) if by_distance else None
        radiance = store.read(name).astype(np.float32) * np.float32(radiance_unit(store, name))
        irradiance = np.array(probe_irradiance(store, whose))
        scaling = Scaling(occlusion_gain(store, whose), has_even_niches(store, whose))
        yield Shown(
            number, largest_r0(material), widest_lobe(material), DeviceProbe(centre, radiance, planes, distance),
            irradiance, scaling if len(irradiance) else UNSCALED,
        )  # fmt: skip
