"""Transforms of glTF nodes and of their instances, all of a kind at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.ceilings import NODES
from lambent.core.geometry.directions import normalize
from lambent.scenes.loaders.gltf.container import Gltf
from lambent.scenes.loaders.gltf.schema import Node


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
