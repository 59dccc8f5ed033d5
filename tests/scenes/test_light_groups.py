"""Which emitters of a scene are dimmed together."""

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.materials.document import Material
from lambent.scenes.geometry import patch
from lambent.scenes.light_groups import MOST_GROUPS, OTHERS, groups_before_bake, names_of_lights, sorted_lights
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import (
    ConstantEnvironment,
    DirectionalLight,
    LightGroup,
    PointLight,
    Scene,
    SceneObject,
    SunSky,
)  # fmt: skip
from tests.scenes.loaders.test_toml import MATERIALS, written

UP = (0.0, 1.0, 0.0)
DOWN = (0.0, -1.0, 0.0)


def point(name: str, power: float = 1.0) -> PointLight:
    return PointLight((0, 1, 0), (power, power, power), name=name)


def scene_of(*lights, environment=None, shining=(), **more) -> Scene:
    objects = [SceneObject(n, patch((0, 0, 0), (1, 0, 0), (0, 0, 1)), "m", emission=(1, 1, 1)) for n in shining]
    objects.append(SceneObject("floor", patch((0, 0, 0), (1, 0, 0), (0, 0, 1)), "m"))
    return Scene("s", tuple(objects), {"m": Material()}, environment=environment, lights=lights, **more)


def members(scene: Scene, *args, **kwargs) -> dict[str, tuple[str, ...]]:
    return {group.name: group.members for group in sorted_lights(scene, *args, **kwargs).groups}


def test_by_default_sun_sky_and_lamps_by_stem_are_groups():
    scene = scene_of(
        point("bulb_1"), point("bulb_2"), point(""), point(""), environment=SunSky(UP), shining=("tube.001", "tube.002")
    )
    found = sorted_lights(scene, sun_in_sky=True)
    assert [g.name for g in found.groups] == ["sun", "sky", "bulb", "point", "tube"]
    assert {g.name: g.members for g in found.groups}["tube"] == ("tube.001", "tube.002")
    assert (found.sun, found.sky) == (0, 1)
    assert found.of_lights == (2, 2, 3, 3) and found.of_objects == {"tube.001": 4, "tube.002": 4}
    assert names_of_lights(scene.lights) == ["bulb_1", "bulb_2", "point 1", "point 2"]


def test_a_directional_light_can_be_the_sun_under_either_name():
    evening = DirectionalLight(DOWN, (1, 1, 1), "evening")
    scene = scene_of(
        evening, DirectionalLight(DOWN, (0.1, 0.1, 0.1), "fill"), environment=ConstantEnvironment((1, 1, 1))
    )
    found = sorted_lights(scene, [0])
    assert [g.name for g in found.groups] == ["sky", "sun", "fill"] and found.sun == found.of_lights[0] == 1
    named = replace(scene, light_groups=(LightGroup("outside", ("evening", "sky")),))
    found = sorted_lights(named, [0])
    assert [g.name for g in found.groups] == ["outside", "fill"] and found.sun == found.sky == 0


def test_named_groups_come_first_and_the_first_that_lists_an_emitter_has_it():
    groups = (LightGroup("desk", ("bulb_2", "tube*")), LightGroup("rest", ("bulb*",)), LightGroup("none", ("x",)))
    scene = scene_of(point("bulb_1"), point("bulb_2"), point("spare"), shining=("tube",), light_groups=groups)
    assert members(scene) == {"desk": ("bulb_2", "tube"), "rest": ("bulb_1",), "spare": ("spare",)}


def test_the_weakest_lamps_are_merged_where_there_are_too_many():
    lamps = [point(f"lamp {chr(97 + i)}", power=1 + i) for i in range(12)]
    found = sorted_lights(scene_of(*lamps, environment=ConstantEnvironment((1, 1, 1))))
    names = [group.name for group in found.groups]
    assert len(names) == MOST_GROUPS and {"sky", OTHERS, "lamp l", "lamp g"} <= set(names) and "lamp f" not in names
    assert set(found.groups[names.index(OTHERS)].members) == {f"lamp {c}" for c in "abcdef"}


def test_before_a_bake_the_sun_of_daylight_is_known():
    assert [g.name for g in groups_before_bake(scene_of(environment=SunSky(UP)))] == ["sun", "sky"]
    assert [g.name for g in groups_before_bake(scene_of(environment=SunSky(UP, sun_scale=0.0)))] == ["sky"]
    assert [g.name for g in groups_before_bake(scene_of(DirectionalLight(DOWN, (1, 1, 1))))] == ["sun"]


def test_a_member_that_fits_nothing_is_an_error(tmp_path):
    lamp = '[[lights]]\nkind = "point"\nname = "bulb_1"\nposition = [0, 1, 0]\nlumens = 800\n'
    groups = '[[light_groups]]\nname = "reading"\nmembers = ["blub"]\n'
    with pytest.raises(UserError, match=r"light_groups\.members.*blub"):
        load_scene(written(tmp_path, MATERIALS + lamp + groups))


def test_names_do_not_change_the_light():
    from lambent.baking.running.keys import group_inputs, light_inputs

    plain, named = scene_of(point("")), scene_of(point("bulb"))
    assert light_inputs(plain) == light_inputs(named) and group_inputs(plain) != group_inputs(named)
    assert np.array_equal(plain.lights[0].intensity, named.lights[0].intensity)
