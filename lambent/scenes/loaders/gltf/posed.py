"""Meshes as a glTF file poses them, and transforms of its nodes and instances, all of a kind at once.

Morph targets are applied by their weights, then the skin by its joints where they stand. Animations are not read: the
pose is the one that a viewer shows before it plays any.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.core.ceilings import NODES
from lambent.core.geometry.directions import normalize
from lambent.scenes.loaders.gltf.container import Gltf
from lambent.scenes.loaders.gltf.schema import Node, Primitive
from lambent.scenes.loaders.meshes.repair import MeshArrays

MORPHED = {"POSITION": "positions", "NORMAL": "normals", "TANGENT": "tangents"}


@dataclass(frozen=True)
class Pose:
    """Weights of morph targets, and world matrices (J, 4, 4) of a skin's joints, from where they are bound."""

    weights: tuple[float, ...] = ()
    joints: Floats | None = None


def joint_matrices(gltf: Gltf, skin: int, worlds: Mapping[int, Floats]) -> Floats | None:
    """World matrices (J, 4, 4) of the joints of a skin; None where one is not in the scene."""
    document = gltf.pick(gltf.document.skins, skin, "skins")
    if not all(joint in worlds for joint in document.joints):
        return None
    matrices = np.array([worlds[joint] for joint in document.joints]).reshape(-1, 4, 4)
    if document.inverseBindMatrices is None:
        return matrices
    field = f"skins.{skin}.inverseBindMatrices"
    bound = gltf.floats(document.inverseBindMatrices, 16, field)
    if len(bound) < len(matrices):
        raise gltf.error("wrong length", field, len(bound), len(matrices))
    return np.asarray(matrices @ bound[: len(matrices)].reshape(-1, 4, 4).transpose(0, 2, 1))


def posed(gltf: Gltf, primitive: Primitive, name: str, arrays: MeshArrays, used: Indices, pose: Pose) -> MeshArrays:
    """The arrays of a primitive, whose vertices `used` (V,) they are, in a pose."""
    for target, weight in zip(primitive.targets or (), pose.weights, strict=False):
        if weight == 0:
            continue
        for attribute, field in MORPHED.items():
            before = getattr(arrays, field)
            if attribute in target and before is not None:
                moved = _of_vertices(gltf, target[attribute], 3, f"{name} target {attribute}", used)
                arrays = replace(arrays, **{field: before + weight * moved})
    return arrays if pose.joints is None else _skinned(gltf, primitive, name, arrays, used, pose.joints)


def _skinned(
    gltf: Gltf, primitive: Primitive, name: str, arrays: MeshArrays, used: Indices, joints: Floats
) -> MeshArrays:
    blend, total = np.zeros((len(arrays.positions), 4, 4)), np.zeros(len(arrays.positions))
    for number in range(8):
        attributes = f"JOINTS_{number}", f"WEIGHTS_{number}"
        if not all(attribute in primitive.attributes for attribute in attributes):
            break
        which, weights = (_of_vertices(gltf, primitive.attributes[a], 4, f"{name} {a}", used) for a in attributes)
        if which.size and which.max() >= len(joints):
            raise gltf.error("index out of range", f"{name} {attributes[0]}", int(which.max()), f"below {len(joints)}")
        for joint, weight in zip(which.T.astype(int), weights.T, strict=True):
            blend += weight[:, None, None] * joints[joint]
            total += weight
    blend /= np.where(total > 0, total, 1)[:, None, None]
    linear = blend[:, :3, :3]
    positions = np.einsum("vij,vj->vi", linear, arrays.positions) + blend[:, :3, 3]
    cofactors = np.stack([np.cross(linear[:, :, (i + 1) % 3], linear[:, :, (i + 2) % 3]) for i in range(3)], axis=2)
    turned = np.sign((cofactors[:, :, 0] * linear[:, :, 0]).sum(axis=1))  # of the determinant
    normals = None if arrays.normals is None else normalize(np.einsum("vij,vj->vi", cofactors, arrays.normals))
    return replace(
        arrays, positions=positions, normals=None if normals is None else normals * turned[:, None],
        tangents=None if arrays.tangents is None else np.einsum("vij,vj->vi", linear, arrays.tangents),
        triangles=arrays.triangles[:, ::-1] if np.median(turned) < 0 else arrays.triangles,
    )  # fmt: skip


def _of_vertices(gltf: Gltf, accessor: int, width: int, field: str, used: Indices) -> Floats:
    values = gltf.floats(accessor, width, field)
    if len(used) and len(values) <= used.max():
        raise gltf.error("wrong length", field, len(values), f"at least {used.max() + 1}")
    return values[used]


def locals_of(nodes: Sequence[Node]) -> Floats:
    """(N, 4, 4) matrices of nodes, relative to their parents."""
    moves, turns, scales = (
        np.array([getattr(node, part) for node in nodes], float).reshape(len(nodes), -1)
        for part in ("translation", "rotation", "scale")
    )
    matrices = _matrices(moves, turns, scales) if nodes else np.zeros((0, 4, 4))
    given = [i for i, node in enumerate(nodes) if node.matrix is not None]
    matrices[given] = np.array([nodes[i].matrix for i in given], float).reshape(-1, 4, 4).transpose(0, 2, 1)
    return matrices


def instances_of(gltf: Gltf, attributes: Mapping[str, int], name: str) -> Floats:
    """(N, 4, 4) matrices of a node's instances by EXT_mesh_gpu_instancing, relative to the node."""
    found = {
        part: gltf.floats(attributes[part], width, f"{name} {part}")
        for part, width in (("TRANSLATION", 3), ("ROTATION", 4), ("SCALE", 3))
        if part in attributes
    }
    counts = {len(values) for values in found.values()}
    if len(counts) != 1:
        raise gltf.error("instances have no number", name, sorted(counts), "attributes of one length")
    count = counts.pop()
    NODES.check(count, file=gltf.path, field=name)
    usual = {"TRANSLATION": (0.0, 0.0, 0.0), "ROTATION": (0.0, 0.0, 0.0, 1.0), "SCALE": (1.0, 1.0, 1.0)}
    return _matrices(*(found.get(part, np.tile(value, (count, 1))) for part, value in usual.items()))


def _matrices(translations: Floats, quaternions: Floats, scales: Floats) -> Floats:
    """(N, 4, 4) of translations (N, 3), rotations (N, 4) as x, y, z, w, and scales (N, 3); 0 is no rotation."""
    x, y, z, w = normalize(np.where(quaternions.any(axis=1, keepdims=True), quaternions, (0.0, 0.0, 0.0, 1.0))).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrices = np.tile(np.eye(4), (len(scales), 1, 1))
    matrices[:, :3, :3] = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2) * scales[:, None]
    matrices[:, :3, 3] = translations
    return matrices
