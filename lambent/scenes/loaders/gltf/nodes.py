"""glTF 2.0: nodes, meshes, lights and cameras, brought into world space."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core.ceilings import NODES, TRIANGLES, VARIANTS
from lambent.core.errors import UserError
from lambent.core.geometry.directions import Floats, normalize
from lambent.core.light.photometry import radiometric
from lambent.core.plain import Triple, UniqueNames, triple
from lambent.core.views.camera import FARTHEST_M, Camera
from lambent.scenes.geometry import copies_under
from lambent.scenes.loaders.contents import DEFAULTS, Contents, LoadOptions
from lambent.scenes.loaders.gltf.container import Gltf, read
from lambent.scenes.loaders.gltf.luminaires import Luminaires
from lambent.scenes.loaders.gltf.materials import Textures, main_uv_set, surface_of
from lambent.scenes.loaders.gltf.posed import Pose, instances_of, joint_matrices, locals_of, posed
from lambent.scenes.loaders.gltf.schema import READ_EXTENSIONS, MaterialDocument, Node, Primitive
from lambent.scenes.loaders.meshes.repair import MeshArrays, mesh_of
from lambent.scenes.loaders.surfaces.material_builder import MaterialBuilder
from lambent.scenes.scene import DirectionalLight, Light, Mesh, PointLight, SceneObject

WIDEST_RAD = 3.1  # exclusive, of cameras
_Key = tuple[int, int, int, tuple[float, ...], int]  # of a mesh: its number, primitive, uv set, morph weights, skin
DRACO = "KHR_draco_mesh_compression"


def load(path: Path, options: LoadOptions = DEFAULTS) -> Contents:
    """Contents of a .glb or .gltf file.

    Names are the nodes', made unique (with a warning); a mesh of several materials becomes an object per material.

    Raises
    ------
    UserError
        If the file is damaged or has no triangles.
    """
    reading = _Reading(read(path, options.root), options.crease_deg)
    reading.walk()
    reading.add_skinned()
    reading.place()
    return reading.contents()


class _Materials:
    """The materials of a file by number, -1 for the default."""

    def __init__(self, gltf: Gltf) -> None:
        self._documents = [*gltf.document.materials, MaterialDocument(name="default")]
        names = UniqueNames()
        self._names = [names.unique(d.name or f"material_{i}") for i, d in enumerate(self._documents)]
        self.textures = Textures(gltf)
        self.made = MaterialBuilder()

    def use(self, number: int) -> tuple[str, Triple]:
        """Name of a material, and the radiance it emits."""
        name = self._names[number]
        self.made.make(name, lambda notes: surface_of(self._documents[number], self.textures, notes))
        return name, self.made.emission[name]

    def uv_set(self, number: int) -> int:
        return main_uv_set(self._documents[number])


class _Reading:
    """State of reading one file."""

    def __init__(self, gltf: Gltf, crease_deg: float | None) -> None:
        self._gltf, self._materials, self._crease_deg = gltf, _Materials(gltf), crease_deg
        self._variants: dict[str, dict[str, tuple[str, Triple]]] = {}
        self._objects: list[SceneObject] = []
        self._lights: list[Light] = []
        self._cameras: list[Camera] = []
        self._warnings: list[str] = []
        self._luminaires = Luminaires(gltf, self._warnings.append)
        self._names, self._camera_names = UniqueNames(), UniqueNames()
        self._renamed: dict[str, list[str]] = {}
        self._meshes: dict[_Key, Mesh | None] = {}
        self._placed: dict[_Key, list[tuple[int, Floats]]] = {}  # by mesh, objects and their transforms
        self._joints: dict[int, Floats] = {}  # where joints of skins stand, by their nodes
        self._skinned: list[tuple[Node, Floats]] = []
        self._triangles = 0

    def contents(self) -> Contents:
        if not self._objects:
            raise UserError("holds no triangles", file=self._gltf.path, hint="; ".join(self._warnings) or None)
        made, images = self._materials.made, self._materials.textures.images
        return Contents(
            tuple(self._objects),
            made.materials,
            tuple(self._lights),
            tuple(self._cameras),
            tuple(self._gltf.files.sources),
            (*self._unread(), *self._warnings, *self._renamings(), *made.notes, *images.notes, *self._gltf.files.notes),
            made.textures,
            variants=self._variants,
            credit=self._gltf.document.copyright,
        )

    def _unread(self) -> Iterator[str]:
        """Unread extensions other than those of materials, which report their own."""
        document = self._gltf.document
        of_materials = {name for material in document.materials for name in material.extensions}
        for name in sorted(set(document.extensionsUsed) - READ_EXTENSIONS - of_materials):
            yield f"extension {name} is ignored"

    def _renamings(self) -> Iterator[str]:
        for name, others in self._renamed.items():
            if len(others) == 1:
                yield f"{name}: the name is used twice; the second is renamed to {others[0]}"
            else:
                times = f"the name is used {len(others) + 1} times"
                yield f"{name}: {times}; the others are renamed to {others[0]} ... {others[-1]}"

    def walk(self) -> None:
        """Visit every node of the scene once, parents first."""
        gltf, document = self._gltf, self._gltf.document
        NODES.check(len(document.nodes), file=gltf.path)
        VARIANTS.check(len(document.variants), file=gltf.path)
        if document.scenes:
            roots = gltf.pick(document.scenes, document.scene, "scene").nodes
        else:
            roots = sorted(set(range(len(document.nodes))) - {c for n in document.nodes for c in n.children})
        matrices, joints = locals_of(document.nodes), {joint for skin in document.skins for joint in skin.joints}
        skewed = np.abs(matrices[:, 3] - (0, 0, 0, 1)).max(axis=1) > 1e-6
        stack = [(index, np.eye(4)) for index in reversed(roots)]
        seen: set[int] = set()
        while stack:
            index, parent = stack.pop()
            field = f"nodes.{index}"
            if index in seen:
                raise UserError(
                    "node has several parents or is part of a cycle", file=gltf.path, field=field, expected="a tree"
                )
            seen.add(index)
            node = gltf.pick(document.nodes, index, "nodes")
            if skewed[index]:
                last = matrices[index, 3].tolist()
                raise gltf.error("not an affine matrix", f"{field}.matrix", last, "a last row of 0 0 0 1")
            world = parent @ matrices[index]
            if not np.abs(world).max() < FARTHEST_M:
                raise UserError("transform is not finite or too large", file=gltf.path, field=field)
            if index in joints:
                self._joints[index] = world
            self._visit(node, world)
            stack += [(child, world) for child in reversed(node.children)]

    def _visit(self, node: Node, world: Floats) -> None:
        if node.mesh is not None and node.skin is not None:
            self._skinned.append((node, world))
        elif node.mesh is not None and node.instances is not None:
            for number, place in enumerate(instances_of(self._gltf, node.instances, node.name or "instances"), 1):
                self._add_mesh(node.mesh, f"{node.name}_{number}" if node.name else None, world @ place, node.weights)
        elif node.mesh is not None:
            self._add_mesh(node.mesh, node.name, world, node.weights)
        if node.camera is not None:
            self._add_camera(node.camera, node.name, world)
        if node.luminaire is not None:  # a fallback next to it serves programs that cannot read luminaires
            luminaire = self._luminaires.at(node, world)
            self._lights += [replace(luminaire, name=node.name or "")] if luminaire is not None else []
        elif node.light is not None:
            self._add_light(node.light, node.name, world)

    def add_skinned(self) -> None:
        """Add the meshes that joints place: their own nodes do not, by glTF's rules."""
        for node, world in self._skinned:
            assert node.mesh is not None and node.skin is not None
            joints = joint_matrices(self._gltf, node.skin, self._joints)
            if joints is None:
                name = node.name or f"mesh_{node.mesh}"
                self._warnings.append(f"{name}: its skin is ignored, not all of its joints are in the scene")
                self._add_mesh(node.mesh, node.name, world, node.weights)
            else:
                self._add_mesh(node.mesh, node.name, np.eye(4), node.weights, (node.skin, joints))

    def _add_mesh(
        self,
        index: int,
        node_name: str | None,
        world: Floats,
        weights: Sequence[float] | None = None,
        skin: tuple[int, Floats] | None = None,
    ) -> None:
        gltf = self._gltf
        mesh = gltf.pick(gltf.document.meshes, index, "meshes")
        morph = tuple(weights or mesh.weights or ())
        pose = Pose(morph, None if skin is None else skin[1])
        wanted = node_name or mesh.name or f"mesh_{index}"
        if _volume(world) < 1e-18:
            self._warnings.append(f"{wanted}: left out, its node's scale is zero")
            return
        for k, primitive in enumerate(mesh.primitives):
            number = -1 if primitive.material is None else self._checked(primitive.material)
            uv_set = self._materials.uv_set(number)
            key = (index, k, uv_set, morph, -1 if skin is None else skin[0])
            if key not in self._meshes:
                title = f"{wanted} ({k})" if k else wanted
                self._meshes[key], notes = _primitive(gltf, primitive, title, uv_set, pose, self._crease_deg)
                self._warnings += notes
            local = self._meshes[key]
            if local is None:
                continue
            self._triangles += len(local.faces)
            TRIANGLES.check(self._triangles, file=gltf.path)
            material, emission = self._materials.use(number)
            single = wanted if len(mesh.primitives) == 1 else f"{wanted}_{material}"
            name = self._names.unique(single)
            if name != single:
                self._renamed.setdefault(single, []).append(name)
            self._placed.setdefault(key, []).append((len(self._objects), world))
            self._objects.append(SceneObject(name, local, material, emission))  # where it is placed follows for all
            self._note_variants(primitive, name)

    def place(self) -> None:
        """Bring the objects of every mesh into the world, all copies of one at once."""
        for key, placed in self._placed.items():
            numbers, worlds = zip(*placed, strict=True)
            local = self._meshes[key]
            assert local is not None
            for number, mesh in zip(numbers, copies_under(local, np.array(worlds)), strict=True):
                o = self._objects[number]
                self._objects[number] = SceneObject(o.name, mesh, o.material, o.emission)

    def _note_variants(self, primitive: Primitive, name: str) -> None:
        """Record an object's material in each material set of the file that has one for it."""
        listed = self._gltf.document.variants
        for variant in listed:
            self._variants.setdefault(variant.name, {})
        for mapping in primitive.variants:
            material = self._materials.use(self._checked(mapping.material))
            for number in mapping.variants:
                self._variants[self._gltf.pick(listed, number, "variants").name][name] = material

    def _checked(self, material: int) -> int:
        self._gltf.pick(self._gltf.document.materials, material, "material")
        return material

    def _add_camera(self, index: int, node_name: str | None, world: Floats) -> None:
        camera = self._gltf.pick(self._gltf.document.cameras, index, "cameras")
        wanted = node_name or camera.name or f"camera_{index}"
        if camera.yfov is None:
            self._warnings.append(f"{wanted}: left out, a camera without perspective")
            return
        if not 0 < camera.yfov < WIDEST_RAD:
            self._warnings.append(f"{wanted}: left out, a field of view of {math.degrees(camera.yfov):.3g} degrees")
            return
        if _volume(world) < 1e-18:
            self._warnings.append(f"{wanted}: left out, its node's scale is zero")
            return
        name = self._camera_names.unique(wanted)
        position, forward, up = world[:3, 3], -normalize(world[:3, 2]), normalize(world[:3, 1])
        target, fov_y_deg = triple(position + forward), math.degrees(camera.yfov)
        self._cameras.append(Camera(name, triple(position), target, triple(up), fov_y_deg))

    def _add_light(self, index: int, node_name: str | None, world: Floats) -> None:
        light = self._gltf.pick(self._gltf.document.lights, index, "lights")
        power = triple(radiometric(np.asarray(light.color) * light.intensity))
        position, direction = triple(world[:3, 3]), triple(-normalize(world[:3, 2]))
        name = node_name or light.name or ""
        if light.type == "directional":
            self._lights.append(DirectionalLight(direction, power, name))
        elif light.type == "point":
            self._lights.append(PointLight(position, power, name=name))
        else:
            inner, outer = math.degrees(light.inner_rad), math.degrees(light.outer_rad)
            self._lights.append(PointLight(position, power, direction, min(inner, outer), outer, name))


def _volume(world: Floats) -> float:
    """How much larger a transform (4, 4) makes things; for so many nodes numpy's determinant is slow."""
    (a, b, c), (d, e, f), (g, h, i) = world[:3, :3].tolist()
    return math.fabs(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))


def _primitive(
    gltf: Gltf, primitive: Primitive, name: str, uv_set: int, pose: Pose, crease_deg: float | None
) -> tuple[Mesh | None, list[str]]:
    attributes = primitive.attributes
    if "POSITION" not in attributes:
        return None, [f"{name}: left out, it has no positions"]
    if primitive.mode not in (4, 5, 6):
        return None, [f"{name}: left out, it is points or lines"]
    if DRACO in primitive.extensions and not gltf.is_stored(attributes["POSITION"]):
        return None, [f"{name}: left out, it is compressed ({DRACO}): export without compression"]
    positions = gltf.floats(attributes["POSITION"], 3, f"{name} POSITION")
    if primitive.indices is None:
        order = np.arange(len(positions))
    else:
        order = gltf.accessor(primitive.indices)[:, 0].astype(np.int64)
    notes: list[str] = []
    count, used = len(positions), np.arange(len(positions))
    if len(order) < count and order.size and int(order.max()) < count:  # a small part of a shared accessor
        used, order = np.unique(order, return_inverse=True)
        positions = positions[used]
    faces = _faces(order, primitive.mode)
    TRIANGLES.check(len(faces), file=gltf.path, field=name)
    if primitive.mode == 4 and len(order) % 3:
        notes.append(f"{name}: {len(order) % 3} indices at the end are ignored")

    def optional(attribute: str, width: int) -> Floats | None:
        if attribute not in attributes:
            return None
        array = gltf.floats(attributes[attribute], width, f"{name} {attribute}")
        if len(array) != count:
            raise gltf.error("wrong length", f"{name} {attribute}", len(array), count)
        return array[used]

    if "COLOR_0" in attributes:
        notes.append(f"{name}: vertex colours are ignored")
    uv = optional(f"TEXCOORD_{uv_set}", 2)
    if uv is not None:
        uv = uv * (1, -1) + (0, 1)  # glTF measures v from the top
    tangents = optional("TANGENT", 4)
    if tangents is not None:
        tangents = tangents[:, :3]
    arrays = MeshArrays(positions, faces, optional("NORMAL", 3), uv, tangents)
    arrays = posed(gltf, primitive, name, arrays, used, pose)
    mesh, repaired = mesh_of(arrays, name=name, file=gltf.path, crease_deg=crease_deg)
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
