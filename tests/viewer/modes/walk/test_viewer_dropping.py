"""Files dropped onto the picture go to what lies under the mouse; where that is not possible, a line says why."""

import numpy as np
import pytest
from PIL import Image

from lambent.core.pictures.images import write_image
from lambent.materials.document import Lobe, Material
from lambent.scenes.scene import ImageTexture
from lambent.viewer.modes.walk import dropping
from tests.viewer.panel_driver import walk_mode

TABLE, FLOOR, SKY = (0.5, 0.5), (0.05, 0.98), (0.5, 0.02)  # shares of the picture
GOLD = Material(name="gold", kd=0, lobes=(Lobe(mx=0.2, my=0.2, r0=(1, 0.77, 0.34)),))


@pytest.fixture
def mode(state, geometry):
    return walk_mode(state, geometry)


def drop(mode, file, at):
    mode.state.meter.cursor = at
    mode.drop(str(file))
    return mode.state.screen.messages[-1].text if mode.state.screen.messages else ""


def test_the_places_of_these_tests_are_what_they_say(mode):
    seen = []
    for at in (TABLE, FLOOR):
        mode.state.meter.cursor = at
        mode.input.select_under_cursor()
        seen.append(mode.state.selection.name)
    mode.state.meter.cursor = SKY
    assert seen == ["table", "floor"] and mode.input.is_over_sky


def test_a_material_becomes_that_of_the_object(mode, state, tmp_path):
    file = tmp_path / "gold.JSON"
    GOLD.save(file)
    drop(mode, file, TABLE)
    drop(mode, file, FLOOR)
    assert state.selection.name == "floor" and state.materials.editor is None
    assert {name: one.kd for name, one in state.materials.edits.edited.items()} == dict.fromkeys(
        ("brass", "plaster"), (0, 0, 0)
    )
    state.materials.edits.undo()
    assert list(state.materials.edits.edited) == ["brass"], "one step each"


def test_beside_all_objects_the_selected_one_is_meant(mode, state, tmp_path):
    file = tmp_path / "gold.json"
    GOLD.save(file)
    assert dropping.NOTHING in drop(mode, file, SKY) and dropping.NOTHING in drop(mode, file, None)
    state.selection.choose("table")
    drop(mode, file, SKY)
    assert list(state.materials.edits.edited) == ["brass"] and state.selection.name == "table"


def test_a_measurement_opens_the_editor_in_the_size_with_plots(mode, state, measurement_file):
    state.screen.size = "design"
    drop(mode, measurement_file, TABLE)
    editor = state.materials.editor
    assert editor is not None and editor.subject.name == "brass" and state.screen.size == "measure"
    state.materials.close_editor()


@pytest.fixture
def measurement_file(tmp_path):
    file = tmp_path / "brushed.csv"
    rows = ["theta_i,phi_i,theta_o,phi_o,f_r,f_g,f_b"]
    rows += [f"{t},0,{o},{p},0.1,0.1,0.1" for t in (10, 40) for o in (5, 45) for p in (0, 90, 180)]
    file.write_text("\n".join(rows))
    return file


def test_an_image_becomes_the_texture_of_the_object(mode, state, tmp_path):
    Image.fromarray(np.full((4, 4, 3), (0, 255, 0), np.uint8)).save(tmp_path / "grass.png")
    assert "grass.png is the texture of plaster" in drop(mode, tmp_path / "grass.png", FLOOR)
    assert isinstance(state.materials.edits.room.textures["plaster"], ImageTexture)


@pytest.mark.parametrize("name", ["sky.exr", "sky.HDR"])
def test_a_sky_is_baked_and_over_an_object_the_picture_is_its_texture(mode, state, tmp_path, name):
    write_image(tmp_path / name.lower(), np.ones((4, 8, 3), np.float32))
    (tmp_path / name.lower()).rename(tmp_path / name)
    said = drop(mode, tmp_path / name, SKY)
    assert dropping.SKY in said and name in said and not state.materials.edits.room.textures
    assert "is the texture of brass" in drop(mode, tmp_path / name, TABLE)


def test_a_sky_lights_the_view_where_it_can_be_relit(mode, state, tmp_path):
    write_image(tmp_path / "sky.hdr", np.ones((4, 8, 3), np.float32))
    state.session.open()
    state.rebaking.possible = True
    drop(mode, tmp_path / "sky.hdr", SKY)
    asked = state.screen.enter.keywords
    assert asked["name"] == "relight" and asked["environment"] == {"path": tmp_path / "sky.hdr"}
    state.session.close()


def test_the_sky_behind_clear_glass_is_the_sky(mode, state):
    state.meter.cursor = 0.5, 0.6  # on the table, from which the ray reaches the floor
    edits, lobe = state.materials.edits, Lobe(side="transmission", mx=0.001, my=0.001, r0=0.04)
    edits.change("brass", Material(name="brass", kd=0, lobes=(lobe,)))
    assert not mode.input.is_over_sky, "the floor is behind the table"
    edits.change("plaster", Material(name="plaster", kd=0, lobes=(lobe,)))
    assert mode.input.is_over_sky


@pytest.mark.parametrize("text", [None, "{", '{"format": "something"}'])
def test_a_file_that_cannot_be_read_is_named(mode, state, tmp_path, text):
    file = tmp_path / "odd.json"
    if text is None:
        file.mkdir()
    else:
        file.write_text(text)
    assert "odd.json" in drop(mode, file, TABLE)
    assert state.materials.edits.edited == {} and state.materials.editor is None


def test_a_room_without_lamps_says_so(mode, tmp_path):
    assert dropping.NO_LAMPS in drop(mode, tmp_path / "wide.LDT", TABLE)


def test_an_open_editor_and_its_plots_are_for_measuring(mode, state, measurement_file):
    drop(mode, measurement_file, TABLE)
    assert mode.side_plots is not None
    state.screen.size = "design"
    assert mode.side_plots is None and state.materials.editor is not None
    state.materials.close_editor()
