"""The finish library: what it lists, its pictures on a sphere, and what choosing does; the material in words."""

import numpy as np
import pytest
from PIL import Image

from lambent.core.light.colour import luminance, srgb_decode
from lambent.materials.document import Lobe, Material
from lambent.scenes.scene import MaterialTextures
from lambent.viewer.modes.walk.session.finishes import Finish, Finishes
from lambent.viewer.modes.walk.session.thumbnails import BALL_SIDE, ball
from lambent.viewer.panels import parameters
from tests.viewer.panel_driver import PanelDriver, walk_mode

GOLD = Material(name="gold", kd=0, lobes=(Lobe(mx=0.2, my=0.2, r0=(1, 0.77, 0.34)),))


@pytest.fixture
def finishes(state):
    return Finishes(state.materials.edits, state.texturing, state.screen)


def made(finishes, finish):
    """The picture of a finish; None if there cannot be one."""
    thumbnails, images = finishes.texturing.thumbnails, finishes.screen.images
    while (name := finishes.thumbnail(finish)) not in images and name not in thumbnails.failed:
        thumbnails._work.wait()
    return images.get(name)


def test_documents_of_the_folder_follow_the_scene(finishes, screen):
    assert [one.name for one in finishes.all] == ["plaster", "brass"]
    GOLD.save(screen.folder / "gold leaf.json")
    (screen.folder / "notes.txt").write_text("no finish")
    (screen.folder / "folder.json").mkdir()
    assert [one.name for one in finishes.all] == ["plaster", "brass", "gold leaf"]
    assert made(finishes, finishes.all[-1]).shape == (BALL_SIDE, BALL_SIDE, 4)


@pytest.mark.parametrize("text", ["{", "[1, 2]", '{"format": "lambent-session"}', '{"kd": -7}'])
def test_a_file_that_is_no_material_leaves_the_list(finishes, screen, state, text):
    (screen.folder / "other.json").write_text(text)
    found = finishes.all[-1]
    assert found.name == "other" and made(finishes, found) is None and finishes.is_unusable(found)
    finishes.choose("plaster", found)
    assert "finish not taken" in screen.messages[-1].text and "other.json" in screen.messages[-1].text
    assert state.materials.edits.edited == {}


def test_a_finish_gives_its_numbers_as_one_step(finishes, screen, state):
    GOLD.save(screen.folder / "gold.json")
    edits = state.materials.edits
    finishes.choose("plaster", finishes.all[-1])
    assert edits.current("plaster") == GOLD.model_copy(update={"name": "plaster"})
    finishes.choose("brass", Finish("plaster"))
    assert edits.current("brass").kd == edits.scene["plaster"].kd and edits.current("brass").name == "brass"
    edits.undo()
    edits.undo()
    assert edits.room.materials == {} and not edits.can_undo


def test_a_finish_of_the_scene_brings_its_texture_and_takes_that_of_before(finishes, state):
    edits, texturing = state.materials.edits, state.texturing
    texturing.textures = {"plaster": MaterialTextures()}
    finishes.choose("brass", Finish("plaster"))
    assert edits.room.textures == {"brass": "plaster"}
    finishes.choose("brass", Finish("brass"))
    assert edits.room.textures == {} and edits.edited == {}
    finishes.choose("plaster", Finish("brass"))
    assert edits.room.textures == {"plaster": ""}
    texturing.without_uv = {"brass"}
    finishes.choose("brass", Finish("plaster"))
    assert "brass" not in edits.room.textures


def test_a_folder_that_is_gone_is_said(finishes, screen):
    screen.folder = screen.folder / "gone"
    assert len(finishes.all) == 2 and "are not shown" in screen.messages[-1].text


@pytest.mark.long
def test_a_sphere_looks_like_its_material():
    matte, black = ball(Material(name="red", kd=(0.8, 0.1, 0.1))), ball(Material(name="black", kd=0))
    middle = BALL_SIDE // 2
    assert (matte[0, 0, 3], matte[middle, middle, 3]) == (0, 255), "clear around it"
    red, green, blue = matte[middle, middle, :3].astype(int)
    assert red > 2 * green and abs(green - blue) < 12 and black[..., :3].max() == 0
    glossy = [ball(GOLD.model_copy(update={"lobes": (GOLD.lobes[0].of_kind("reflection").model_copy(
        update={"mx": m, "my": m}),)})) for m in (0.02, 0.6)]  # fmt: skip
    step = [np.abs(np.diff(luminance(srgb_decode(one[20:-20, 20:-20, :3] / 255)))).max() for one in glossy]
    assert step[0] > 3 * step[1], "a mirror shows the edges of lamps"
    assert np.ptp(ball(Material(name="sheet", kd=0, kt_d=0.5))[..., 0]) > 50


def test_the_design_size_changes_colour_shine_and_roughness(monkeypatch, state, geometry):
    state.screen.size = "design"
    window = PanelDriver(monkeypatch, walk_mode(state, geometry))
    state.selection.choose("table")
    window.frame(2)
    assert "mx" not in window.rects and "object" in window.rects
    before = state.materials.edits.current("brass").lobes[0]
    window.drag("roughness", (100 * np.sqrt(np.sqrt(before.mx * before.my)) - 4) / 96, 0.8)
    rough = state.materials.edits.current("brass").lobes[0]
    assert rough.mx > 1.5 * before.mx and rough.my / rough.mx == pytest.approx(before.my / before.mx)
    window.drag("shine", 0.5, 0.25)
    dim = state.materials.edits.current("brass").lobes[0]
    assert np.divide(dim.k, rough.k) == pytest.approx([0.5] * 3, abs=0.05) and dim.mx == rough.mx
    places = dict(window.rects)
    window.click("##finish 0")
    window.frame()
    assert window.rects["##finish 1"] == places["##finish 1"], "nothing moves under the mouse"
    assert state.materials.edits.current("brass").lobes == (), "plaster is matte"
    window.click("reset")
    assert state.materials.edits.edited == {}
    window.close()


def test_words_leave_an_untouched_material_bit_equal(monkeypatch):
    """Also one beyond the range of the sliders, and one without shine."""
    seen = {}
    for name in ("begin_disabled", "end_disabled"):
        monkeypatch.setattr(parameters.imgui, name, lambda *args: None)
    monkeypatch.setattr(parameters, "swatch", lambda label, value, meaning: value)
    monkeypatch.setattr(parameters, "slider", lambda label, value, *rest, **kw: seen.setdefault(label, value))
    lobes = (Lobe(k=(3, 2, 0.1), mx=0.037, my=3.9), Lobe(k=0.2, mx=0.001, my=0.001))
    for material in (
        GOLD,
        Material(name="two", kd=0.2, lobes=lobes),
        Material(name="dark", kd=0, lobes=(Lobe(k=0, mx=0.1, my=0.1),)),
    ):
        seen.clear()
        assert parameters.in_words(material, material) == material
        assert seen["shine"] == pytest.approx(100 if any(lobe.k[0] for lobe in material.lobes) else 0)


def test_only_finishes_in_sight_are_pictured(monkeypatch, state, geometry, screen):
    for number in range(60):
        GOLD.save(screen.folder / f"gold {number:02}.json")
    screen.size = "design"
    window = PanelDriver(monkeypatch, walk_mode(state, geometry))
    state.selection.choose("table")
    asked = set()
    monkeypatch.setattr(state.texturing.thumbnails, "get", lambda key, make: asked.add(key) or "none")
    window.frame(3)
    window.close()
    assert 10 < len(asked) < 20


@pytest.mark.long
def test_pictures_of_finishes_reach_the_window(monkeypatch, state, geometry, screen):
    """A button shows its thumbnail once the window has made a texture of it."""
    state.screen.size = "design"
    window = PanelDriver(monkeypatch, walk_mode(state, geometry))
    state.selection.choose("table")
    while len(screen.images) < 2:
        window.frame()
    assert all(Image.fromarray(picture).size == (BALL_SIDE, BALL_SIDE) for picture in screen.images.values())
    window.close()
