"""Indirect light of moved lamps: the change of direct light on texels, and light answered from what it lights."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baked.answering.stored import read_answer
from lambent.baking.bake import bake
from lambent.core.arrays import Floats
from lambent.materials.document import Material
from lambent.realtime.answering.answering import AnsweredLight
from lambent.realtime.light.baked import read_baked
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import box, merge, patch, placed
from lambent.scenes.lamp_edits import LampEdit, with_lamp_edits
from lambent.scenes.scene import PointLight, Scene, SceneObject
from lambent.store.lamps import LAMPS
from lambent.store.store import Store
from tests.baking.small_scenes import TINY

EDITS = {0: LampEdit((1.2, 2.2, -0.8), (-0.4, -1.0, 0.2)), 1: LampEdit((-1.4, 0.6, 1.2))}


def scene() -> Scene:
    """A grey room of 4 x 3 x 4 m with a block in its middle, a spot and a bulb."""
    walls = [
        patch((-2, 0, 2), (4, 0, 0), (0, 0, -4)), patch((-2, 3, -2), (4, 0, 0), (0, 0, 4)),
        patch((-2, 0, -2), (4, 0, 0), (0, 3, 0)), patch((2, 0, 2), (-4, 0, 0), (0, 3, 0)),
        patch((-2, 0, 2), (0, 0, -4), (0, 3, 0)), patch((2, 0, -2), (0, 0, 4), (0, 3, 0)),
    ]  # fmt: skip
    objects = (
        SceneObject("room", merge(walls), "grey"),
        SceneObject("block", placed(box((0.4, 0.8, 0.4)), (0, 0.4, 0)), "grey"),
    )
    spot = PointLight((-0.8, 2.4, 0.2), (3.0, 2.0, 1.0), (0.3, -0.95, 0.0), 15.0, 40.0, name="spot")
    bulb = PointLight((0.9, 1.8, -0.5), (0.5, 0.5, 1.0), name="bulb")
    return Scene("room", objects, {"grey": Material(kd=0.6)}, lights=(spot, bulb))


@pytest.fixture(scope="module", params=["none", "scene"])
def stores(request: Any, mi: Any, tmp_path_factory: pytest.TempPathFactory) -> tuple[Store, Store]:
    """The bake of the room, and that of the room with edited lamps."""
    folder: Path = tmp_path_factory.mktemp("lamps")
    both = {"before": scene(), "after": with_lamp_edits(scene(), EDITS)}
    before, after = (bake(one, folder / name, quality=TINY, light_groups=request.param) for name, one in both.items())
    return before, after


def at_texels(store: Store, answer: AnsweredLight) -> tuple[Floats, Floats]:
    """Light (T, 3) of a store on answering texels of the front: indirect, and direct of lamps."""
    texels = answer._stored.texels
    front = texels[texels % 2 == 0] // 2
    whole = store.read("light_map/irradiance").astype(float).reshape(-1, 3)[front]
    direct = store.read(LAMPS[0]).astype(float).sum(axis=0).reshape(-1, 3)[front]
    return whole - direct, direct


def test_light_answers_moved_lamps_as_a_bake_does(device: Any, stores: tuple[Store, Store]) -> None:
    before = stores[0]
    renderer = Renderer(device, read_baked(before))
    renderer.resources.changed_lamps.show(EDITS)
    answer = AnsweredLight(renderer.scene, read_answer(before))
    change = answer.lamp_changes.of(renderer.resources.changed_lamps.pairs())
    front = answer._stored.texels % 2 == 0
    (old, old_direct), (new, new_direct) = (at_texels(one, answer) for one in stores)
    moved = new_direct - old_direct
    assert np.abs(change.sum(axis=0)[front] - moved).mean() < 0.05 * np.abs(moved).mean()
    lit = answer.lit({}, change=change)
    found = lit.irradiance.sum(axis=0)[front] - old_direct
    assert np.abs(new - old).mean() > 0.15 * new.mean()
    assert np.abs(found - new).mean() < 0.4 * np.abs(new - old).mean()
    assert found.mean() == pytest.approx(new.mean(), rel=0.12)
    np.testing.assert_allclose(lit.whole, np.maximum(lit.irradiance + change, 0))
    assert answer.lit({}).is_baked


@pytest.mark.long
def test_a_lamp_brings_light_into_a_dark_room(device: Any, mi: Any, tmp_path: Path) -> None:
    """A ratio to the light as baked would leave it dark."""
    closed = scene()
    wall = SceneObject("wall", placed(box((0.2, 3.2, 4.2)), (0, 1.5, 0)), "grey")
    bulb = replace(closed.lights[1], position=(-1.0, 1.5, 0.0))
    closed = replace(closed, objects=(closed.objects[0], wall), lights=(bulb,))
    edits = {0: LampEdit((1.1, 1.5, 0.3))}
    store = bake(closed, tmp_path / "before", quality=TINY)
    after = bake(with_lamp_edits(closed, edits), tmp_path / "after", quality=TINY)
    renderer = Renderer(device, read_baked(store))
    renderer.resources.changed_lamps.show(edits)
    answer = AnsweredLight(renderer.scene, read_answer(store))
    lit = answer.lit({}, change=answer.lamp_changes.of(renderer.resources.changed_lamps.pairs()))
    front = answer._stored.texels % 2 == 0
    (old, old_direct), (new, _) = (at_texels(one, answer) for one in (store, after))
    found = lit.irradiance.sum(axis=0)[front] - old_direct
    dark = old.mean(axis=1) < 0.01 * old.mean()
    assert dark.mean() > 0.1 and new[dark].mean() > 10 * old[dark].mean()
    assert found[dark].mean() == pytest.approx(new[dark].mean(), rel=0.35), "though no ray was kept for its light"
    assert found[~dark].mean() < 0.2 * old[~dark].mean(), "and takes it from where it was"
