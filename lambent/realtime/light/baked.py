"""The renderer's inputs from a store, as plain arrays; `missing` names what the store lacks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lambent.baked.light_fields.light_field import LightField
from lambent.baked.light_fields.map_cache import LEAST_RECENT, POLICIES
from lambent.baked.light_fields.stored import BLOCKS, has_light_field, read_light_field
from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.plain import first_of, triple
from lambent.realtime.gpu.cube_mips import finite
from lambent.realtime.lamps.drawn import DrawnLamps, read_lamps
from lambent.realtime.light.group_arrays import GroupArrays, groups_in
from lambent.scenes.scene import MaterialTextures
from lambent.store import contract
from lambent.store.consistency import numbers_of, read_geometry
from lambent.store.contract import DOMINANT_DIRECTION, SIDES, ObjectRecord, SceneRecord, SunRecord, noise_name
from lambent.store.occlusion import has_even_niches, occlusion_gain, probe_shares
from lambent.store.store import Store
from lambent.store.sunlit import read_sunlit
from lambent.store.textures import read_textures

ENVIRONMENT = "environment/radiance"


@dataclass(frozen=True, eq=False)
class Probe:
    """Light around an object, seen from `centre`: radiance (6, N, N, 3), distance (6, M, M) or None, planes (P, 4).

    `irradiance`, nine numbers (`store.contract`), is the irradiance from the probe alone; its object receives only the
    share of it that its light map shows. Empty: no such scaling. An object with a `light_field` has its own probe, and
    the environment (6, N, N, 3) in `sky`.
    """

    centre: tuple[float, float, float]
    radiance: Floats
    distance: Floats | None = None
    planes: Floats = field(default_factory=lambda: np.zeros((0, 4), np.float32))
    irradiance: tuple[float, ...] = ()
    light_field: LightField | None = None
    sky: Floats | None = None
    most_bytes: float | None = None  # budget of the light field's maps on the GPU
    policy: str = LEAST_RECENT  # of their cache, if they exceed the budget
    gain: float = 1.0  # factor on the light map's share of `irradiance`
    even_niches: bool = False  # the rest comes from the light map, evenly from all directions


DARK = Probe((0.0, 0.0, 0.0), np.zeros((6, 1, 1, 3), np.float32))


@dataclass(frozen=True, eq=False)
class BakedScene:
    """Geometry (as in store.contract), light maps (H, W, 3), environment (6, N, N, 3) and probes by object name.

    Light is in units of `unit` W/(sr m^2) or W/m^2, so that sunlit surfaces fit half floats. Exceptions: light in the
    record, and probes' `irradiance`. Pictures are in W/(sr m^2).
    """

    record: SceneRecord
    positions: Floats
    normals: Floats
    tangents: Floats
    uv2: Floats
    faces: NDArray[np.uint32]
    irradiance: Floats | None = None
    irradiance_back: Floats | None = None
    environment: Floats | None = None
    probes: Mapping[str, Probe] = field(default_factory=dict)
    light_fields: Mapping[str, LightField] = field(default_factory=dict)  # by object
    missing: tuple[str, ...] = ()
    uv: Floats | None = None
    textures: Mapping[str, MaterialTextures] = field(default_factory=dict)  # by the material's name
    shared_probes: Mapping[str, str] = field(default_factory=dict)  # owner of the shown probe, by object
    noise: Floats | None = None  # (H, W), relative standard error of the light map
    noise_back: Floats | None = None
    dominant_direction: Floats | None = None  # (H, W, 3), mean direction of incident light
    probe_share: Floats | None = None  # (H, W, 4), visible share of the probes' light (`store.occlusion`)
    share_objects: frozenset[str] = frozenset()  # objects that use `probe_share`
    unit: float = 1.0
    light_field_mb: float | None = None  # GPU budget of the maps of all light fields; None: unlimited
    policy: str = LEAST_RECENT  # eviction policy of their caches
    sun: SunRecord | None = None  # its direct light is not in the light maps
    sunlit: NDArray[np.uint8] | None = None  # (H, W), 0 for texels that the sun does not reach (`store.sunlit`)
    lamps: DrawnLamps | None = None  # drawn by pixel; their light is in the light maps too
    groups: GroupArrays | None = None  # light by group; None if baked without groups
    replaced: bool = False  # whether a mesh replaces an object; light maps then differ from the store's

    def probe_of(self, obj: ObjectRecord) -> Probe | None:
        """The object's own or shared probe, else the nearest one, else the environment, else None.

        Includes the object's light field, if any.
        """
        probe, light_field = self._cube_of(obj), self.light_fields.get(obj.name)
        if light_field is None:
            return probe
        most = None
        if self.light_field_mb is not None:
            whole = sum(math.prod(one.inverse_distance.shape) for one in self.light_fields.values())
            most = 1e6 * self.light_field_mb * math.prod(light_field.inverse_distance.shape) / whole
        return replace(
            probe or DARK, light_field=light_field, sky=self.environment, most_bytes=most, policy=self.policy
        )

    def _cube_of(self, obj: ObjectRecord) -> Probe | None:
        owner = self.shared_probes.get(obj.name, obj.name)
        if owner in self.probes:
            return self.probes[owner]
        if self.probes:
            centre = np.mean(obj.bounds, axis=0)
            return min(self.probes.values(), key=lambda probe: float(np.linalg.norm(probe.centre - centre)))
        return self.far_light

    @cached_property
    def far_light(self) -> Probe | None:
        """The environment as a probe at infinity, with an arbitrary centre."""
        return None if self.environment is None else Probe((0.0, 0.0, 0.0), self.environment)


def _light_field(store: Store, name: str, unit: float) -> LightField:
    """The light field of an object, its light in units of `unit` W/(sr m^2)."""
    found = read_light_field(store, name)
    own = contract.radiance_unit(store, contract.light_field_name(name, BLOCKS))
    return (
        found
        if own == unit
        else replace(found, radiance=np.asarray(found.radiance) * np.float32(own / unit), blocks=None)
    )


def _in_units(sun: SunRecord | None, unit: float) -> SunRecord | None:
    return sun and sun.model_copy(update={"irradiance": triple(np.divide(sun.irradiance, unit))})


def read_baked(
    store: Store, light_field_mb: float | None = None, policy: str = LEAST_RECENT, *, probes: bool = True
) -> BakedScene:
    """All data of a store that the renderer shows. Only the geometry and the scene record are required.

    Without `probes`, light on surfaces alone: no light fields either.
    """
    known("cache of light fields", policy, POLICIES, field="--light-field-cache")
    record = contract.scene_record(store)
    missing: list[str] = []
    around = record.objects if probes else ()
    cubes = [n for n in (ENVIRONMENT, *(contract.probe_name(o.name, "radiance") for o in around)) if n in store]
    fields = [o.name for o in around if has_light_field(store, o.name)]
    lit = [*cubes, *(contract.light_field_name(name, BLOCKS) for name in fields)]
    unit = max((contract.radiance_unit(store, name) for name in lit), default=1.0)

    def light(name: str, why: str | None) -> Floats | None:
        if name not in store:
            if why is not None:
                missing.append(f"{name}: {why}")
            return None
        values, bad = finite(store.read(name))
        if bad:
            missing.append(f"{name}: {bad} values are negative or not finite and were set to 0")
        own = contract.radiance_unit(store, name) if name in cubes else 1.0
        return values if own == unit else values * np.float32(own / unit)

    def noise(side: str) -> Floats | None:
        name = noise_name(side)
        return finite(store.read(name))[0] if name in store else None

    masked = {name for name, textures in record.textures.items() if "opacity" in textures.parts}
    two_sided = any(
        contract.is_two_sided(record.materials[o.material], masked=o.material in masked) for o in record.objects
    )
    found, without, shared = {}, [], contract.shared_probes(store)
    for obj in (o for o in around if o.name not in shared):
        name = contract.probe_name(obj.name, "radiance")
        radiance = light(name, None)
        if radiance is not None:
            found[obj.name] = _probe(store, obj.name, radiance)
        elif obj.probe and contract.needs_probe(record.materials[obj.material]):
            without.append(obj.name)
    if without:
        missing.append(f"no probe of {first_of(without)}: the nearest probe or the environment is used")
    shares, share_objects = probe_shares(store)
    sun = contract.sun_left_out(store)
    back = "light through two-sided sheets is black" if two_sided else None
    return BakedScene(
        record,
        **read_geometry(store),
        irradiance=light("light_map/irradiance", "diffuse light is black"),
        irradiance_back=light("light_map/irradiance_back", back),
        environment=light(ENVIRONMENT, None),
        probes=found,
        missing=tuple(missing),
        textures=read_textures(store, record),
        shared_probes=shared,
        light_fields={name: _light_field(store, name, unit) for name in fields},
        noise=noise(SIDES[0]),
        noise_back=noise(SIDES[1]),
        dominant_direction=store.read(DOMINANT_DIRECTION) if DOMINANT_DIRECTION in store else None,
        probe_share=shares,
        share_objects=share_objects,
        unit=unit,
        light_field_mb=light_field_mb,
        policy=policy,
        sun=_in_units(sun, unit),
        sunlit=read_sunlit(store, sun),
        lamps=read_lamps(store, unit),
        groups=groups_in(store, unit),
        replaced=False,
    )


def read_probe(store: Store, name: str, unit: float) -> Probe:
    """The probe of an object, its light in `unit` W/(sr m^2)."""
    array = contract.probe_name(name, "radiance")
    scale = np.float32(contract.radiance_unit(store, array) / unit)
    return _probe(store, name, finite(store.read(array))[0] * scale)


def _probe(store: Store, name: str, radiance: Floats) -> Probe:
    centre = numbers_of(store, contract.probe_name(name, "radiance"), "centre", 3)
    distance, planes = (contract.probe_name(name, part) for part in ("distance", "planes"))
    return Probe(
        triple(centre),
        radiance,
        store.read(distance) if distance in store else None,
        store.read(planes).reshape(-1, 4) if planes in store else np.zeros((0, 4), np.float32),
        contract.probe_irradiance(store, name),
        gain=occlusion_gain(store, name),
        even_niches=has_even_niches(store, name),
    )
