"""Lamps moved, aimed and exchanged in a drawn scene: shadow maps, irradiance by hand, and back to the bake."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.geometry.directions import normalize
from lambent.core.light.colour import HALF_MAX, luminance
from lambent.materials.document import Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.lamps.changed import as_baked
from lambent.realtime.light.baked import read_baked
from lambent.realtime.renderer import Renderer
from lambent.scenes.lamp_edits import LampEdit, edited_lamp
from lambent.scenes.scene import IesLight, PointLight
from lambent.store.lamp_discs import directions
from lambent.store.store import Store
from tests.baking.light.test_point_lamps import BULB, SPOT, WASHER, intensity, is_behind_plate, room
from tests.baking.small_scenes import TINY
from tests.realtime.lamps.test_drawn_lamps import CAMERA, SIZE, floor_seen

LAMPS = {0: SPOT, 1: BULB, 2: WASHER}  # by number
IES = """IESNA:LM-63-2002
TILT=NONE
1 -1 1 3 3 1 2 0 0 0 1 1 10
0 40 70
0 45 90
800 600 0
800 400 0
800 200 0
"""


@pytest.fixture(scope="module")
def store(mi: Any, tmp_path_factory: pytest.TempPathFactory) -> Store:
    folder: Path = tmp_path_factory.mktemp("changed") / "s"
    scene = room()
    plate = replace(scene.objects[1], material="dark")
    materials = {**scene.materials, "dark": Material(kd=0.0)}
    scene = replace(scene, objects=(scene.objects[0], plate), materials=materials, lights=(SPOT, BULB, WASHER))
    return bake(scene, folder, quality=TINY, only=("lamps", "probe"))


@pytest.fixture
def renderer(device: Any, store: Store) -> Renderer:
    return Renderer(device, read_baked(store))


def image(renderer: Renderer) -> Floats:
    state = FrameState(CAMERA, SIZE, SIZE, antialias=False, show="diffuse")
    return np.asarray(renderer.still_radiance(state, 1), float).reshape(-1, 3)


def expected(lamps: list[PointLight | IesLight]) -> tuple[Floats, Floats]:
    """Radiance (n, 3) of the grey floor under lamps, NaN beside edges of shadows; and where the floor is open."""
    p, _, open_floor = floor_seen()
    total = np.zeros_like(p)
    for lamp in lamps:
        away = p - np.array(lamp.position)
        distance = np.linalg.norm(away, axis=1, keepdims=True)
        hidden = np.asarray(is_behind_plate(p, np.array(lamp.position)))[:, None]
        total += intensity(lamp, away / distance) / distance**2 * (1 - hidden) * -away[:, 1:2] / distance
    return total * 0.5 / np.pi, open_floor & ~np.isnan(total).any(axis=1)


def surfaces_m(edit: LampEdit, w: Floats) -> Floats:
    """Distances (n,) from a lamp along directions (n, 3) to the plate or the floor; infinite beyond both."""
    position, found = np.array(edit.position), np.full(len(w), np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for height, half in ((0.0, 2.0), (0.5, 0.2)):
            t = (height - position[1]) / w[:, 1]
            at = position + t[:, None] * w
            hit = (t > 0) & (np.abs(at[:, [0, 2]]) < half).all(axis=1)
            found = np.where(hit, np.minimum(found, t), found)
    return found


@pytest.mark.parametrize(
    ("number", "edit"),
    [
        (0, LampEdit((0.4, 1.4, 0.3), (-0.6, -1.0, 0.1))),
        (1, LampEdit((0.1, 1.1, 0.0))),
        (2, LampEdit((-0.5, 1.6, 0.2), (1.0, -0.5, 0.3), 70.0)),
    ],
)
def test_shadow_maps_are_the_distances_of_surfaces(renderer: Renderer, number: int, edit: LampEdit) -> None:
    renderer.resources.changed_lamps.show({number: edit})
    (place,) = (k for k, one in enumerate(renderer.scene.lamps.records) if one.number == number)
    record = renderer.resources.lamps.records[place]
    local, there = directions(record.reach_deg)
    wanted = np.minimum(surfaces_m(edit, local @ np.array(record.axes)), HALF_MAX)[there]
    found = renderer.resources.lamps.distances(place).reshape(-1).astype(float)[there]
    off = np.abs(found / wanted - 1)
    assert (wanted < HALF_MAX).mean() > 0.1
    assert np.quantile(off, 0.99) < 1e-3, "but at silhouettes"


@pytest.mark.parametrize(
    ("number", "edit"),
    [
        (0, LampEdit((0.6, 1.5, 0.3), (-0.4, -1.0, 0.1))),
        (1, LampEdit((0.3, 0.9, 0.2))),
        (2, LampEdit((0.5, 1.6, -0.3), (-0.5, -1.0, 0.1), 100.0)),
    ],
)
def test_a_moved_lamp_shines_from_where_it_is(renderer: Renderer, number: int, edit: LampEdit) -> None:
    before = image(renderer)
    renderer.resources.changed_lamps.show({number: edit})
    moved = image(renderer)
    lamps = {**LAMPS, number: edited_lamp(LAMPS[number], edit)}
    wanted, known = expected(list(lamps.values()))
    assert known.mean() > 0.4
    assert np.abs(moved - before)[known].max() > 0.05
    np.testing.assert_allclose(moved[known], wanted[known], rtol=0.02, atol=0.003)
    renderer.resources.changed_lamps.show({})
    assert np.array_equal(image(renderer), before)


def test_an_exchanged_lamp_has_the_candela_of_its_file_and_its_own_colour(renderer: Renderer, tmp_path: Path) -> None:
    file = tmp_path / "wide.ies"
    file.write_text(IES)
    (record,) = (one for one in renderer.scene.lamps.records if one.number == 0)
    edit = replace(as_baked(record), file=str(file))
    luminaire = edited_lamp(SPOT, edit)
    assert isinstance(luminaire, IesLight)
    down = intensity(luminaire, normalize(np.array([edit.aim])))[0]
    assert luminance(down) * 179 == pytest.approx(800.0)
    np.testing.assert_allclose(down / down[0], np.array(SPOT.intensity) / SPOT.intensity[0])
    renderer.resources.changed_lamps.show({0: edit})
    wanted, known = expected([luminaire, BULB, WASHER])
    np.testing.assert_allclose(image(renderer)[known], wanted[known], rtol=0.02, atol=0.004)


def test_an_unreadable_file_changes_nothing(renderer: Renderer, tmp_path: Path) -> None:
    before = image(renderer)
    edit = replace(as_baked(renderer.scene.lamps.records[0]), file=str(tmp_path / "none.ies"))
    with pytest.raises(UserError, match=r"none\.ies"):
        renderer.resources.changed_lamps.show({renderer.scene.lamps.records[0].number: edit})
    assert np.array_equal(image(renderer), before)
