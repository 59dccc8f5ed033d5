"""The light that falls on an object: known illuminance of a square, by side, group and mix."""

import numpy as np
import pytest

from lambent.baked.answering.delta_bytes import delta_bytes
from lambent.core.light.light_mix import GroupMix, LightMix
from lambent.core.light.photometry import LM_PER_W
from lambent.materials.document import Material
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.light.group_arrays import GroupArrays
from lambent.scenes.geometry import merge, patch
from lambent.store.contract import ObjectRecord, SceneRecord, SunRecord
from lambent.store.light_groups import LightGroupRecord
from lambent.store.store import Store
from lambent.viewer.modes.walk.light import falling as falling_module
from lambent.viewer.modes.walk.light.falling import WITHOUT_SUN, FallingLight
from lambent.viewer.modes.walk.panels import metering

NAMES = ("lamp", "sun")
SIDE = 8  # texels


class Groups(GroupArrays):
    """Light by group of a test."""

    sides = None


def groups_of(front, back=None):
    records = tuple(LightGroupRecord(name=name, members=(name,), share=0.5) for name in NAMES)
    found = Groups(records, None)
    object.__setattr__(found, "sides", (front, back))
    return found


@pytest.fixture
def room(tmp_path):
    """A floor of 2 m x 2 m on the left half of the map, a wall on the right half."""
    parts = [patch((0, 0, 2), (2, 0, 0), (0, 0, -2)), patch((0, 0, 0), (2, 0, 0), (0, 2, 0))]
    whole, objects, first = merge(parts), [], 0
    for name, mesh in zip(("floor", "wall"), parts, strict=True):
        bounds = tuple(tuple(map(float, corner)) for corner in mesh.bounds)
        count = len(mesh.faces)
        objects.append(ObjectRecord(name=name, material="paint", first_face=first, face_count=count, bounds=bounds))
        first += count
    uv2 = np.concatenate([part.uv / part.uv.max(0) * (0.5, 1) + (0.5 * k, 0) for k, part in enumerate(parts)]).astype(
        np.float32
    )
    record = SceneRecord(
        name="room", objects=tuple(objects), materials={"paint": Material(name="paint", kd=0.5)},
        cameras=(), paths=(), bounds=((0, 0, 0), (2, 2, 2)),
    )  # fmt: skip
    light = np.zeros((SIDE, SIDE, 3), np.float32)
    light[:, : SIDE // 2] = np.linspace(1, 3, SIDE)[:, None, None]
    scene = BakedScene(record, whole.positions, whole.normals, whole.tangents, uv2, whole.faces, light, unit=2.0)
    return scene, Store.create(tmp_path / "room", {})


def found_on(scene, store, name, groups=None):
    falling = FallingLight(scene, store, lambda: groups)
    falling.follow(frozenset([name]), waits=False)
    falling._work.wait()
    return falling.follow(frozenset([name]), waits=False)


def test_the_mean_and_range_are_those_of_the_light_map(room):
    found = found_on(*room, "floor")
    (mean,) = found.illuminance_lx(LightMix()).values()
    assert mean == pytest.approx(2.0 * 2 * LM_PER_W, rel=1e-3), "2 W/m^2 on average, in units of 2"
    low, high = found.range_lx(LightMix())
    assert low == pytest.approx(1.1 * 2 * LM_PER_W, rel=0.15) and high == pytest.approx(2.9 * 2 * LM_PER_W, rel=0.06)
    assert found.area_m2.sum() == pytest.approx(4.0, rel=1e-4)
    assert found_on(*room, "wall").illuminance_lx(LightMix()) == {"all light": 0.0}


def test_groups_follow_the_mix(room):
    scene, store = room
    found = found_on(scene, store, "floor", groups_of(np.stack([scene.irradiance, 3 * scene.irradiance])))
    lamp, sun = found.illuminance_lx(LightMix()).values()
    assert sun == pytest.approx(3 * lamp)
    mix = LightMix({"lamp": GroupMix(intensity=0.5), "sun": GroupMix(on=False)})
    assert found.illuminance_lx(mix) == pytest.approx({"lamp": lamp / 2, "sun": 0.0})
    assert found.range_lx(mix)[1] < lamp


def test_the_side_that_somebody_sees_counts(room):
    """The far side of a sheet is dark; that of a wall is filled evenly."""
    scene, store = room
    seen, dark, even = scene.irradiance, np.zeros_like(scene.irradiance), np.full_like(scene.irradiance, 9.0)
    for front, back in ((seen, even), (seen, dark), (dark, seen), (even, seen), (seen, None)):
        sides = [None if one is None else np.stack([one, 0 * one]) for one in (front, back)]
        found = found_on(scene, store, "floor", groups_of(*sides))
        assert found.illuminance_lx(LightMix())["lamp"] == pytest.approx(2.0 * 2 * LM_PER_W, rel=1e-3)


def test_the_direct_sun_is_added_to_its_group_or_said_to_be_missing(room):
    scene, store = room
    sun = SunRecord(direction=(0, 1, 0), irradiance=(1, 1, 1), radius_rad=0.01)
    object.__setattr__(scene, "sun", sun)
    by_group = groups_of(np.stack([scene.irradiance, 0 * scene.irradiance]))
    assert found_on(scene, store, "floor", by_group).note == WITHOUT_SUN
    falling = FallingLight(scene, store, lambda: by_group)
    falling.__dict__["_sun"] = np.repeat([[5.0], [0.0]], SIDE * SIDE, axis=1).T.reshape(-1, 1) * np.ones(3)
    found = falling._light_on(frozenset(["floor"]), by_group)
    assert found.illuminance_lx(LightMix())["sun"] == pytest.approx(5 * LM_PER_W) and found.note == ""


def test_the_direct_sun_is_that_of_the_answer_of_the_same_sky(room, monkeypatch):
    scene, store = room
    sun = SunRecord(direction=(0, 1, 0), irradiance=(1, 1, 1), radius_rad=0.01)
    store.put("light_map/irradiance", "light_map", scene.irradiance, key="k", meta={"sun": sun.model_dump(mode="json")})
    texels, shares = np.arange(0, 2 * SIDE * SIDE, 2), np.tile(np.uint8([3, 1, 0, 0, 0, 0, 0, 0]), (SIDE * SIDE, 1))
    arrays = {
        "point_sun": np.float32([[4, 4, 4], [8, 8, 8]]), "texels": delta_bytes(texels), "shares": shares,
        "near": delta_bytes(np.tile([0, 1, 0, 0, 0, 0, 0, 0], (SIDE * SIDE, 1))),
    }  # fmt: skip
    for name, array in arrays.items():
        store.put(f"answer/{name}", "answer", array, key="k")
    monkeypatch.setattr(falling_module, "has_answer", lambda store: True)
    object.__setattr__(scene, "sun", sun)
    by_group = groups_of(np.stack([scene.irradiance, 0 * scene.irradiance]))
    found = found_on(scene, store, "floor", by_group)
    assert found.illuminance_lx(LightMix())["sun"] == pytest.approx(5 * LM_PER_W), "the weighted mean of two points"
    object.__setattr__(scene, "sun", sun.model_copy(update={"direction": (0, 0.6, 0.8)}))
    turned = found_on(scene, store, "floor", by_group)
    assert turned.note == WITHOUT_SUN and turned.illuminance_lx(LightMix())["sun"] == 0


def test_it_is_looked_up_again_for_other_light_and_not_during_a_drag(room):
    scene, store = room
    shown = [groups_of(np.stack([scene.irradiance, 0 * scene.irradiance]))]
    falling = FallingLight(scene, store, lambda: shown[0])
    assert falling.follow(frozenset(["floor"]), waits=True) is None and not falling.busy
    falling.follow(frozenset(["floor"]), waits=False)
    falling._work.wait()
    first = falling.follow(frozenset(["floor"]), waits=False)
    shown[0] = groups_of(np.stack([2 * scene.irradiance, 0 * scene.irradiance]))
    assert falling.follow(frozenset(["floor"]), waits=True) is first and not falling.busy
    assert falling.follow(frozenset(["floor"]), waits=False) is first, "until the new one is there"
    falling._work.wait()
    twice = falling.follow(frozenset(["floor"]), waits=False)
    lamp = [one.illuminance_lx(LightMix())["lamp"] for one in (first, twice)]
    assert lamp[1] == pytest.approx(2 * lamp[0])


def test_the_panel_says_it(monkeypatch, state, room):
    scene, store = room
    state.scene = scene.record
    state.selection.choose("floor")
    falling, drawn = FallingLight(scene, store, lambda: None), []
    monkeypatch.setattr(metering, "rows", lambda table, name: drawn.extend(table))
    monkeypatch.setattr(metering, "explain", lambda text: None)
    monkeypatch.setattr(metering.imgui, "text_disabled", drawn.append)
    metering.draw_falling(falling, state)
    assert drawn == ["..."]
    falling._work.wait()
    metering.draw_falling(falling, state)
    assert ("on average", "716 lx") in drawn
    monkeypatch.setattr(metering.imgui, "text_wrapped", drawn.append)
    metering.draw_falling(falling, state)
    assert metering.AS_BAKED not in drawn
    state.materials.edits.change("brass", state.materials.edits.scene["plaster"])
    metering.draw_falling(falling, state)
    assert metering.AS_BAKED in drawn
