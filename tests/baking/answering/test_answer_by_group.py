"""Light that answers edited materials group by group: each lamp's own light, and every mix of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baked.answering.stored import has_answer, read_answer
from lambent.baking.bake import bake
from lambent.core.views.camera import Camera
from lambent.materials.recolour import recoloured
from lambent.realtime.answering.answering import AnsweredLight
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import open_device
from lambent.realtime.light.baked import BakedScene, read_baked
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import patch
from lambent.scenes.scene import DirectionalLight, Scene, SceneObject
from lambent.store.contract import SIDES
from lambent.store.light_groups import group_name, light_groups
from lambent.store.store import Store
from tests.baking.small_scenes import TINY, room_with_step
from tests.realtime.answering.answered_scene import answered_scene

VIEW = FrameState(Camera("in", (1.4, 1.2, -1.4), (-0.8, 0.5, 0.0), fov_y_deg=70), 96, 64, integrator="rings")
RED = (0.5, 0.05, 0.05)


def two_lamps() -> Scene:
    """The room with a second lamp, of other colour, low on a wall."""
    low = patch((-1.99, 0.2, -0.5), (0, 0.6, 0), (0, 0, 1))
    lamp = SceneObject("wall lamp", low, "black", emission=(1.0, 3.0, 4.0))
    return replace(room_with_step(), objects=(*room_with_step().objects, lamp))


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    folder = tmp_path_factory.mktemp("two") / "s"
    return bake(two_lamps(), folder, quality=TINY, light_groups="scene")


@pytest.fixture(scope="module")
def scene(store: Store) -> BakedScene:
    return read_baked(store)


def answered_red(store: Store, scene: BakedScene) -> BakedScene:
    return answered_scene(scene, read_answer(store), recoloured(scene.record.materials, {"grey": RED}))


def test_direct_light_is_by_group_and_below_all_light(store: Store) -> None:
    assert [group.name for group in light_groups(store)] == ["lamp", "wall lamp"] and has_answer(store)
    answer = read_answer(store).answer
    assert answer.direct.shape[0] == answer.baked.shape[0] == answer.patches.direct.shape[0] == 2
    assert (answer.direct <= answer.baked).all()
    ceiling, wall = answer.direct
    assert ceiling[:, 0].sum() == pytest.approx(ceiling[:, 2].sum(), rel=0.01), "the ceiling's lamp is white"
    assert wall[:, 0].sum() / wall[:, 2].sum() == pytest.approx(0.25, rel=0.01), "the wall's is of another colour"


def test_without_an_edit_the_groups_are_those_of_the_store(store: Store, scene: BakedScene) -> None:
    light = AnsweredLight(scene, read_answer(store))
    assert light.groups(light.as_baked) is scene.groups and light.groups(light.lit({})) is scene.groups


@pytest.mark.long
def test_every_group_answers_as_a_bake_of_the_other_colour(store: Store, scene: BakedScene, tmp_path: Path) -> None:
    grey = two_lamps().materials["grey"]
    other = replace(two_lamps(), materials={**two_lamps().materials, "grey": grey.model_copy(update={"kd": RED})})
    truth = bake(other, tmp_path / "s", quality=TINY, light_groups="scene", only=("light_map",))
    found = answered_red(store, scene).groups
    assert found is not None and scene.groups is not None
    expected, before, ours = truth.read(group_name(SIDES[0])).astype(float), scene.groups.sides[0], found.sides[0]
    assert before is not None and ours is not None
    for group in range(2):
        lit = expected[group].mean(axis=-1) > 0.05 * expected[group].mean()
        assert ours[group][lit].mean(axis=0) == pytest.approx(expected[group][lit].mean(axis=0), rel=0.1)
        off, stale = (np.sqrt(((one[group] - expected[group])[lit] ** 2).mean()) for one in (ours, before))
        assert off < 0.25 * stale


@pytest.mark.long
def test_light_answers_on_the_gpu_as_in_a_new_scene_and_comes_back(store: Store, scene: BakedScene) -> None:
    device = open_device()
    renderer, light = Renderer(device, scene), AnsweredLight(scene, read_answer(store))
    mix = {"lamp": (0.5, 0.5, 0.5)}
    edited = recoloured(scene.record.materials, {"grey": RED})
    before = renderer.image(replace(VIEW, light=mix))
    groups = light.groups(light.lit(edited))
    assert groups is not None and scene.groups is not None
    renderer.mixer.answer(groups)
    shown = renderer.image(replace(VIEW, light=mix, materials=edited))
    anew = Renderer(device, answered_red(store, scene)).image(replace(VIEW, light=mix))
    assert shown == pytest.approx(anew, rel=2e-3, abs=1e-4)
    renderer.mixer.answer(scene.groups)
    assert np.array_equal(renderer.image(replace(VIEW, light=mix)), before)


@pytest.mark.long
def test_the_sun_is_in_the_light_of_its_group_alone(tmp_path: Path) -> None:
    """Two plates face each other: the lower one reflects the sun onto the upper one, whose light is indirect alone."""
    plates = (
        SceneObject("floor", patch((-1, 0, 1), (2, 0, 0), (0, 0, -2)), "grey"),
        SceneObject("roof", patch((-0.4, 1.0, -0.4), (0.8, 0, 0), (0, 0, 0.8)), "grey"),
        SceneObject("glow", patch((-1, 2.0, -1), (2, 0, 0), (0, 0, 2)), "grey", emission=(0.2, 0.2, 0.2)),
    )
    sun = DirectionalLight((0.8, -0.6, 0.0), (10.0, 8.0, 6.0), "sun")
    whole = Scene("plates", plates, {"grey": room_with_step().materials["grey"]}, lights=(sun,))
    store = bake(whole, tmp_path / "s", quality=TINY, light_groups="scene", only=("answer",))
    stored = read_answer(store)
    names = [group.name for group in light_groups(store)]
    of_sun, of_lamp = names.index("sun"), names.index("glow")
    assert stored.of_sun == of_sun
    patches = stored.answer.patches.direct
    assert patches[of_sun].max() == pytest.approx(10.0 * 0.6, rel=0.05)
    assert patches[of_lamp].max() < 0.2 * np.pi * 1.05
    assert stored.answer.direct[of_sun].max() < 0.05, "the light map leaves the sun's direct light out"
