"""Parts of objects: the neighbours' faces that each part's probe also lights (part_share.wgsl)."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.objects.clusters import MERGED_GAP, Ranges, merged
from lambent.scenes.scene import Border
from lambent.store.contract import ObjectRecord

WITHIN: Border = (0.0, 0.0, 0.0, 1.0)  # a border with every point inside


def neighbouring_faces(scene: BakedScene) -> dict[str, Ranges]:
    """(first, count) of the faces of an object's other parts that a part lights with a share, by part name."""
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
    """Whether a part with these borders may have a share of points of triangles (F, 3, 3)."""
    n, d = np.array(borders)[:, :3], np.array(borders)[:, 3]
    return np.asarray(((corners @ n.T + d).max(axis=1) > -0.5).all(axis=1))
