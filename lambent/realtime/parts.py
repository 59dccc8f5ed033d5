"""Parts of objects: where the light of one part's probe reaches its neighbours' faces (shaders/part_share.wgsl)."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.realtime.baked import BakedScene
from lambent.realtime.clusters import MERGED_GAP, Ranges, merged
from lambent.scenes.scene import Border
from lambent.store.contract import ObjectRecord

WITHIN: Border = (0.0, 0.0, 0.0, 1.0)  # a border that all is within


def neighbouring_faces(scene: BakedScene) -> dict[str, Ranges]:
    """By part of an object, (first, count) of the faces of its other parts that it has a share of."""
    wholes: dict[str, list[ObjectRecord]] = {}
    for o in scene.record.objects:
        if o.borders:
            wholes.setdefault(o.part_of, []).append(o)
    found: dict[str, Ranges] = {}
    for part, other in (pair for parts in wholes.values() for pair in permutations(parts, 2)):
        faces = scene.faces[other.first_face : other.first_face + other.face_count]
        near = np.flatnonzero(reaches(part.borders, scene.positions[faces])) + other.first_face
        mine = merged(zip(near.tolist(), (near + 1).tolist(), strict=True), MERGED_GAP)
        found.setdefault(part.name, []).extend(mine)
    return found


def reaches(borders: tuple[Border, ...], corners: Floats) -> Flags:
    """Whether triangles (F, 3, 3) may have points that a part with these borders has a share of."""
    n, d = np.array(borders)[:, :3], np.array(borders)[:, 3]
    return np.asarray(((corners @ n.T + d).max(axis=1) > -0.5).all(axis=1))
