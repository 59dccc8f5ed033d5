"""A material as glTF 2.0: a sphere with the material, for any viewer and engine.

The metallic-roughness model with its thin-sheet extensions, exactly as specified, is fitted to the material; the exact
document is in the material's `extras`.

Sources: glTF 2.0, appendix B; KHR_materials_anisotropy, _ior, _specular, _transmission, _diffuse_transmission. The
roughness of the anisotropic facets is larger along the tangent turned by anisotropyRotation.
"""

from __future__ import annotations

import base64
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lambent.core.files import atomic_path
from lambent.core.geometry.directions import Floats
from lambent.core.glb import glb_bytes
from lambent.core.progress import Progress, silent
from lambent.materials.document import Material
from lambent.materials.export import matching
from lambent.materials.export.contract import Cost, Kind, Subject
from lambent.materials.export.matching import ALPHA_MAX, ALPHA_MIN, three
from lambent.materials.export.resampling.resampled import CHECK_LOG2, FIT_LOG2, Pairs, is_isotropic, pairs_of
from lambent.materials.fresnel import ior_of, r0_of

NAME = "glTF 2.0"
ENDINGS = (".gltf", ".glb")
TAKES: tuple[Kind, ...] = ("material",)

IOR_MAX = 2.333  # diamond's; engines clamp beyond it
F0_MAX = r0_of(IOR_MAX)
SIMPLER = 0.98  # a blend of metal and dielectric must lower the error of either below this share
NEGLIGIBLE = 1e-4
RADIUS_M = 0.1
AROUND, ROWS = 96, 48


@dataclass(frozen=True)
class GltfMaterial:
    """The parameters of a glTF material.

    Attributes
    ----------
    base, specular_colour, through_colour : (C,)
        baseColorFactor, specularColorFactor, diffuseTransmissionColorFactor; C is 1 or 3.
    metallic, roughness, specular, ior, transmission, through : float
        Factors of the same names; `through` is diffuseTransmissionFactor.
    strength : float
        anisotropyStrength.
    axis : "t" or "b"
        The axis of the rougher facets; "b" is an anisotropyRotation of 90 degrees.
    """

    base: Floats
    specular_colour: Floats
    through_colour: Floats
    metallic: float = 0.0
    roughness: float = 1.0
    strength: float = 0.0
    axis: Literal["t", "b"] = "t"
    specular: float = 1.0
    ior: float = 1.5
    transmission: float = 0.0
    through: float = 0.0

    def eval(self, pairs: Pairs) -> Floats:
        """f (N, C) in 1/sr at the pairs, as specified."""
        narrow = self.roughness**2
        wide = narrow + (1 - narrow) * self.strength**2
        alphas = (wide, narrow) if self.axis == "t" else (narrow, wide)
        s5 = pairs.schlick[:, None]
        f0 = np.minimum(r0_of(self.ior) * self.specular_colour, 1)
        fresnel = f0 + (1 - f0) * s5
        under = 1 - self.specular * fresnel.max(axis=1, keepdims=True)
        near, far = ~pairs.far, pairs.far
        f = np.zeros((len(pairs), len(self.base)))
        layer = pairs.facets(*alphas)[:, None]
        diffuse = (1 - self.transmission) * (1 - self.through) * self.base / np.pi
        dielectric = under * diffuse + self.specular * fresnel * layer
        metal = (self.base + (1 - self.base) * s5) * layer
        f[near] = ((1 - self.metallic) * dielectric + self.metallic * metal)[near]
        if far.any():
            facets = pairs.facets(*alphas, masking="separable")[:, None]
            below = self.transmission * self.base * facets
            below = below + (1 - self.transmission) * self.through * self.through_colour / np.pi
            f[far] = ((1 - self.metallic) * under * below)[far]
        return f

    def document(self, name: str) -> dict[str, Any]:
        """The material's JSON, with the extensions whose values are not their defaults."""
        pbr: dict[str, Any] = {"baseColorFactor": [*three(self.base), 1.0], "roughnessFactor": self.roughness}
        pbr |= {"metallicFactor": self.metallic}
        colour, dielectric = three(self.specular_colour), self.metallic < 1
        specular: dict[str, Any] = {"specularFactor": self.specular} if self.specular < 1 else {}
        specular |= {"specularColorFactor": list(colour)} if colour != (1.0, 1.0, 1.0) else {}
        through: dict[str, Any] = {"diffuseTransmissionFactor": self.through}
        through |= {"diffuseTransmissionColorFactor": list(three(self.through_colour))}
        anisotropy = {"anisotropyStrength": self.strength}
        anisotropy |= {} if self.axis == "t" else {"anisotropyRotation": math.pi / 2}
        extensions = {
            "specular": specular if dielectric else {},
            "ior": {"ior": self.ior} if dielectric and self.ior != 1.5 else {},
            "transmission": {"transmissionFactor": self.transmission} if dielectric and self.transmission > 0 else {},
            "diffuse_transmission": through if dielectric and self.through > 0 else {},
            "anisotropy": anisotropy if self.strength > 0 else {},
        }
        material: dict[str, Any] = {"name": name, "pbrMetallicRoughness": pbr}
        if any(extensions.values()):
            material["extensions"] = {f"KHR_materials_{key}": value for key, value in extensions.items() if value}
        if self.transmission > 0 or self.through > 0:
            material["doubleSided"] = True
        return material


def write(subject: Subject, path: Path, progress: Progress = silent) -> Cost:
    """Write a .gltf with embedded buffers, or a .glb, of a sphere with the material."""
    material = matching.material_of(subject)
    fitted, cost = likeness(material, progress)
    document, buffer = _sphere(fitted, material)
    with atomic_path(path) as temporary:
        if path.suffix.lower() == ".glb":
            temporary.write_bytes(glb_bytes(document, buffer))
        else:
            uri = f"data:application/octet-stream;base64,{base64.b64encode(buffer).decode()}"
            document["buffers"][0]["uri"] = uri
            temporary.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return cost


def likeness(material: Material, progress: Progress = silent) -> tuple[GltfMaterial, Cost]:
    """The glTF material closest to `material`, rounded as in the file, and its cost."""
    check, lost = pairs_of(material, CHECK_LOG2, seed=1), matching.shape_losses(material)
    towards_light = matching.kept_towards_light(material)
    material = matching.without_retro(material)
    pairs = pairs_of(material, FIT_LOG2, seed=0)
    space = _Space(material, pairs.samples.f.shape[1])

    def best(metallic: float | None, starts: list[Floats]) -> tuple[Floats, float]:
        bounds = space.bounds(metallic)
        return matching.match(pairs, lambda x: space.read(x).eval(pairs), starts, bounds, progress, NAME)

    ends = [best(metallic, space.starts(metallic)) for metallic in (1.0, 0.0)]
    if not material.transmits:
        x, total = best(None, [np.where(np.arange(len(x)) == 0, 0.5, x) for x, _ in ends])
        ends.append((x, total / SIMPLER**2))
    fitted = space.read(min(ends, key=lambda end: end[1])[0], rounded=True)
    return fitted, matching.cost_of(check, fitted.eval(check), [*lost, *_lost(material, fitted)], towards_light)


class _Space:
    """The parameters in search coordinates: roots of colours, the logarithm of the finer roughness."""

    def __init__(self, material: Material, channels: int) -> None:
        self.material, self.channels = material, channels
        self.isotropic = is_isotropic(material)
        ranked = sorted(material.lobes, key=matching.brightness, reverse=True)
        self.axis: Literal["t", "b"] = "b" if ranked and ranked[0].my > ranked[0].mx else "t"
        grey = all(len({k * r for k, r in zip(lobe.k, lobe.r0, strict=True)}) == 1 for lobe in ranked)
        self.f0 = slice(6 + channels, 6 + channels + (1 if grey else channels))

    def bounds(self, metallic: float | None) -> tuple[Floats, Floats]:
        """metallic, ln of the finer alpha, strength, specular, transmission, through, then base, F0, through colour."""
        c, f0_count = self.channels, self.f0.stop - self.f0.start
        low = np.array([metallic or 0.0, np.log(ALPHA_MIN), *np.zeros(4 + 2 * c + f0_count)])
        high = np.array([1.0, np.log(ALPHA_MAX), *np.ones(4 + c), *np.full(f0_count, np.sqrt(F0_MAX)), *np.ones(c)])
        metal = metallic == 1.0
        closed = {
            0: metallic is not None,
            1: not self.material.lobes,
            2: self.isotropic,
            3: metal or not self.material.lobes,
            4: metal or not self.material.transmission_lobes,
            5: metal or not any(self.material.kt_d),
        }
        for i, shut in closed.items():
            if shut:
                high[i] = low[i]
        if closed[5]:
            high[self.f0.stop :] = low[self.f0.stop :]
        if closed[3]:
            high[self.f0] = low[self.f0]
        return low, high

    def starts(self, metallic: float) -> list[Floats]:
        """One start per lobe, using the material's own parameters where they have a counterpart."""
        c = self.channels
        starts = []
        for lobe in self.material.lobes or (None,):
            mx, my = matching.slope_start(lobe, "ggx") if lobe else (ALPHA_MAX, ALPHA_MAX)
            narrow, wide = min(mx, my), max(mx, my)
            strength = np.sqrt((wide - narrow) / max(1 - narrow, 1e-6))
            peak = np.array(lobe.k)[:c] * np.array(lobe.r0)[:c] if lobe else np.zeros(c)
            kt = np.array(self.material.transmission_lobes[0].k)[:c] if self.material.transmission_lobes else 0.0
            base = peak if metallic else np.maximum(np.array(self.material.kd)[:c], kt)
            share = 0.9 if self.material.transmission_lobes else 0.0
            start = [metallic, np.log(narrow), strength, 0.9, share, 0.5 if any(self.material.kt_d) else 0.0]
            f0 = np.sqrt(np.clip(peak, 0.001, F0_MAX))[: self.f0.stop - self.f0.start]
            starts.append(np.array([*start, *np.sqrt(np.clip(base, 0.001, 1)), *f0, *np.full(c, 0.7)]))
        return starts

    def read(self, x: Floats, rounded: bool = False) -> GltfMaterial:
        """The glTF material of a parameter vector; `rounded` as in the file."""
        c = self.channels
        base, through_colour = x[6 : 6 + c] ** 2, x[self.f0.stop :] ** 2
        f0 = np.broadcast_to(x[self.f0] ** 2, base.shape)
        brightest = max(float(f0.max()), 1e-9)
        names = ("metallic", "roughness", "strength", "specular", "transmission", "through")
        numbers = {name: float(value) for name, value in zip(names, x, strict=False)}
        numbers |= {"roughness": float(np.sqrt(np.exp(x[1]))), "ior": ior_of(brightest)}
        colour = f0 / brightest if x[3] > 0 and brightest > 1e-9 else np.ones_like(f0)
        if rounded:
            numbers = {name: _near_ends(round(value, 6)) for name, value in numbers.items()}
            base, colour, through_colour = (np.array(three(v))[:c] for v in (base, colour, through_colour))
        return GltfMaterial(base, colour, through_colour, axis=self.axis, **numbers)


def _near_ends(value: float) -> float:
    """Snap a value within NEGLIGIBLE of 0 or 1."""
    return next((end for end in (0.0, 1.0) if abs(value - end) < NEGLIGIBLE), value)


def _lost(material: Material, fitted: GltfMaterial) -> list[str]:
    lost = []
    for side, several in (("reflection", material.reflection_lobes), ("transmission", material.transmission_lobes)):
        if len(several) > 1:
            lost.append(f"{len(several)} lobes of {side} became one")
    if not is_isotropic(material) and fitted.strength == 0:
        lost.append("the brushing direction: the best single lobe is isotropic")
    if material.transmission_lobes:
        lost.append("reflected and transmitted light share one roughness, and the base colour tints both kinds")
    if fitted.through > 0:
        lost.append("diffuse transmission needs KHR_materials_diffuse_transmission; other viewers leave it out")
    if fitted.transmission == 0 and material.transmission_lobes:
        lost.append("transmitted light: reflection outweighs it in the one lobe there is")
    return lost


def _sphere(fitted: GltfMaterial, material: Material) -> tuple[dict[str, Any], bytes]:
    """The document without its buffer's address, and the buffer: indices, positions, normals and, if brushed, tangents.

    The sphere is brushed along its circles of latitude: the tangent is t, b = n x t.
    """
    normals, tangents, faces = _unit_sphere()
    columns = {"POSITION": RADIUS_M * normals, "NORMAL": normals}
    if fitted.strength > 0:
        columns["TANGENT"] = np.concatenate([tangents, np.ones((len(tangents), 1))], axis=1)
    vectors = [column.astype("<f4") for column in columns.values()]
    accessors = [{"bufferView": 0, "componentType": 5123, "count": faces.size, "type": "SCALAR"}] + [
        {"bufferView": i, "componentType": 5126, "count": len(vector), "type": f"VEC{vector.shape[1]}"}
        for i, vector in enumerate(vectors, 1)
    ]
    accessors[1] |= {"min": vectors[0].min(axis=0).tolist(), "max": vectors[0].max(axis=0).tolist()}
    parts = [part.tobytes() for part in (faces.astype("<u2"), *vectors)]
    starts = np.cumsum([0, *map(len, parts)]).tolist()
    views = [
        {"buffer": 0, "byteOffset": start, "byteLength": len(part), "target": 34962 if i else 34963}
        for i, (start, part) in enumerate(zip(starts, parts, strict=False))
    ]
    attributes = {name: i for i, name in enumerate(columns, 1)}
    described = fitted.document(material.name)
    described["extras"] = {"lambent_material": material.model_dump(mode="json")}
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "Lambent"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "sphere"}],
        "meshes": [{"name": "sphere", "primitives": [{"attributes": attributes, "indices": 0, "material": 0}]}],
        "materials": [described],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": starts[-1]}],
    }
    if described.get("extensions"):
        document["extensionsUsed"] = sorted(described["extensions"])
    return document, b"".join(parts)


def _unit_sphere() -> tuple[Floats, Floats, NDArray[np.integer]]:
    """Normals and tangents (V, 3) of a sphere, y up, and its triangles (T, 3), all with an area."""
    theta, phi = np.linspace(0, np.pi, ROWS + 1), np.linspace(0, 2 * np.pi, AROUND + 1)
    # Each triangle at a pole has its own pole vertex, so that the vertex has the tangent of its sector.
    turn = np.tile(phi, (ROWS + 1, 1))
    turn[[0, -1]] += np.pi / AROUND
    sin_theta = np.sin(theta)[:, None]
    sin_theta[[0, -1]] = 0
    up = np.broadcast_to(np.cos(theta)[:, None], turn.shape)
    normals = np.stack([sin_theta * np.cos(turn), up, -sin_theta * np.sin(turn)], axis=-1)
    tangents = np.stack([-np.sin(turn), np.zeros_like(turn), -np.cos(turn)], axis=-1)
    index = np.arange(turn.size).reshape(turn.shape)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    lower = np.stack([a, b, c], axis=-1)[:-1].reshape(-1, 3)  # the last row ends in the pole
    upper = np.stack([a, c, d], axis=-1)[1:].reshape(-1, 3)  # the first row begins in it
    caps = np.stack([a[-1], b[-1], d[-1]], axis=-1)
    used, faces = np.unique(np.concatenate([lower, upper, caps]), return_inverse=True)
    return normals.reshape(-1, 3)[used], tangents.reshape(-1, 3)[used], faces.reshape(-1, 3)
