"""States of the room: stored, taken, exchanged, with the undo of materials and light; the panel that does it."""

import pytest

from lambent.core.errors import UserError
from lambent.core.light.light_mix import GroupMix, LightMix
from lambent.scenes.scene import Look, Variant
from lambent.store.kept.session import RoomState
from lambent.store.light_groups import LightGroupRecord
from lambent.viewer.modes.walk.input import WalkInput
from lambent.viewer.modes.walk.session.states import AS_BAKED
from lambent.viewer.modes.walk.state import WalkState
from tests.viewer.panel_driver import PanelDriver, walk_mode

OFF = LightMix({"lamp": GroupMix(on=False)})


def painted(state, kd=0.2):
    return state.scene.materials["plaster"].model_copy(update={"kd": (kd, kd, kd)})


def paint(state, kd=0.2):
    state.materials.edits.change("plaster", painted(state, kd))
    state.materials.edits.end_stroke()


def dim(state, mix=OFF):
    state.lights.mix = mix
    state.materials.edits.end_stroke()


def test_a_stored_state_comes_back_and_can_be_undone(state):
    states, edits = state.states, state.materials.edits
    paint(state)
    dim(state)
    states.typed_name = " evening "
    assert states.store() == "evening"
    assert states.store() == "state 1", "the next free name"
    edits.take(AS_BAKED)
    assert edits.room == AS_BAKED
    edits.take(states.all["evening"])
    assert (edits.light, edits.current("plaster")) == (OFF, painted(state))
    edits.forget("evening")
    assert "evening" not in states.all
    edits.undo()
    assert states.all["evening"].light == OFF
    states.typed_name = "as baked"
    with pytest.raises(UserError, match="already used"):
        states.store()


def test_exchange_goes_to_and_fro(state):
    states, edits = state.states, state.materials.edits
    paint(state)
    states.exchange()
    assert edits.room == AS_BAKED and edits.other.materials == {"plaster": painted(state)}
    dim(state)
    states.exchange()
    assert edits.current("plaster") == painted(state) and edits.other == RoomState(light=OFF), "both can be edited"
    for _ in range(3):
        edits.undo()
    assert edits.current("plaster") == painted(state) and edits.light == LightMix()


def test_undo_of_what_is_beside_ends_the_split(state):
    paint(state)
    state.states.split = True
    assert state.states.split and state.divider is state.states.divider
    state.states.label()
    assert (state.states.divider.a_label, state.states.divider.b_label) == ("the room now", "as baked")
    state.materials.edits.undo()
    assert not state.states.split and state.divider is None


@pytest.fixture
def panels(unfolded, state):
    state.lights.groups = (LightGroupRecord(name="lamp", members=("bulb",), share=1.0),)
    return unfolded("States", "Light")


def test_the_panel_stores_takes_and_compares(panels, state):
    edits = state.materials.edits
    panels.drag("##times lamp", 0.25, 0.1)
    panels.frame()
    dimmed = edits.light
    assert dimmed.of("lamp").intensity < 0.8
    panels.click("undo")
    assert edits.light == LightMix()
    panels.click("redo")
    assert edits.light == dimmed
    panels.click("##state name", 0.5)
    panels.type("evening")
    panels.click("store##state name")
    panels.frame(2)
    assert edits.stored == {"evening": RoomState(light=dimmed)}
    panels.click("apply##as baked")
    assert edits.room == AS_BAKED
    panels.click("split##evening")
    assert state.states.split and edits.other.light == dimmed
    panels.click("swap")
    assert edits.light == dimmed and edits.other == AS_BAKED
    panels.click("split view", 0.05)
    assert not state.states.split
    panels.click("x##evening")
    assert edits.stored == {}


def with_variants(scene):
    """Two variants: one paints, one paints otherwise, takes textures away and dims; brass is never named."""
    plaster = scene.materials["plaster"]
    red, blue = (plaster.model_copy(update={"kd": kd}) for kd in ((0.6, 0.1, 0.1), (0.1, 0.1, 0.6)))
    day = Variant("day", {"plaster": Look(red, "brass")})
    return scene.model_copy(update={"variants": (day, Variant("night", {"plaster": Look(blue)}, OFF))})


def test_a_variant_takes_its_materials_textures_and_light_and_leaves_the_rest(scene, screen):
    state = WalkState.of(with_variants(scene), "walk", screen)
    edits, states = state.materials.edits, state.states
    brass = scene.materials["brass"].model_copy(update={"kd": (0.3, 0.3, 0.3)})
    edits.change("brass", brass)
    edits.end_stroke()
    edits.take(states.variants["day"])
    assert edits.current("plaster").kd == (0.6, 0.1, 0.1) and edits.room.textures == {"plaster": "brass"}
    assert edits.current("brass") == brass and states.name_of(edits.room, "?") == "day"
    edits.take(states.variants["night"])
    assert edits.current("plaster").kd == (0.1, 0.1, 0.6) and edits.room.textures == {} and edits.light == OFF
    edits.take(states.variants["day"])
    assert edits.light == LightMix(), "the lamp is named by a variant, and as baked in this one"
    edits.undo()
    edits.undo()
    assert edits.current("plaster").kd == (0.6, 0.1, 0.1)
    edits.reset("plaster")
    assert edits.room == RoomState(materials={"brass": brass}), "its own textures, too"


def test_variants_are_offered(monkeypatch, scene, screen, geometry):
    state = WalkState.of(with_variants(scene), "walk", screen)
    driver = PanelDriver(monkeypatch, walk_mode(state, geometry))
    driver.click("States", 0.3)
    driver.frame(2)
    driver.click("apply##variant night")
    assert state.lights.mix == OFF
    driver.click("split##variant day")
    assert state.states.split and state.materials.edits.other.textures == {"plaster": "brass"}
    driver.close()


def test_x_exchanges(state, geometry):
    paint(state)
    walk = WalkInput(state, geometry)
    press = {"event_type": "key_down", "key": "x", "modifiers": ()}
    walk.handle(press, ui_has_mouse=False, ui_has_keys=False)
    assert state.materials.edits.room == AS_BAKED
    walk.handle(press, ui_has_mouse=False, ui_has_keys=False)
    assert state.materials.edits.current("plaster") == painted(state)
