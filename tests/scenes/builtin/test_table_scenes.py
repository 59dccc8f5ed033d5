"""The scenes to edit materials in: sound shapes that rest on each other, and pictures like the published ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from lambent.scenes import load_scene
from lambent.scenes.builtin import earrings
from lambent.scenes.geometry.drape import Drape
from lambent.scenes.scene import Mesh, Scene, SceneObject

# Pixels at 512x512 of Ben-Artzi 2007, table 4.2, and which of our objects they are.
PUBLISHED: Mapping[str, Mapping[str, tuple[int, tuple[str, ...]]]] = {
    "teatray": {
        "tray": (40_529, ("tray",)),
        "teapot": (17_709, ("teapot", "teapot_spout")),
        "handles": (8_629, ("tray_handle_left", "tray_handle_right", "teapot_handle", "teapot_knob")),
    },
    "earrings": {
        "pearls": (22_505, ("pearl_left", "pearl_right")),
        "posts": (7_626, ("post_left", "post_right")),
        "cloth": (98_890, ("cloth",)),
    },
}


@pytest.fixture(scope="module", params=list(PUBLISHED))
def scene(request: pytest.FixtureRequest) -> Scene:
    return load_scene(f"builtin:{request.param}")


def positions(objects: tuple[SceneObject, ...], *names: str) -> np.ndarray:
    return np.concatenate([o.mesh.positions.astype(float) for o in objects if o.name in names])


def samples(mesh: Mesh) -> np.ndarray:
    """Corners, middles of the edges and centres of all triangles."""
    c = mesh.corners
    return np.concatenate([c.reshape(-1, 3), ((c + np.roll(c, 1, axis=1)) / 2).reshape(-1, 3), c.mean(axis=1)])


def test_pixels_are_near_the_published_ones(scene: Scene, mi: Any) -> None:
    from lambent.bake.tracing.scene_builder import SceneBuilder
    from lambent.bake.transport.view_points import view_points

    builder, size = SceneBuilder(scene), 128
    seen = view_points(builder, builder.build(), scene.cameras[0], size, size)
    names = np.array([o.name for o in scene.objects])[seen.object]
    counted = 0
    for what, (pixels, objects) in PUBLISHED[scene.name].items():
        count = int(np.isin(names, objects).sum())
        assert count * (512 / size) ** 2 == pytest.approx(pixels, rel=0.05), what
        counted += count
    assert len(names) - counted <= 2  # the pedestal is hidden
    column, row = seen.pixel % size, seen.pixel // size
    assert column.min() > 0 or scene.name == "earrings"  # the cloth runs out of the picture, the tray does not
    assert row.min() > 0


def pedestal_distance(points: np.ndarray, radius: float, edge: float) -> np.ndarray:
    """Signed distance from a tall upright cylinder with rounded rim, its top at y = 0."""
    q = np.stack([np.hypot(points[:, 0], points[:, 2]) - (radius - edge), points[:, 1] + edge], axis=-1)
    outside = np.linalg.norm(np.maximum(q, 0), axis=-1)
    return np.asarray(outside + np.minimum(q.max(axis=-1), 0) - edge)


def test_cloth_covers_the_pedestal_without_touching_it() -> None:
    objects = {o.name: o.mesh for o in earrings.objects()}
    edge = earrings.CLOTH.bend - earrings.GAP
    points = samples(objects["cloth"]) - (0, earrings.TOP - earrings.GAP, 0)
    gap = pedestal_distance(points, earrings.CLOTH.flat_radius + edge, edge)
    assert 0.8 * earrings.GAP < gap.min() <= 1.01 * earrings.GAP
    assert objects["pedestal"].bounds[1][1] == pytest.approx(earrings.TOP - earrings.GAP, abs=1e-6)
    assert objects["cloth"].bounds[0][1] > objects["pedestal"].bounds[0][1]


@pytest.mark.parametrize(("folds", "crest_bend", "flare_deg"), [(5, 0.0, 0.0), (16, 0.5, 30.0)])
def test_a_drape_stays_off_what_it_covers(folds: int, crest_bend: float, flare_deg: float) -> None:
    drape = Drape(1.0, 0.2, crest_bend, flare_deg, folds)
    phi, s = np.meshgrid(np.linspace(0, 2 * np.pi, 721), np.linspace(0, 3, 301))
    points = drape.points(phi, s).reshape(-1, 3)
    assert pedestal_distance(points, 1.2, 0.2).min() > -1e-9
    step = np.linalg.norm(drape.points(phi, s + 1e-6) - drape.points(phi, s - 1e-6), axis=-1) / 2e-6
    assert step == pytest.approx(1, abs=1e-3)  # s is a length on the cloth
