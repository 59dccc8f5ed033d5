"""Scene in, store out: geometry, light map, environment and probes.

    store = bake(load_scene("builtin:room"), Path("room.store"), quality="preview")

Every artefact carries the hash of what it was made from; what has not changed is not baked again, and a bake that was
interrupted, even by kill -9, goes on where it was and ends with the same arrays, bit for bit.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.bake import atlas as atlases
from lambent.bake import keys
from lambent.bake.engine import engine
from lambent.bake.quality import Quality, quality_named
from lambent.bake.work import run_tiles, seed_of
from lambent.core.errors import UserError, did_you_mean
from lambent.core.files import sha256_of
from lambent.core.progress import Progress, silent
from lambent.scenes.reflectors import Reflector, find_reflectors
from lambent.scenes.scene import Scene
from lambent.scenes.textures import prepared
from lambent.store.contract import (
    LEAN,
    SIDES,
    TIMINGS,
    ReflectorPart,
    ReflectorRecord,
    SceneRecord,
    is_two_sided,
    needs_probe,
    noise_name,
    probe_name,
    write_scene_record,
)
from lambent.store.plans import plan_record
from lambent.store.store import Store
from lambent.store.textures import texture_records, write_textures

Array = NDArray[np.floating]
KINDS = ("geometry", "light_map", "environment", "probe")
NEEDS = {"geometry": (), "light_map": ("geometry",), "environment": (), "probe": ("geometry", "light_map")}
PATHS, PHOTONS = "paths", "photons"
CACHED, TRACED = "cached", "traced"
WAYS_OF = {"light_map": (PATHS, PHOTONS), "probes": (CACHED, TRACED)}
WAYS = "ways"  # document: which of WAYS_OF made what is in the store
PARTS = "parts"  # document: objects in several parts, with the key of what that was found from
log = logging.getLogger(__name__)


def bake(
    scene: Scene,
    store_path: Path,
    *,
    quality: str | Quality = "preview",
    only: Collection[str] | None = None,
    resume: bool = True,
    progress: Progress = silent,
    seed: int = 0,
    light_map: str | None = None,
    probes: str | None = None,
) -> Store:
    """Bake a scene into a store, or bring a store up to date.

    Parameters
    ----------
    quality : {'preview', 'normal', 'final'} or Quality
    only : collection of {'geometry', 'light_map', 'environment', 'probe'}, optional
        Kinds to bake; what they need is baked too. All by default.
    resume : bool
        False bakes everything anew, even what is up to date.
    seed : int
        The same seed gives the same arrays.
    light_map : {'paths', 'photons'}, optional
        What integrates the light map: path tracing and final gathering, or photons. By default as the store has it.
    probes : {'cached', 'traced'}, optional
        Whether probes show surfaces as the light map has them, or are path traced whole. By default as in the store.

    Returns
    -------
    Store
        Changed inputs are told by the logger and kept in the document "changes".
    """
    kinds = _with_needs(KINDS if only is None else only)
    job = _Bake(scene, store_path, quality_named(quality), resume, progress, seed, (light_map, probes))
    steps: dict[str, Callable[[], None]] = {
        "geometry": job.geometry,
        "environment": job.environment,
        "light_map": job.light_map,
        "probe": job.probes,
    }
    for kind, step in steps.items():
        if kind in kinds:
            step()
    if "light_map" in kinds:
        job.lean()
        job.noise()
    job.store.close()  # others may write it now
    return job.store


def _with_needs(only: Collection[str]) -> set[str]:
    for kind in only:
        if kind not in KINDS:
            hint = did_you_mean(kind, KINDS)
            raise UserError("unknown kind of artefact", got=kind, expected=", ".join(KINDS), hint=hint)
    return {need for kind in only for need in (kind, *NEEDS[kind])}


def _ways(wanted: tuple[str | None, str | None], store: Store | None) -> tuple[str, str]:
    """What makes the light map, and what the probes: as asked for, else as in the store."""
    before = store.documents.get(WAYS, {}) if store else {}
    found = [one or before.get(name, known[0]) for one, (name, known) in zip(wanted, WAYS_OF.items(), strict=True)]
    for way, (name, known) in zip(found, WAYS_OF.items(), strict=True):
        if way not in known:
            raise UserError(
                f"unknown way to bake {name}", got=way, expected=", ".join(known), hint=did_you_mean(way, known)
            )
    return found[0], found[1]


def inputs_of(scene: Scene) -> dict[str, str]:
    """SHA-256 of the files a scene was read from, by file name."""
    return {path.name: sha256_of(path) for path in (*scene.sources, *scene.measured.values())}


def changed_inputs(store: Store, scene: Scene) -> list[str]:
    """Names of the scene's files that are not what the store was baked from."""
    now = inputs_of(scene)
    return sorted(name for name in now.keys() | store.inputs.keys() if now.get(name) != store.inputs.get(name))


class _Bake:
    """One run: the scene, the store, and what the steps share."""

    def __init__(
        self,
        scene: Scene,
        path: Path,
        quality: Quality,
        resume: bool,
        progress: Progress,
        seed: int,
        ways: tuple[str | None, str | None],
    ) -> None:
        if not scene.objects:
            raise UserError("scene has no objects", field=scene.name)
        scene = replace(scene, textures=prepared(scene.textures))
        self.scene, self.quality, self.progress, self.seed = scene, quality, progress, seed
        existing = Store.open(path) if (Path(path) / "manifest.json").exists() else None
        changes = changed_inputs(existing, scene) if existing else []
        if changes:
            log.warning("changed since the last bake: %s; what depends on it is baked again", ", ".join(changes))
        self.integrator, self.probe_way = _ways(ways, existing)
        self.store = Store.create(path, inputs_of(scene))
        self.store.set_document(WAYS, {"light_map": self.integrator, "probes": self.probe_way})
        scene = self.scene = self._in_parts(scene)
        self.store.set_document("changes", changes)
        if not resume:
            self.store.forget_all()
        geometry = keys.geometry_parts(scene)
        self.geometry_key = keys.key_of("geometry", quality.light_map_texels, *geometry)
        q = [quality.light_map_samples, quality.light_map_noise, quality.gather_samples, quality.gather_noise]
        q += [quality.tile_texels, quality.max_depth, seed]
        if self.integrator == PHOTONS:
            q.append([PHOTONS, quality.photons_per_texel])
        looks = keys.material_parts(scene)
        self.light_map_key = keys.key_of("light_map", self.geometry_key, looks, keys.light_parts(scene), q)
        self.irradiance_key = keys.key_of("irradiance", self.light_map_key)  # raw samples, filled and denoised
        self.environment_key = keys.key_of(
            "environment", quality.environment_texels, keys.environment_part(scene.environment)
        )

    @contextmanager
    def _timed(self, name: str) -> Iterator[None]:
        """Add the seconds of a step to the document "timings", even when it is interrupted."""
        start = time.perf_counter()
        try:
            yield
        finally:
            timings = dict(self.store.documents.get(TIMINGS, {}))
            timings[name] = round(timings.get(name, 0.0) + time.perf_counter() - start, 3)
            self.store.set_document(TIMINGS, timings)

    def _current(self, name: str, key: str) -> bool:
        return name in self.store and self.store.artefact(name).key == key

    def _in_parts(self, scene: Scene) -> Scene:
        """The scene with objects cut up that one probe cannot stand for; asked again only where geometry changed."""
        centres = sorted(scene.probe_centres.items())
        shiny = sorted(name for name, material in scene.materials.items() if needs_probe(material))
        clear = sorted(n for n, m in scene.materials.items() if m.transmits or n in scene.textures)
        worn = [o.material for o in scene.objects]
        key = keys.key_of("geometry", "parts", *keys.geometry_parts(scene), centres, shiny, clear, worn)
        found = self.store.documents.get(PARTS)
        if not isinstance(found, dict) or found.get("key") != key:
            from lambent.bake.probe_parts import cuts_of

            found = {"key": key, "cuts": cuts_of(scene, self.progress)}
            self.store.set_document(PARTS, found)
        if not found["cuts"]:
            return scene
        from lambent.bake.probe_parts import split

        return split(scene, found["cuts"])

    def geometry(self) -> None:
        """Split meshes with second coordinates, the pictures on them, and the scene record."""
        names = ("positions", "normals", "tangents", "uv", "uv2", "faces")
        if not all(self._current(f"geometry/{name}", self.geometry_key) for name in names):
            self._forget_times("geometry")
            with self._timed("geometry"):
                atlas = atlases.unwrap(self.scene, self.quality.light_map_texels, self.progress)
                meta = {"light_map_size": [atlas.width, atlas.height]}
                for name, array in atlases.merged(atlas).items():
                    self.store.put(f"geometry/{name}", "geometry", array, key=self.geometry_key, meta=meta)
        write_textures(self.store, self.scene.textures)
        write_scene_record(self.store, scene_record_of(self.scene))

    def _forget_times(self, name: str) -> None:
        self.store.set_document(TIMINGS, {k: v for k, v in self.store.documents.get(TIMINGS, {}).items() if k != name})

    @cached_property
    def merged(self) -> dict[str, Array]:
        names = ("positions", "normals", "tangents", "uv", "uv2", "faces")
        return {name: self.store.read(f"geometry/{name}") for name in names}

    @cached_property
    def atlas(self) -> atlases.Atlas:
        width, height = self.store.artefact("geometry/uv2").meta["light_map_size"]
        return atlases.separated(self.scene, self.merged, width, height)

    @cached_property
    def ground(self) -> Any:
        from lambent.bake.groundwork import Groundwork

        return Groundwork(self.atlas, self.merged, self._two_sided, self.progress)

    def environment(self) -> None:
        from lambent.bake.environment import environment_cube

        name = "environment/radiance"
        if self._current(name, self.environment_key):
            return
        with self._timed("environment"):
            self.progress(0, 1, "environment")
            n = self.quality.environment_texels if self.scene.environment else 16
            cube = environment_cube(self.scene.environment, n)
            self.store.put(name, "environment", cube, key=self.environment_key)
            self.progress(1, 1, "environment")

    def light_map(self) -> None:
        sides = ["irradiance"]
        if any(self._two_sided):
            sides.append("irradiance_back")
        if all(self._current(f"light_map/{side}", self.irradiance_key) for side in sides):
            return
        with self._timed("light_map"):
            from lambent.bake.light_map import gathered, path_traced
            from lambent.bake.probe import LightMapCache

            if self.integrator == PHOTONS:
                maps = dict(zip(sides, self._photon_maps(len(sides)), strict=True))
            else:
                how = path_traced(self.quality)
                maps = {side: self._sampled_map(side, "traced", how) for side in sides}
            if self.quality.gather_samples and self.integrator != PHOTONS:
                back = maps["irradiance_back"][0] if len(sides) > 1 else None
                cache = LightMapCache(self.ground.builder(diffuse=False), maps["irradiance"][0], back)
                how = gathered(self.quality, cache)
                maps = {side: self._sampled_map(side, "gathered", how) for side in sides}
            for side, (clean, meta) in maps.items():
                name = f"light_map/{side}"
                meta = self._meta(integrator=self.integrator, **meta)
                self.store.put(name, "light_map", clean, key=self.irradiance_key, meta=meta)

    def lean(self) -> None:
        """Where the light comes from on surfaces with a normal map."""
        bent = {name for name, textures in self.scene.textures.items() if textures.normal}
        ours = np.repeat(
            [o.material in bent for o in self.scene.objects], [len(o.mesh.faces) for o in self.scene.objects]
        )
        if not ours.any() or self._current(LEAN, self.irradiance_key):
            return
        from lambent.bake.light_lean import lean_of, leaning
        from lambent.bake.probe import LightMapCache

        front, back = self._finished_maps()
        how = leaning(LightMapCache(self.ground.builder(diffuse=False), front, back), self.quality.max_depth)
        raw, _ = self._samples(SIDES[0], "leaning", how, ours)
        lean = lean_of(raw, front, self.ground.labels)
        self.store.put(LEAN, "light_map", lean, key=self.irradiance_key, meta=self._meta())

    def noise(self) -> None:
        """How exact the light map is at every texel, from the samples that stay in the store."""
        count = 2 if any(self._two_sided) else 1
        names = [noise_name(side) for side in SIDES[:count]]
        if all(self._current(name, self.irradiance_key) for name in names):
            return
        from lambent.bake.noise_map import noise_map, sampled_halves
        from lambent.bake.photon_map import halves_of

        self.progress(0, 1, "noise of the light map")
        if self.integrator == PHOTONS:
            sides = [self.ground.lit_sides(sign) for sign in (1.0, -1.0)[:count]]
            found = halves_of(self.store.read("light_map/photons"), self.merged, sides)
        else:
            stage = "gathered" if self.quality.gather_samples else "traced"
            raw = (f"light_map/{stage}", f"light_map/{stage}_back")[:count]
            found = (sampled_halves(self.store.read(name)) for name in raw)
        for name, (halves, known) in zip(names, found, strict=True):
            noise = noise_map(halves, known, self.ground.labels)
            self.store.put(name, "light_map", noise, key=self.irradiance_key, meta=self._meta())

    def _finished_maps(self) -> tuple[Array, Array | None]:
        """The light map of both sides, that of the far one where there is any."""
        back = "light_map/irradiance_back"
        return self.store.read("light_map/irradiance"), self.store.read(back) if back in self.store else None

    def _photon_maps(self, count: int) -> list[tuple[Array, dict[str, float]]]:
        """Both sides' maps, denoised, and what to note of them; the batches stay as `light_map/photons`."""
        from lambent.bake.photon_map import Shots, finished, shape_of, shoot_batches

        name, quality, ground = "light_map/photons", self.quality, self.ground
        shape, chunks = shape_of(ground.texels, count)
        writer = self.store.begin(name, "raw", shape, chunks, "float32", key=self.light_map_key, meta=self._meta())
        scene = ground.whole(diffuse=True, photons=True)
        sides = [ground.lit_sides(sign) for sign in (1.0, -1.0)[:count]]
        if writer.missing:
            how = Shots(quality.photons_per_texel, quality.light_map_noise, quality.max_depth, self.seed)
            shoot_batches(writer, ground.scene, scene, self.merged, sides, how, self.progress)
        writer.finish()
        self.progress(0, 1, "denoising")
        return finished(self.store.read(name), self.merged, sides, ground.labels)

    def _sampled_map(self, side: str, stage: str, how: Any) -> tuple[Array, dict[str, float]]:
        """One side's map, denoised, and what to note of it."""
        from lambent.bake.light_map import finished

        raw, labels = self._samples(side, stage, how)
        self.progress(0, 1, "denoising")
        return finished(raw, self.ground.texels, labels)

    def _samples(
        self, side: str, stage: str, how: Any, faces: NDArray[np.bool_] | None = None
    ) -> tuple[Array, NDArray[np.integer]]:
        """One side's raw sums, which stay in the store as `light_map/STAGE...`, and the charts that viewers see.

        With `faces` (T,), of texels on these alone.
        """
        from lambent.bake.light_map import tile_samples

        name = f"light_map/{stage}" if side == "irradiance" else f"light_map/{stage}_back"
        tile, texels = self.quality.tile_texels, self.ground.texels
        shape, chunks = (2, texels.height, texels.width, 4), (2, tile, tile, 4)
        writer = self.store.begin(name, "raw", shape, chunks, "float32", key=self.light_map_key, meta=self._meta())
        scene = self.ground.whole(diffuse=how.cache is None)
        sides, labels = self.ground.in_view(1.0 if side == "irradiance" else -1.0)
        if faces is not None:
            sides = replace(sides, valid=sides.valid & faces[texels.face])
        if writer.missing:
            covered = np.zeros(texels.width * texels.height, bool)
            covered[texels.index[sides.valid.any(axis=1)]] = True
            covered = covered.reshape(texels.height, texels.width)
            run_tiles(
                writer,
                lambda region, tile_seed: tile_samples(scene, sides, region, tile_seed, how),
                seed=self.seed,
                progress=self.progress,
                what=f"light map, {stage}" + (", far sides" if side != "irradiance" else ""),
                cost=lambda region: 1 + float(covered[region[1], region[2]].sum()),
            )
        writer.finish()
        return self.store.read(name), labels

    @cached_property
    def _two_sided(self) -> list[bool]:
        """By object, whether light crosses it, so that its far side has a map too."""
        masked = {name for name, textures in self.scene.textures.items() if textures.opacity}
        materials = self.scene.materials
        return [is_two_sided(materials[o.material], masked=o.material in masked) for o in self.scene.objects]

    def probes(self) -> None:
        wanted = [o.name for o in self.scene.objects if needs_probe(self.scene.materials[o.material])]
        keys_of = {name: self._probe_key(name) for name in wanted}
        missing = [n for n in wanted if not self._current(probe_name(n, "planes"), self._planes_key(n, keys_of[n]))]
        if not missing:
            return
        self._forget_times("probe")
        with self._timed("probe"):
            from lambent.bake.probe_set import ProbeSet

            front, back = self._finished_maps()
            probes = ProbeSet(self.ground, front if self.probe_way == CACHED else None, back)
            for i, name in enumerate(missing):
                self.progress(i, len(missing), f"probe of {name}")
                result, meta = probes.bake(name, self.quality, seed_of(self.seed, "probe", name))
                _tell_if_too_few(name, meta)
                for part in ("radiance", "distance", "planes"):
                    key = self._planes_key(name, keys_of[name]) if part == "planes" else keys_of[name]
                    self.store.put(probe_name(name, part), "probe", result[part], key=key, meta=self._meta(**meta))
            self.progress(1, 1, "probes")

    def _probe_key(self, name: str) -> str:
        q = self.quality
        centre = self.scene.probe_centres.get(name)
        parts = [self.irradiance_key, name, centre, q.probe_texels, q.probe_samples, q.probe_noise, self.seed]
        if self.probe_way != CACHED:
            parts += [self.probe_way, q.max_depth]
        return keys.key_of("probe", *parts)

    def _planes_key(self, name: str, probe_key: str) -> str:
        given = self.scene.probe_planes.get(name)
        return keys.key_of("probe", probe_key, None if given is None else np.asarray(given, float))

    def _meta(self, **more: Any) -> dict[str, Any]:
        return {"quality": self.quality.name, "seed": self.seed, "engine": engine().variant, **more}


def _tell_if_too_few(name: str, meta: dict[str, Any]) -> None:
    from lambent.bake.probe_parts import HIDDEN

    if meta["hidden_share"] > HIDDEN:
        log.warning(
            "%s: its probe has not seen %.0f %% of what it mirrors; a tenth is looked up %.0f degrees or more off",
            name, 100 * meta["hidden_share"], meta["parallax_deg"],
        )  # fmt: skip


def scene_record_of(scene: Scene) -> SceneRecord:
    """What the store says of the scene besides its arrays."""

    low, high = (tuple(float(x) for x in corner) for corner in scene.bounds)
    return SceneRecord(
        name=scene.name,
        objects=atlases.object_records(scene),
        materials=dict(scene.materials),
        cameras=scene.cameras,
        paths=scene.paths,
        reflectors=tuple(_reflector_record(r) for r in find_reflectors(scene)),
        exposure_ev=scene.exposure_ev,
        bounds=(low, high),  # type: ignore[arg-type]
        warnings=scene.warnings,
        textures=texture_records(scene.textures),
    )


def _reflector_record(r: Reflector) -> ReflectorRecord:
    return ReflectorRecord(
        plane=r.plane,
        outline=tuple((float(x), float(y), float(z)) for x, y, z in r.outline),
        deviation_m=r.deviation_m,
        two_sided=r.two_sided,
        plan=None if r.plan is None else plan_record(r.plan),
        parts=tuple(
            ReflectorPart(object=part.object, faces=tuple(map(int, part.faces)), area_m2=part.area_m2)
            for part in r.parts
        ),
    )
