"""What is left out of a frame cannot be seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.views.camera import Camera, clip_from_world
from lambent.realtime.objects.clusters import CLUSTER_FACES, Clusters
from lambent.scenes.geometry import sphere
from lambent.store.contract import ObjectRecord


def soup(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray, tuple[ObjectRecord, ...]]:
    """Small triangles that wander through a room, in three objects, with faces between them that are nobody's."""
    centres = np.cumsum(rng.normal(0, 0.15, (count, 3)), axis=0)
    positions = (centres[:, None] + rng.normal(0, 0.1, (count, 3, 3))).reshape(-1, 3)
    faces = np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)
    cuts = ((0, 70), (70, 1), (80, count - 80))
    bounds = ((-9.0, -9.0, -9.0), (9.0, 9.0, 9.0))
    objects = tuple(
        ObjectRecord(name=f"o{i}", material="m", first_face=a, face_count=n, bounds=bounds)
        for i, (a, n) in enumerate(cuts)
    )
    return positions, faces, objects


@pytest.mark.parametrize("seed", range(2))
def test_no_triangle_in_view_is_left_out(seed: int) -> None:
    """Points of every triangle, through the same matrix: where one is in the clip volume, its face is drawn."""
    rng = np.random.default_rng(seed)
    positions, faces, objects = soup(rng, 900)
    clusters = Clusters(positions, faces, objects)
    weights = rng.dirichlet((1, 1, 1), 60)
    points = np.einsum("pk,fkc->fpc", weights, positions[faces])
    for _ in range(10):
        camera = Camera(
            name="c", position=tuple(rng.normal(0, 1.5, 3)), target=tuple(rng.normal(0, 1.5, 3)), fov_y_deg=40
        )
        matrix = clip_from_world(camera, 160, 120, 0.05)
        x, y, z, w = np.moveaxis(np.concatenate([points, np.ones((*points.shape[:2], 1))], -1) @ matrix.T, -1, 0)
        inside = (np.abs(x) <= w) & (np.abs(y) <= w) & (z >= 0) & (z <= w)
        seen, drawn = clusters.seen(matrix), np.zeros(len(faces), bool)
        for record in objects:
            for first, count in seen.of(record.first_face, record.face_count):
                assert record.first_face <= first and first + count <= record.first_face + record.face_count
                assert not drawn[first : first + count].any(), "a face is drawn twice"
                drawn[first : first + count] = True
        owned = np.isin(
            np.arange(len(faces)),
            np.concatenate([np.arange(r.first_face, r.first_face + r.face_count) for r in objects]),
        )
        assert drawn[inside.any(axis=1) & owned].all() and not drawn[~owned].any()


def test_what_is_behind_is_left_out() -> None:
    mesh = sphere(1.0, 64, 32)
    record = ObjectRecord(
        name="ball", material="m", first_face=0, face_count=len(mesh.faces), bounds=((-1, -1, -1), (1, 1, 1))
    )
    clusters = Clusters(mesh.positions, mesh.faces, (record,))
    camera = Camera(name="c", position=(0, 0, 5), target=(0, 0, 0), fov_y_deg=40)
    away = replace(camera, target=(0, 0, 9))
    whole = clusters.seen(clip_from_world(camera, 64, 64, 0.01)).of(0, len(mesh.faces))
    assert whole == [(0, len(mesh.faces))]
    assert clusters.seen(clip_from_world(away, 64, 64, 0.01)).of(0, len(mesh.faces)) == []
    part = clusters.seen(clip_from_world(replace(camera, target=(0, 2.5, 0)), 64, 64, 0.01)).of(0, len(mesh.faces))
    assert CLUSTER_FACES <= sum(count for _, count in part) < 0.6 * len(mesh.faces)
