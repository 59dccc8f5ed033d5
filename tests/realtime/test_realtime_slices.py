"""A frame in slices is the frame, and what is left out of it cannot be seen."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.core.camera import Camera, clip_from_world
from lambent.realtime.clusters import CLUSTER_FACES, Clusters
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.realtime.slices import SLICE_S, STEP_ROWS, Cut
from lambent.realtime.targets import pixels
from lambent.scenes.geometry import sphere
from lambent.store.contract import ObjectRecord
from tests.realtime.test_realtime_planar import mirror, scene_of, state

SIZE = (96, 8 * STEP_ROWS + 5)


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


@pytest.mark.parametrize("seed", range(4))
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
        rows = tuple(sorted(rng.random(2))) if rng.random() < 0.5 else (0.0, 1.0)
        x, y, z, w = np.moveaxis(np.concatenate([points, np.ones((*points.shape[:2], 1))], -1) @ matrix.T, -1, 0)
        inside = (np.abs(x) <= w) & (y <= (1 - 2 * rows[0]) * w) & (y >= (1 - 2 * rows[1]) * w) & (z >= 0) & (z <= w)
        seen, drawn = clusters.seen(matrix, rows), np.zeros(len(faces), bool)
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
    top = clusters.seen(clip_from_world(camera, 64, 64, 0.01), (0.0, 0.3)).of(0, len(mesh.faces))
    assert CLUSTER_FACES <= sum(count for _, count in top) < 0.6 * len(mesh.faces)


@pytest.fixture(scope="module")
def renderer(device: Any) -> Renderer:
    return Renderer(device, scene_of(mirror(0.15)))


def in_slices(renderer: Renderer, frame: FrameState, view: Any, cut: Cut) -> tuple[Any, int]:
    steps, count = renderer.slices(frame, view, cut), 0
    while True:
        try:
            next(steps)
        except StopIteration as done:
            return done.value, count
        count += 1


@pytest.mark.parametrize(
    "more",
    [{}, {"integrator": "qmc", "n": 1, "accumulate": 0, "prior": 0.7}, {"view_transform": "false-colour"}],
    ids=["rings", "qmc", "false-colour"],
)
def test_a_frame_in_slices_is_the_frame_to_the_bit(renderer: Renderer, more: dict[str, Any]) -> None:
    frame = replace(state(), width=SIZE[0], height=SIZE[1], antialias=True, **more)
    shown = renderer._targets.display("display", SIZE)

    def both(radiance: Any) -> tuple[np.ndarray, np.ndarray]:
        return pixels(renderer.device, shown).copy(), pixels(renderer.device, radiance).copy()

    whole = both(renderer.draw(frame, shown.create_view()))
    assert whole[0].std() > 1, "there is something to compare"
    cut = Cut(
        dict.fromkeys(("mirror", "planar", "shade", "tonemap", "smooth"), SLICE_S)
    )  # a pixel a slice: least bands
    radiance, count = in_slices(renderer, frame, shown.create_view(), cut)
    assert count > 10
    for one, other in zip(whole, both(radiance), strict=True):
        np.testing.assert_array_equal(one, other)
    statistics = renderer.statistics
    assert statistics["mirrors"] == 1 and statistics["draw_calls"] > 10


def test_a_renderer_beside_may_draw_between_two_slices(renderer: Renderer) -> None:
    """It shares the materials' buffers, and writes other samples into them."""
    frame = replace(state(), width=SIZE[0], height=SIZE[1])
    view = renderer._targets.display("display", SIZE).create_view()
    expected = pixels(renderer.device, renderer.draw(frame, view)).copy()
    beside = Renderer(renderer.device, renderer.scene, beside=renderer)
    steps = renderer.slices(frame, view, Cut())
    while True:
        try:
            next(steps)
        except StopIteration as done:
            radiance = done.value
            break
        beside.image(replace(state(), integrator="qmc", n=5))
    np.testing.assert_array_equal(pixels(renderer.device, radiance), expected)


def test_a_frame_that_is_overtaken_ends(renderer: Renderer) -> None:
    frame = state()
    steps = renderer.slices(frame, renderer._targets.display("display", frame.size).create_view(), Cut())
    next(steps)
    renderer.image(frame)
    with pytest.raises(RuntimeError, match="another frame"):
        next(steps)


def test_bands_follow_what_they_took() -> None:
    cut = Cut()
    bands = cut.bands("shade", (100, 10 * STEP_ROWS + 3))
    assert next(bands).end == STEP_ROWS, "nothing is known yet"
    cut.took(SLICE_S / 8)
    assert (band := next(bands)).end - band.begin == 2 * STEP_ROWS and band.load_op == "load", "grown by and by"
    cut.took(SLICE_S / 4)
    assert (band := next(bands)).end - band.begin == 4 * STEP_ROWS
    cut.took(100 * SLICE_S)
    rest = list(bands)
    assert [b.end - b.begin for b in rest] == [STEP_ROWS] * 3 + [3] and rest[-1].shares[1] == 1
