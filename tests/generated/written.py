"""Files of the scenes in `unseen`: furnished rooms as scene.toml and .glb, bare glTF and OBJ as other programs do."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.creation import icosphere

from lambent.core.glb import glb_bytes
from tests.generated.lit_rooms import shell
from tests.generated.rooms import Add, Vector, adding_to, between, saved

Floats = NDArray[np.floating]
MATERIALS = {
    "walls": "kd = [0.74, 0.73, 0.7]",
    "floors": "kd = [0.3, 0.29, 0.28], lobes = [{ mx = 0.12, my = 0.12, r0 = 0.045 }]",
    "wood": "kd = [0.4, 0.25, 0.12], lobes = [{ mx = 0.2, my = 0.2, r0 = 0.04 }]",
    "steel": "lobes = [{ mx = 0.15, my = 0.15, r0 = [0.6, 0.61, 0.62], k = 0.9 }]",
    "red": "kd = [0.6, 0.08, 0.05]",
    "lamp": "kd = 0.5",
}
ASSIGN = {"wall*": "walls", "floor*": "floors", "wood*": "wood", "steel*": "steel", "red*": "red", "lamp*": "lamp"}
EYE, TARGET = (1.6, 1.5, 2.1), (-0.4, 0.8, -0.8)


@dataclass(frozen=True)
class Look:
    """What a scene.toml says beside its geometry; `more` is further text, such as lights."""

    name: str
    materials: Mapping[str, str] = field(default_factory=dict)
    assign: Mapping[str, str] = field(default_factory=dict)
    eye: Vector = EYE
    target: Vector = TARGET
    more: str = ""
    geometry: str = ""

    def toml(self, objects: Iterable[str]) -> str:
        """Text of a scene of these objects."""
        materials = "\n".join(f"{name} = {{ {text} }}" for name, text in {**MATERIALS, **self.materials}.items())
        assign = "\n".join(f'"{name}" = "{material}"' for name, material in {**ASSIGN, **self.assign}.items()
                           if any(fnmatchcase(o, name) for o in objects))  # fmt: skip
        geometry = self.geometry or json.dumps(f"{self.name}.glb")
        return (
            f'format = "lambent-scene"\nversion = 1\nname = "{self.name}"\ngeometry = {geometry}\ncrease_angle = 30.0\n'
            f'\n[materials]\n{materials}\n\n[assign]\n{assign}\n{self.more}\n[[cameras]]\nname = "view"\n'
            f"position = {list(self.eye)}\ntarget = {list(self.target)}\nfov_y_deg = 58.0\n"
        )


@dataclass
class Room:
    """A scene of named pieces, to be written as NAME.glb and scene.toml."""

    look: Look
    scene: trimesh.Scene = field(default_factory=trimesh.Scene)

    @property
    def add(self) -> Add:
        return adding_to(self.scene)

    def furnish(self, ball: int = 4) -> Room:
        """A room of 4 m by 5 m and 2.6 m high, with a table, a ball of 20 x 4^`ball` triangles on it, and a box."""
        shell(self.add, 2.0, 2.5, 2.6)
        self.add(between((-0.7, 0.7, -0.4), (0.7, 0.74, 0.4)), "wood_top", (-0.4, 0, -0.8), 20)
        self.add(between((-0.2, 0, -0.2), (0.2, 0.7, 0.2)), "steel_leg", (-0.4, 0, -0.8), 20)
        self.add(icosphere(ball, 0.18), "steel_ball", (-0.3, 0.921, -0.7))
        self.add(between((-0.25, 0, -0.25), (0.25, 0.6, 0.25)), "red_box", (1.1, 0, -1.2), -15)
        return self

    def written(self, folder: Path, files: Mapping[str, str] | None = None) -> Path:
        return saved(self.scene, self.look.name, folder, self.look.toml(self.scene.geometry), files)


def lamp(luminance: float = 4000.0, name: str = "lamp*") -> str:
    return f'\n[objects."{name}"]\nluminance = {luminance}\n'


def panel(add: Add, at: Vector = (0, 2.5, 0), half: tuple[float, float] = (0.4, 0.4)) -> None:
    """A lamp, a thin box that shines to all sides."""
    add(between((-half[0], -0.01, -half[1]), (half[0], 0.01, half[1])), "lamp", at)


@dataclass(frozen=True)
class Piece:
    """A node of a bare glTF file. Pieces with the same `mesh` are its instances, unless their `uv` (V, 2) differ."""

    name: str
    mesh: trimesh.Trimesh
    material: int | None = 0
    place: Floats | None = None
    normals: Floats | None = None
    uv: Floats | None = None


def glb(path: Path, pieces: Sequence[Piece], materials: Sequence[Mapping[str, Any]] = ({},), **more: Any) -> Path:
    """Write pieces as glTF with the arrays that they have and no others; `more` are further top-level members."""
    path.parent.mkdir(parents=True, exist_ok=True)
    binary, views, accessors, meshes, nodes = bytearray(), [], [], [], []

    def accessor(values: NDArray[Any], kind: str) -> int:
        component = {"f": 5126, "u": 5125}[values.dtype.kind]
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": values.nbytes})
        binary.extend(values.tobytes())
        entry = {"bufferView": len(views) - 1, "componentType": component, "type": kind}
        bounds = {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()} if kind == "VEC3" else {}
        bounds = bounds if np.isfinite(values).all() and len(values) else {}
        accessors.append({**entry, "count": len(values) if kind != "SCALAR" else values.size, **bounds})
        return len(accessors) - 1

    numbers: dict[tuple[int, int | None, int], int] = {}
    for piece in pieces:
        key = id(piece.mesh), piece.material, id(piece.uv)
        if key not in numbers and len(piece.mesh.faces):
            attributes = {"POSITION": accessor(np.asarray(piece.mesh.vertices, np.float32), "VEC3")}
            if piece.normals is not None:
                attributes["NORMAL"] = accessor(np.asarray(piece.normals, np.float32), "VEC3")
            if piece.uv is not None:
                attributes["TEXCOORD_0"] = accessor(np.asarray(piece.uv, np.float32), "VEC2")
            faces = accessor(np.asarray(piece.mesh.faces, np.uint32), "SCALAR")
            primitive = {"attributes": attributes, "indices": faces}
            primitive |= {} if piece.material is None else {"material": piece.material}
            meshes.append({"primitives": [primitive]})
            numbers[key] = len(meshes) - 1
        node: dict[str, Any] = {"name": piece.name} | ({"mesh": numbers[key]} if key in numbers else {})
        nodes.append(node | ({} if piece.place is None else {"matrix": np.asarray(piece.place).T.ravel().tolist()}))
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes,
        "meshes": meshes, "materials": list(materials), "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}], **more,
    }  # fmt: skip
    path.write_bytes(glb_bytes(document, bytes(binary)))
    return path


def obj(path: Path, pieces: Mapping[str, trimesh.Trimesh]) -> Path:
    """Write meshes as OBJ without normals, uv and materials."""
    lines, first = [], 1
    for name, mesh in pieces.items():
        lines.append(f"o {name}")
        lines += [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in mesh.vertices]
        lines += [f"f {a} {b} {c}" for a, b, c in mesh.faces + first]
        first += len(mesh.vertices)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")
    return path


def moved(mesh: trimesh.Trimesh, at: Vector) -> trimesh.Trimesh:
    mesh = mesh.copy()
    mesh.apply_translation(at)
    return mesh


def metallic(colour: Vector, roughness: float = 0.6, metal: float = 0.0, **more: Any) -> dict[str, Any]:
    """A glTF material."""
    base = {"baseColorFactor": [*colour, 1.0], "roughnessFactor": roughness, "metallicFactor": metal}
    return {"pbrMetallicRoughness": base, **more}
