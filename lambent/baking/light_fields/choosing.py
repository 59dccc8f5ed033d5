"""What a bake chooses: trials of the objects whose probes show viewers most that is wrong.

What is wrong with an object is the error of its look-ups times the solid angle that it takes for viewers. Memory goes
where it takes most of that away, until a budget is spent or a megabyte takes away too little of it. A light field is
only taken where it lowers the error by a share WORTH of the probe's, and certainly lowers that at places held out from
the choice, too.
"""

from __future__ import annotations

import logging
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from lambent.baking.light_fields.acquisition import Surroundings
from lambent.baking.light_fields.facing import turned_to_viewers
from lambent.baking.light_fields.placing import Placing
from lambent.baking.light_fields.trial import PROBE, Option, ProbeLight, Trial, options_of, tried
from lambent.baking.light_fields.watched import Watched, watched
from lambent.baking.probes.selection import Scaling
from lambent.baking.running.tiles import seed_of
from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.geometry.triangles import triangle_areas
from lambent.core.light.colour import luminance
from lambent.core.progress import Progress, part_of
from lambent.scenes.scene import Mesh, Scene
from lambent.store.contract import probe_irradiance, probe_name, radiance_unit, scene_record, shared_probes
from lambent.store.occlusion import has_even_niches, occlusion_gain
from lambent.store.store import Store

MOST_WATCHED = 256  # objects whose probes are looked at
REFLECTED = 0.9  # of an object's area, above which no light field is tried: planar reflectors show it
WORTH = 0.05
PER_MB = 0.0001  # of what is wrong with all objects that are tried: what a megabyte takes away at least
CERTAINTY = 2.0  # standard errors by which the error falls at places held out, where noise does not favour the choice
SHARE = 0.0002  # of what is wrong with all objects: those with less are not tried
MOST_TRIED = 48
LEFT_OUT = "light fields: tried on %d of %d shiny objects, the largest and worst; `--light-fields NAME` adds others"
log = logging.getLogger(__name__)


class Chooser:
    """Tries light fields on objects of a scene, whose probes a store holds; viewers stand at `places` (m, 3)."""

    def __init__(
        self, scene: Scene, store: Store, placing: Placing, around: Surroundings, places: Floats, texels: int, seed: int
    ) -> None:
        """`texels` are those along a side of the maps that will be baked."""
        self._scene, self._store, self._texels, self._seed = scene, store, texels, seed
        self._placing, self._around, self._places = placing, around, places

    def trials(self, names: Collection[str], progress: Progress) -> dict[str, Trial]:
        """Trials of those of the objects that are worth one."""
        flat, looks = shown_by_reflectors(self._scene, self._store), dict[str, Watched]()
        curved = [name for name in names if flat.get(name, 0.0) <= REFLECTED]
        largest = look_largest(self._scene, curved, self._places, MOST_WATCHED)
        for i, name in enumerate(largest):
            part_of(progress, 0.0, 0.5, "error of probes")(i, len(largest), "")
            if (seen := self.watched(name)) is not None:
                looks[name] = replace(seen, size_sr=seen.size_sr * (1 - flat.get(name, 0.0)))
        level = usual_level(looks.values())
        wrong = {
            name: seen.size_sr * seen.error(probe_light(self._store, name).seen(seen), level)
            for name, seen in looks.items()
        }
        found, some = dict[str, Trial](), worth_trying(wrong)
        if len(largest) < len(curved) or len(some) == MOST_TRIED < len(wrong):
            log.warning(LEFT_OUT, len(some), len(curved))
        for i, name in enumerate(some):
            part_of(progress, 0.5, 1.0, "trial light fields")(i, len(some), "")
            with suppress(UserError):  # nothing of it is in the open
                found[name] = self.trial(name, looks[name], level)
        return found

    def watched(self, name: str) -> Watched | None:
        """What viewers see of an object by its lobes."""
        o = self._scene.object(name)
        mesh = self._turned(name)
        return watched(mesh, self._scene.materials[o.material], self._places, self._around, self._seed_of(name))

    def trial(
        self, name: str, seen: Watched, level: float | None = None, options: Sequence[Option] | None = None
    ) -> Trial:
        """Errors of the object's probe and of its light fields, by default of all sizes.

        They are relative to a `level` of luminance, by default the object's own.
        """
        probe = probe_light(self._store, name)
        mesh, seed, some = self._turned(name), self._seed_of(name), options or options_of(self._texels)
        level = level or seen.level
        return tried(self._placing, mesh, seen, probe, self._around, seed, some, level)

    def _turned(self, name: str) -> Mesh:
        mesh = self._scene.object(name).mesh
        return turned_to_viewers(mesh, self._places, self._around.scene, self._seed_of(name))

    def _seed_of(self, name: str) -> int:
        return seed_of(self._seed, "light field", name)


def look_largest(scene: Scene, names: Collection[str], places: Floats, most: int) -> list[str]:
    """The objects that look largest to viewers at `places` (m, 3), as if nothing hid them; at most `most`, in order."""
    if len(names) <= most or not len(places):
        return list(names)[:most]
    meshes = {name: scene.object(name).mesh for name in names}
    area_m2 = np.array([triangle_areas(mesh.corners).sum() for mesh in meshes.values()])
    centres = np.array([(mesh.positions.min(axis=0) + mesh.positions.max(axis=0)) / 2 for mesh in meshes.values()])
    looks = np.zeros(len(area_m2))
    for place in places:
        away = ((centres - place) ** 2).sum(axis=1)
        looks += area_m2 / np.maximum(away + area_m2, 1e-12)
    kept = set(np.argsort(-looks, kind="stable")[:most].tolist())
    return [name for i, name in enumerate(meshes) if i in kept]


def usual_level(looks: Iterable[Watched]) -> float:
    """Median luminance of what viewers see of some objects, by the solid angle of each."""
    seen = list(looks)
    if not seen:
        return 1.0
    light = np.concatenate([luminance(one.light) for one in seen])
    weight = np.concatenate([np.full(len(one.x), one.size_sr / len(one.x)) for one in seen])
    return max(float(np.quantile(light, 0.5, weights=weight, method="inverted_cdf")), 1e-6)


def shown_by_reflectors(scene: Scene, store: Store) -> dict[str, float]:
    """Shares of the areas of objects that planar reflectors show."""
    shown: dict[str, float] = defaultdict(float)
    for part in (part for reflector in scene_record(store).reflectors for part in reflector.parts):
        shown[part.object] += part.area_m2
    areas = {o.name: float(triangle_areas(o.mesh.corners).sum()) for o in scene.objects}
    return {name: min(area_m2 / max(areas[name], 1e-12), 1.0) for name, area_m2 in shown.items() if name in areas}


def probe_light(store: Store, name: str) -> ProbeLight:
    """Look-ups of the probe that an object shows."""
    owner = shared_probes(store).get(name, name)
    at = probe_name(owner, "radiance")
    radiance, distance, planes = (store.read(probe_name(owner, part)) for part in ("radiance", "distance", "planes"))
    centre = np.array(store.artefact(at).meta["centre"], float)
    unit, whole = radiance_unit(store, at), probe_irradiance(store, owner)
    scaling = Scaling(occlusion_gain(store, owner), has_even_niches(store, owner))
    light = radiance.astype(float) * unit
    return ProbeLight(light, distance.astype(float), planes, centre, np.array(whole) if len(whole) else None, scaling)


@dataclass(frozen=True)
class Chosen:
    """One object's light field, and what the trial found: errors in log(1 + L/median) of what viewers see."""

    object: str
    points: int
    texels: int
    megabytes: float
    probe_error: float
    error: float
    size_sr: float

    def said(self) -> dict[str, Any]:
        return asdict(self)


def worth_trying(wrong: Mapping[str, float]) -> list[str]:
    """Of objects, by what is wrong with them, those that are tried, the worst first."""
    total = sum(wrong.values())
    names = sorted(wrong, key=lambda name: (-wrong[name], name))
    return [name for name in names if wrong[name] > SHARE * total][:MOST_TRIED]


def chosen(
    trials: Mapping[str, Trial], budget_mb: float, bytes_per_texel: float, sample_map_mb: Callable[[str, int], float]
) -> list[Chosen]:
    """The objects that get a light field within a budget, the most worth first, and which.

    `sample_map_mb` is the memory of a sample map, MB, by object and number of points.
    """
    taken, left = dict[str, Option](), budget_mb
    least = PER_MB * sum(trial.probe * trial.size_sr for trial in trials.values())  # of a megabyte

    def megabytes(name: str, option: Option) -> float:
        if option == PROBE:
            return 0.0
        return option.points * option.texels**2 * bytes_per_texel / 1e6 + sample_map_mb(name, option.points)

    while True:
        best, gain, cost = None, 0.0, 0.0
        for name, trial in trials.items():
            before = taken.get(name, PROBE)
            for option, error in trial.fields.items():
                more, falls = megabytes(name, option) - megabytes(name, before), trial.error(before) - error
                if not 0 < more <= left or falls <= WORTH * trial.probe:
                    continue
                worth = falls * trial.size_sr / more
                if worth > max(gain, least) and trial.falls(before, option, CERTAINTY):
                    best, gain, cost = (name, option), worth, more
        if best is None:
            break
        taken[best[0]], left = best[1], left - cost
    return [
        Chosen(name, *option, megabytes(name, option), trial.probe, trial.error(option), trial.size_sr)
        for name, option in taken.items()
        for trial in (trials[name],)
    ]
