"""glTF 2.0: nodes, meshes, lights and cameras, brought into world space."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core.camera import Camera
from lambent.core.directions import Floats, normalize
from lambent.core.errors import UserError
from lambent.core.photometry import radiometric
from lambent.core.plain import Triple, triple
from lambent.scenes.geometry import transformed
from lambent.scenes.loaders.contents import Contents, unique_name
from lambent.scenes.loaders.gltf.container import Gltf, read
from lambent.scenes.loaders.gltf.materials import surface_of
from lambent.scenes.loaders.gltf.schema import MaterialDocument, Node, Primitive
from lambent.scenes.loaders.gltf.textures import Textures, main_uv_set
from lambent.scenes.loaders.meshes.repair import MeshArrays, check_triangles, mesh_of
from lambent.scenes.loaders.surfaces.surface import MadeMaterials
from lambent.scenes.scene import DirectionalLight, Light, Mesh, PointLight, SceneObject

FAR = 1e9  # metres


@dataclass
class _Reading:
    """What has been read so far of one file."""

    gltf: Gltf
    materials: _Materials
    variants: dict[str, dict[str, tuple[str, Triple]]] = field(default_factory=dict)
    objects: list[SceneObject] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    cameras: list[Camera] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    names: set[str] = field(default_factory=set)
    camera_names: set[str] = field(default_factory=set)
    meshes: dict[tuple[int, int, int], Mesh | None] = field(default_factory=dict)
    triangles: int = 0


def load(path: Path, root: Path | None = None) -> Contents:
    """Contents of a .glb or .gltf file.

    Names are the nodes', made unique (with a warning); a mesh of several materials becomes an object per material.
    Files it names lie below `root`, by default its own folder.

    Raises
    ------
    UserError
        Where the file is damaged or holds no triangles.
    """
    gltf = read(path, root)
    reading = _Reading(gltf, _Materials(gltf))
    _walk(reading)
    if not reading.objects:
        raise UserError("holds no triangles", file=path, hint="; ".join(reading.warnings) or None)
    made, images = reading.materials.made, reading.materials.textures.images
    return Contents(
        tuple(reading.objects),
        made.materials,
        tuple(reading.lights),
        tuple(reading.cameras),
        tuple(gltf.files.sources),
        (*reading.warnings, *made.notes, *images.notes),
        made.textures,
        variants=reading.variants,
    )


class _Materials:
    """The materials of a file by their number, -1 for the default."""

    def __init__(self, gltf: Gltf) -> None:
        self._documents = [*gltf.document.materials, MaterialDocument(name="default")]
        taken: set[str] = set()
        self._names = [unique_name(d.name or f"material_{i}", taken) for i, d in enumerate(self._documents)]
        self.textures = Textures(gltf)
        self.made = MadeMaterials()

    def use(self, number: int) -> tuple[str, Triple]:
        """Name of a material, and the radiance it emits."""
        name = self._names[number]
        self.made.make(name, lambda notes: surface_of(self._documents[number], self.textures, notes))
        return name, self.made.emission[name]

    def uv_set(self, number: int) -> int:
        return main_uv_set(self._documents[number])


def _walk(reading: _Reading) -> None:
    """Visit every node of the scene once, parents first."""
    gltf = reading.gltf
    document = gltf.document
    if document.scenes:
        roots = gltf.pick(document.scenes, document.scene, "scene").nodes
    else:
        roots = sorted(set(range(len(document.nodes))) - {c for n in document.nodes for c in n.children})
    stack = [(index, np.eye(4)) for index in reversed(roots)]
    seen: set[int] = set()
    while stack:
        index, parent = stack.pop()
        if index in seen:
            raise UserError("node is reached twice", file=gltf.path, field=f"nodes.{index}", expected="a tree")
        seen.add(index)
        node = gltf.pick(document.nodes, index, "nodes")
        world = parent @ _local(node)
        if not (np.abs(world) < FAR).all():
            raise UserError("transform is not finite, or leads absurdly far", file=gltf.path, field=f"nodes.{index}")
        _visit(reading, node, index, world)
        stack += [(child, world) for child in reversed(node.children)]


def _local(node: Node) -> Floats:
    if node.matrix is not None:
        return np.asarray(node.matrix, float).reshape(4, 4).T
    x, y, z, w = normalize(np.asarray(node.rotation, float)) if any(node.rotation) else (0.0, 0.0, 0.0, 1.0)
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ] @ np.diag(node.scale)
    matrix[:3, 3] = node.translation
    return matrix


def _visit(reading: _Reading, node: Node, index: int, world: Floats) -> None:
    if node.mesh is not None:
        _add_mesh(reading, node, world)
    if node.camera is not None:
        _add_camera(reading, node, world)
    if node.light is not None:
        _add_light(reading, node.light, world)


def _add_mesh(reading: _Reading, node: Node, world: Floats) -> None:
    gltf = reading.gltf
    assert node.mesh is not None
    mesh = gltf.pick(gltf.document.meshes, node.mesh, "meshes")
    wanted = node.name or mesh.name or f"mesh_{node.mesh}"
    if abs(np.linalg.det(world[:3, :3])) < 1e-18:
        reading.warnings.append(f"{wanted}: left out, its node's scale is zero")
        return
    for k, primitive in enumerate(mesh.primitives):
        number = -1 if primitive.material is None else _index(gltf, primitive.material)
        uv_set = reading.materials.uv_set(number)
        key = (node.mesh, k, uv_set)
        if key not in reading.meshes:
            reading.meshes[key], notes = _primitive(gltf, primitive, f"{wanted} ({k})" if k else wanted, uv_set)
            reading.warnings += notes
        local = reading.meshes[key]
        if local is None:
            continue
        reading.triangles += len(local.faces)
        check_triangles(reading.triangles, gltf.path)
        material, emission = reading.materials.use(number)
        single = wanted if len(mesh.primitives) == 1 else f"{wanted}_{material}"
        name = unique_name(single, reading.names)
        if name != single:
            reading.warnings.append(f"{single}: the name is used twice, one is now {name}")
        reading.objects.append(SceneObject(name, transformed(local, world), material, emission))
        _note_variants(reading, primitive, name)


def _note_variants(reading: _Reading, primitive: Primitive, name: str) -> None:
    """Note an object's material in each of the file's material sets that has one for it."""
    listed = reading.gltf.document.variants
    for variant in listed:
        reading.variants.setdefault(variant.name, {})
    for mapping in primitive.variants:
        material = reading.materials.use(_index(reading.gltf, mapping.material))
        for number in mapping.variants:
            variant = reading.gltf.pick(listed, number, "variants")
            reading.variants[variant.name][name] = material


def _index(gltf: Gltf, material: int) -> int:
    gltf.pick(gltf.document.materials, material, "material")
    return material


def _primitive(gltf: Gltf, primitive: Primitive, name: str, uv_set: int) -> tuple[Mesh | None, list[str]]:
    attributes = primitive.attributes
    if "POSITION" not in attributes:
        return None, [f"{name}: left out, it has no positions"]
    if primitive.mode not in (4, 5, 6):
        return None, [f"{name}: left out, it is points or lines"]
    positions = gltf.floats(attributes["POSITION"], 3, f"{name} POSITION")
    if primitive.indices is None:
        order = np.arange(len(positions))
    else:
        order = gltf.accessor(primitive.indices)[:, 0].astype(np.int64)
    notes = []
    faces = _faces(order, primitive.mode)
    if primitive.mode == 4 and len(order) % 3:
        notes.append(f"{name}: {len(order) % 3} indices left over")

    def optional(attribute: str, width: int) -> Floats | None:
        if attribute not in attributes:
            return None
        array = gltf.floats(attributes[attribute], width, f"{name} {attribute}")
        if len(array) != len(positions):
            raise gltf.error("wrong length", f"{name} {attribute}", len(array), len(positions))
        return array

    if "COLOR_0" in attributes:
        notes.append(f"{name}: colours of its vertices are not read")
    uv = optional(f"TEXCOORD_{uv_set}", 2)
    if uv is not None:
        uv = uv * (1, -1) + (0, 1)  # glTF counts v from the top
    tangents = optional("TANGENT", 4)
    if tangents is not None:
        tangents = tangents[:, :3]
    arrays = MeshArrays(positions, faces, optional("NORMAL", 3), uv, tangents)
    mesh, repaired = mesh_of(arrays, name=name, file=gltf.path)
    return mesh, notes + repaired


def _faces(order: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """Triangles (T, 3) of a list, strip or fan of indices."""
    if mode == 4:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    if len(order) < 3:
        return np.zeros((0, 3), np.int64)
    if mode == 6:
        return np.stack([np.full(len(order) - 2, order[0]), order[1:-1], order[2:]], axis=-1)
    faces = np.stack([order[:-2], order[1:-1], order[2:]], axis=-1)
    faces[1::2] = faces[1::2][:, [1, 0, 2]]
    return faces


def _add_camera(reading: _Reading, node: Node, world: Floats) -> None:
    gltf = reading.gltf
    assert node.camera is not None
    camera = gltf.pick(gltf.document.cameras, node.camera, "cameras")
    wanted = node.name or camera.name or f"camera_{node.camera}"
    if camera.perspective is None:
        reading.warnings.append(f"{wanted}: left out, a camera without perspective")
        return
    name = unique_name(wanted, reading.camera_names)
    position, forward, up = world[:3, 3], -normalize(world[:3, 2]), normalize(world[:3, 1])
    fov_y_deg = math.degrees(camera.perspective.yfov)
    reading.cameras.append(Camera(name, triple(position), triple(position + forward), triple(up), fov_y_deg))


def _add_light(reading: _Reading, index: int, world: Floats) -> None:
    gltf = reading.gltf
    light = gltf.pick(gltf.document.lights, index, "lights")
    power = triple(radiometric(np.asarray(light.color) * light.intensity))
    direction = triple(-normalize(world[:3, 2]))
    if light.type == "directional":
        reading.lights.append(DirectionalLight(direction, power))
    elif light.type == "point":
        reading.lights.append(PointLight(triple(world[:3, 3]), power))
    else:
        inner, outer = math.degrees(light.spot.innerConeAngle), math.degrees(light.spot.outerConeAngle)
        reading.lights.append(PointLight(triple(world[:3, 3]), power, direction, min(inner, outer), outer))
