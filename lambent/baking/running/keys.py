"""Keys of arrays: hashes of all their inputs. If a key changes, the array is stale."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.inputs import sha256_of
from lambent.core.pictures.environment_layouts import layout_of
from lambent.scenes.light_groups import names_of_lights
from lambent.scenes.looks.textures import digest, parts
from lambent.scenes.scene import ComputedEnvironment, Environment, ImageEnvironment, Scene, SceneObject, SunSky
from lambent.scenes.sky.computed import lat_long_image
from lambent.scenes.sky.environment_images import read_surroundings

DAYLIGHT = "clear_sky 1"  # the model that daylight is calibrated to; increment it when the calibration changes


def key_of(what: str, revision: int, *inputs: object) -> str:
    """SHA-256 of inputs: numbers, texts, arrays, nested. Increment `revision` when the code that uses them changes."""
    result = hashlib.sha256(f"{what} {revision}".encode())
    for one in inputs:
        if isinstance(one, np.ndarray):
            result.update(f"{one.dtype} {one.shape}".encode())
            result.update(np.ascontiguousarray(one).data)
        elif isinstance(one, _Meshes):
            for part in one.parts():
                result.update(part)
        else:
            result.update(_TEXT.encode(one).encode())
    return result.hexdigest()


def _nested(value: object) -> object:
    """JSON form of a nested input; the text of an array would omit its middle."""
    if isinstance(value, np.ndarray):
        return key_of("array", 1, value)
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, frozenset | set):
        return sorted(map(str, value))  # sets are ordered differently in each process
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"no key of {type(value).__name__}: it has no text that is the same in every process")


_TEXT = json.JSONEncoder(sort_keys=True, default=_nested)


@dataclass(frozen=True)
class _Meshes:
    """Objects whose names, scales in the light map and arrays are hashed one by one: there may be 100,000."""

    objects: tuple[SceneObject, ...]

    def parts(self) -> Iterator[bytes]:
        """What `key_of` hashes of each object, as if each input were hashed by itself."""
        for o in self.objects:
            found: list[Any] = [json.dumps(o.name).encode(), _number(o.light_map_scale)]
            for array in (o.mesh.positions, o.mesh.normals, o.mesh.tangents, o.mesh.uv, o.mesh.faces):
                found += (_head_of(array.dtype, array.shape), np.ascontiguousarray(array))
            yield b"".join(found)


@lru_cache(maxsize=256)
def _head_of(dtype: np.dtype[Any], shape: tuple[int, ...]) -> bytes:
    """Of an array: to make it takes longer than to hash a small one."""
    return f"{dtype} {shape}".encode()


@lru_cache(maxsize=256, typed=True)
def _number(value: float) -> bytes:
    """As JSON has it."""
    return json.dumps(value).encode()


def geometry_inputs(scene: Scene) -> list[object]:
    """All meshes, and their scale in the light map."""
    return [_Meshes(scene.objects)]


def material_inputs(scene: Scene) -> object:
    """How each object scatters light, without names and provenance of materials."""
    look: dict[str, object] = {
        n: m.model_dump(mode="json", exclude={"name", "provenance"}) for n, m in scene.materials.items()
    }
    for name, textures in scene.textures.items():
        images = {part: digest(texture) for part, texture in parts(textures).items()}
        look[name] = [look.get(name), images, textures.cutoff]
    for name, file in scene.measured.items():
        look[name] = [look.get(name), sha256_of(file)]
    return [(o.name, look[o.material]) for o in scene.objects]


def texture_inputs(scene: Scene, *channels: str) -> object:
    """These channels of all textures, and their masks, by material."""
    found = {}
    for name, textures in scene.textures.items():
        images = {part: digest(t) for part, t in parts(textures).items() if part in (*channels, "opacity")}
        found[name] = [images, textures.cutoff] if images else None
    return {name: said for name, said in found.items() if said}


def light_inputs(scene: Scene) -> object:
    """All emitters; names of lights only affect groups."""
    emissions = [(o.name, o.emission) for o in scene.objects]
    lights = [(type(x).__name__, {k: v for k, v in asdict(x).items() if k != "name"}) for x in scene.lights]
    openings = [[(o.luminaire, o.name, o.moved) for o in scene.objects if o.luminaire is not None]]
    return [emissions, lights, environment_inputs(scene.environment), *(openings if scene.openings else [])]


def group_inputs(scene: Scene) -> object:
    """How emitters are sorted into light groups."""
    named = [(group.name, group.members) for group in scene.light_groups]
    shining = [scene.parts.get(o.name, o.name) for o in scene.objects if any(o.emission)]
    return [named, names_of_lights(scene.lights), shining]


@lru_cache(maxsize=16)
def _layout(file: Path, content: str) -> str:
    """The detected layout of a picture; `content` is its hash, for the cache."""
    return layout_of(read_surroundings(file), file)


def environment_inputs(environment: Environment | None) -> object:
    """The environment; an image counts by content, not by path."""
    if environment is None:
        return None
    values: Mapping[str, object] = asdict(environment)
    if isinstance(environment, ImageEnvironment):
        content = sha256_of(environment.file)
        values = {**values, "file": content, "layout": environment.layout or _layout(environment.file, content)}
        plain = {"layout": "lat-long", "up": "+y"}  # the former defaults: older stores keep their keys
        values = {name: value for name, value in values.items() if plain.get(name) != value}
    elif isinstance(environment, ComputedEnvironment):
        values = {**values, "image": key_of("computed", 1, lat_long_image(environment.name))}
    elif isinstance(environment, SunSky):
        values = {**values, "model": DAYLIGHT}
    return [type(environment).__name__, values]
