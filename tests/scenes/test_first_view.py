"""Cameras of scenes that have none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.scenes.first_view import content_bounds, first_views
from lambent.scenes.geometry.shapes import box
from lambent.scenes.scene import SceneObject


def block(name: str, size: tuple[float, float, float], at: tuple[float, float, float]) -> SceneObject:
    mesh = box(size)
    low, high = mesh.bounds
    return SceneObject(name, replace(mesh, positions=mesh.positions + (np.array(at) - (low + high) / 2)), "grey")


def room(ceiling: bool = True) -> list[SceneObject]:
    """Six by four metres, 2.8 m high, of walls a decimetre thick."""
    sides = [
        block("floor", (6, 0.1, 4), (0, -0.05, 0)), block("west", (0.1, 2.8, 4), (-3, 1.4, 0)),
        block("east", (0.1, 2.8, 4), (3, 1.4, 0)), block("north", (6, 2.8, 0.1), (0, 1.4, -2)),
        block("south", (6, 2.8, 0.1), (0, 1.4, 2)),
    ]  # fmt: skip
    return [*sides, block("ceiling", (6, 0.1, 4), (0, 2.85, 0))] if ceiling else sides


GROUND = block("ground", (50_000, 1, 50_000), (0, -0.6, 0))
TABLE = block("table", (1.2, 0.7, 0.8), (2.0, 0.35, 0.8))


def test_a_room_is_seen_from_within_and_from_outside() -> None:
    for around in ([], [GROUND]):
        within, whole = first_views([*room(), TABLE, *around])
        assert (within.name, whole.name) == ("inside", "overview")
        x, y, z = within.position
        assert abs(x) < 2.5 and abs(z) < 1.5 and y == pytest.approx(1.6, abs=1e-6), "someone stands there"
        assert np.linalg.norm(whole.position) < 15


@pytest.mark.parametrize(
    "objects",
    [
        [block("solid", (6, 3, 4), (0, 1.5, 0))],
        room(ceiling=False),
        [GROUND, TABLE],
        [replace(o, mesh=replace(o.mesh, positions=o.mesh.positions / 1000)) for o in room()],
        [block("flat", (5, 0.0, 5), (0, 0, 0))],
    ],
    ids=["solid", "no ceiling", "ground", "millimetres", "flat"],
)
def test_other_scenes_are_seen_from_outside(objects: list[SceneObject]) -> None:
    assert [camera.name for camera in first_views(objects)] == ["overview"]


def test_grounds_and_skies_do_not_push_the_camera_away() -> None:
    sky = block("sky", (900, 900, 900), (0, 100, 0))
    for around in ([GROUND], [sky], [sky, GROUND]):
        low, high = content_bounds([TABLE, *around])
        assert (low, high) == (pytest.approx(TABLE.mesh.bounds[0]), pytest.approx(TABLE.mesh.bounds[1]))
    tower = block("tower", (2, 90, 2), (0, 45, 0))
    assert content_bounds([TABLE, tower])[1][1] == 90, "something tall is no ground"
    assert content_bounds([GROUND])[1][0] == 25_000
