"""What each artefact was made from, as one hash: where it changes, the artefact is stale."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from lambent.core.files import sha256_of
from lambent.scenes.scene import Environment, ImageEnvironment, Scene
from lambent.scenes.textures import digest, parts

REVISION = {
    "geometry": 2,
    "light_map": 4,
    "irradiance": 1,
    "environment": 1,
    "probe": 4,
}  # raised when a bake's result changes


def key_of(kind: str, *parts: object) -> str:
    """Hash of an artefact kind and everything its content depends on: numbers, texts, arrays, nested."""
    digest = hashlib.sha256(f"{kind} {REVISION[kind]}".encode())
    for part in parts:
        _update(digest, part)
    return digest.hexdigest()


def _update(digest: Any, part: object) -> None:
    if isinstance(part, np.ndarray):
        digest.update(f"{part.dtype} {part.shape}".encode())
        digest.update(np.ascontiguousarray(part).tobytes())
    else:
        digest.update(json.dumps(part, sort_keys=True, default=str).encode())


def geometry_parts(scene: Scene) -> list[object]:
    """All meshes, and how densely they want to be baked."""
    parts: list[object] = []
    for o in scene.objects:
        m = o.mesh
        parts += [o.name, o.light_map_scale, m.positions, m.normals, m.tangents, m.uv, m.faces]
    return parts


def material_parts(scene: Scene) -> object:
    """What the materials and their pictures do to light, by object: neither their names nor their provenance."""
    look: dict[str, object] = {
        n: m.model_dump(mode="json", exclude={"name", "provenance"}) for n, m in scene.materials.items()
    }
    for name, textures in scene.textures.items():
        pictures = {part: digest(texture) for part, texture in parts(textures).items()}
        look[name] = [look.get(name), pictures, textures.cutoff]
    for name, file in scene.measured.items():
        look[name] = [look.get(name), sha256_of(file)]
    return [(o.name, look[o.material]) for o in scene.objects]


def light_parts(scene: Scene) -> object:
    """Everything that emits."""
    emissions = [(o.name, o.emission) for o in scene.objects]
    return [emissions, [(type(x).__name__, asdict(x)) for x in scene.lights], environment_part(scene.environment)]


def environment_part(environment: Environment | None) -> object:
    """The environment; of a picture its content, not its place."""
    if environment is None:
        return None
    values: Mapping[str, object] = asdict(environment)
    if isinstance(environment, ImageEnvironment):
        values = {**values, "file": sha256_of(environment.file)}
    return [type(environment).__name__, values]
