"""The texture of a material exchanged in the window: choice, image, undo, session, and what is refused."""

import numpy as np
import pytest
from PIL import Image

from lambent.core.errors import UserError
from lambent.core.light.colour import srgb_encode
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.albedo import lobe_albedo
from lambent.scenes.scene import ImageTexture, Look, MaterialTextures, Texture, Variant
from lambent.store.contract import scene_record, write_scene_record
from lambent.store.kept.images import IMAGES, kept_image, readable, with_paths
from lambent.store.kept.session import FILE, RoomState, read_session
from lambent.store.kept.states import variants_of
from lambent.store.store import Store
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.edits.keeping import SessionKeeper
from lambent.viewer.modes.walk.session.texturing import NONE, OWN, Texturing
from lambent.viewer.modes.walk.session.thumbnails import SIDE, texture_thumbnail
from lambent.viewer.screen import Rect, Screen
from tests.viewer.conftest import Clock
from tests.viewer.small_store import write_small_store

OAK = MaterialTextures(diffuse=Texture(np.ones((2, 2, 3), np.float16)))
SCENE = {
    "plaster": Material(name="plaster", kd=0.6),
    "oak": Material(name="oak", kd=(0.4, 0.3, 0.1)),
    "steel": Material(name="steel", kd=0.1),
    "copper": Material(name="copper", kd=0.0, lobes=(Lobe(mx=0.1, my=0.1, r0=(0.9, 0.6, 0.4)),)),
}


@pytest.fixture
def picture(tmp_path):
    file = tmp_path / "elsewhere" / "bricks.png"
    file.parent.mkdir()
    Image.fromarray(np.full((4, 4, 3), (255, 0, 0), np.uint8)).save(file)
    return file


@pytest.fixture
def folder(tmp_path):
    return write_small_store(tmp_path / "room.store")


class Window:
    """Edits, textures and session of one window."""

    def __init__(self, folder):
        self.screen = Screen(folder, Clock(), Rect(0, 0, 400, 300))
        self.edits = MaterialEdits(SCENE)
        self.keeper = SessionKeeper(self.edits, folder, self.screen)
        self.lines = self.keeper.open()
        self.texturing = Texturing(self.edits, self.screen, folder, textures={"oak": OAK}, without_uv={"steel"})

    @property
    def said(self):
        return self.screen.messages[-1].text


@pytest.fixture
def window(folder):
    opened = Window(folder)
    yield opened
    opened.keeper.close()


def test_a_texture_brings_its_mean_and_undo_takes_both_back(window):
    texturing, edits = window.texturing, window.edits
    assert list(texturing.choices("plaster")) == [NONE, "of oak"] and texturing.shown("plaster") == NONE
    texturing.choose("plaster", texturing.choices("plaster")["of oak"])
    assert edits.room.textures == {"plaster": "oak"} and edits.current("plaster").kd == SCENE["oak"].kd
    assert texturing.shown("plaster") == "of oak" and not edits.in_stroke
    edits.undo()
    assert edits.room == RoomState()
    edits.redo()
    texturing.choose("plaster", None)
    assert edits.room.textures == {} and edits.current("plaster").kd == SCENE["oak"].kd, "none keeps the colour"


def test_a_material_returns_to_its_own_texture(window):
    texturing, edits = window.texturing, window.edits
    assert list(texturing.choices("oak")) == [OWN, NONE] and texturing.shown("oak") == OWN
    texturing.choose("oak", "")
    assert edits.room.textures == {"oak": ""} and texturing.shown("oak") == NONE
    texturing.choose("oak", None)
    assert edits.room == RoomState()


def test_an_image_is_copied_into_the_store_and_outlives_its_file(window, folder, picture):
    window.texturing.open("plaster", f"  '{picture}' ")
    (copy,) = (folder / IMAGES).iterdir()
    assert window.edits.room.textures == {"plaster": ImageTexture(copy.name)}
    assert window.edits.current("plaster").kd == pytest.approx((1, 0, 0)), "the mean of the image"
    assert window.texturing.shown("plaster") == "bricks.png"
    window.texturing.repeat("plaster", 3.0)
    window.texturing.repeat("plaster", 4.0)
    window.edits.end_stroke()
    window.edits.undo()
    assert window.edits.room.textures["plaster"].repeat == 1, "one drag is one step"
    window.edits.redo()
    assert window.keeper.save()
    window.keeper.close()
    picture.unlink()
    again = Window(folder)
    assert again.lines == () and again.edits.room == window.edits.room
    assert again.edits.room.textures["plaster"] == ImageTexture(copy.name, 4.0)
    assert with_paths(again.edits.room.textures, folder)["plaster"].file == str(copy.resolve())
    again.keeper.close()
    assert copy.exists()


def test_a_metal_has_less_room_for_an_image(window, picture):
    """Else it would reflect more light than arrives."""
    window.texturing.open("copper", str(picture))
    kd = window.edits.current("copper").kd
    assert (
        kd[0] == pytest.approx(1 - lobe_albedo(SCENE["copper"], "reflection")[0]) and kd[0] < 0.5 and kd[1:] == (0, 0)
    )


def test_images_of_no_state_are_deleted(window, folder, picture):
    window.texturing.open("plaster", str(picture))
    window.edits.undo()
    window.keeper.close()
    assert list((folder / IMAGES).iterdir()) == []


def test_a_missing_image_is_one_line_and_stays_in_the_session(window, folder, picture):
    window.texturing.open("plaster", str(picture))
    assert window.keeper.save()
    window.keeper.close()
    (copy,) = (folder / IMAGES).iterdir()
    copy.unlink()
    again = Window(folder)
    (line,) = again.lines
    assert "plaster shows its own texture" in line and copy.name in line and "\n" not in line
    assert readable(again.edits.room.textures, folder)[0] == {}
    again.edits.change("oak", Material(name="oak", kd=0.1))
    assert again.keeper.save() and read_session(folder / FILE).now.textures == {"plaster": ImageTexture(copy.name)}
    again.keeper.close()


def test_an_image_outside_the_store_is_not_followed(folder, picture):
    worn, faults = readable({"plaster": ImageTexture("../../elsewhere/bricks.png")}, folder)
    assert worn == {} and "leaves its folder" in faults[0]


def test_refusals_are_lines(window, tmp_path, picture):
    texturing = window.texturing
    texturing.open(None, str(picture))
    assert "select an object first" in window.said
    texturing.open("steel", str(picture))
    assert "steel: has no texture coordinates" in window.said
    texturing.open("plaster", str(tmp_path / "missing.png"))
    assert "missing.png" in window.said
    (tmp_path / "broken.png").write_bytes(b"\x89PNG broken")
    texturing.open("plaster", str(tmp_path / "broken.png"))
    assert "cannot be read" in window.said
    texturing.open("plaster", "  ")
    assert "no file name" in window.said
    assert window.edits.room == RoomState()


def test_a_store_that_is_not_writable_names_the_image_where_it_is(window, folder, picture):
    (folder / IMAGES).write_text("a file in the way of the folder")
    window.texturing.open("plaster", str(picture))
    assert window.edits.room.textures == {"plaster": ImageTexture(str(picture))}
    with pytest.raises(UserError):
        kept_image(folder, picture)


def test_images_of_the_scenes_variants_stay(window, folder, picture):
    name = kept_image(folder, picture)
    store = Store.open(folder)
    variant = Variant("red", {"plaster": Look(SCENE["plaster"], ImageTexture(name))})
    write_scene_record(store, scene_record(store).model_copy(update={"variants": (variant,)}))
    store.close()
    window.keeper.close()
    assert [path.name for path in (folder / IMAGES).iterdir()] == [name]
    assert variants_of(Store.open(folder))[0].looks["plaster"].textures.file == str(folder / IMAGES / name)


def test_thumbnails_are_made_in_the_background(window, picture, folder):
    texturing = window.texturing
    texturing.open("plaster", str(picture))
    choices = texturing.choices("plaster")
    assert texturing.thumbnail("plaster", choices[NONE]) is None and not texturing.thumbnails.busy
    red, oak = choices["bricks.png"], choices["of oak"]
    assert texturing.thumbnail("plaster", red) not in window.screen.images and texturing.thumbnails.busy, "no waiting"

    def made(of):
        while texturing.thumbnails.busy or (name := texturing.thumbnail("plaster", of)) not in known():
            texturing.thumbnail("plaster", of)
        return window.screen.images.get(name)

    def known():
        return {*window.screen.images, *texturing.thumbnails.failed}

    assert (made(red) == (255, 0, 0, 255)).all() and made(red).shape == (SIDE, SIDE, 4)
    expected = np.round(255 * srgb_encode(np.array(SCENE["oak"].kd)))
    assert np.abs(made(oak)[..., :3].astype(int) - expected).max() <= 1
    assert made(ImageTexture(str(folder / "gone.png"))) is None, "no picture, and no error"


def test_thumbnails_of_large_textures_show_all_of_them():
    texels = np.zeros((700, 900, 3), np.float16)
    texels[:350, :, 0], texels[350:, :, 2] = 1, 1
    found = texture_thumbnail(texels)[..., :3]
    assert (found[: SIDE // 2 - 1] == (255, 0, 0)).all() and (found[SIDE // 2 + 1 :] == (0, 0, 255)).all()
