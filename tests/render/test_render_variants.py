"""Variants of a scene in stills: their materials, textures and light."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.core.errors import UserError
from lambent.core.light.light_mix import GroupMix, LightMix, parse_light
from lambent.core.pictures.images import read_encoded, read_image, write_shown
from lambent.core.views.camera import Camera, CameraPath
from lambent.render import Settings, film, sheet, still
from lambent.render.captions import caption_font
from lambent.render.sheet import laid_out, shape_of, with_the_baked_state
from lambent.scenes.looks.image_textures import mean_and_detail
from lambent.scenes.looks.look_track import LookTrack
from lambent.scenes.scene import ImageTexture, Look, MaterialTextures, Texture, Variant
from lambent.store.contract import scene_record, write_scene_record
from lambent.store.kept.images import kept_image
from lambent.store.kept.session import FILE, RoomState, WalkSession, write_session
from lambent.store.kept.states import variants_of
from lambent.store.kept.views import Views, change_views
from lambent.store.store import Store
from tests.baking.small_scenes import TINY, room_with_step
from tests.viewer.small_store import MATERIALS, with_light_groups, write_small_store

WITHIN = Camera("in", (1.4, 1.2, -1.4), (-0.8, 0.5, 0.0), fov_y_deg=70)
SMALL = Settings(48, 32, integrator="rings")
RED = Look(MATERIALS["plaster"].model_copy(update={"kd": (0.6, 0.0, 0.0)}))
DIM = LightMix({name: GroupMix(intensity=0.5) for name in ("lamp", "sky", "sun")})
COLOUR = (0.5, 0.05, 0.05)
VARIANTS = (Variant("red", {"plaster": RED}), Variant("dim", light=DIM))


def add_variants(folder: Path, variants: tuple[Variant, ...]) -> Path:
    store = Store.open(folder)
    write_scene_record(store, scene_record(store).model_copy(update={"variants": variants}))
    store.close()
    return folder


def image(store: Path, settings: Settings, tmp_path: Path, notes: list[str] | None = None) -> np.ndarray:
    camera = None if scene_record(Store.open(store)).cameras else WITHIN
    still(store, tmp_path / "a.exr", camera, settings, note=(notes if notes is not None else []).append)
    found = read_image(tmp_path / "a.exr")
    (tmp_path / "a.exr").unlink()
    return found


@pytest.fixture
def store(tmp_path: Path) -> Path:
    return add_variants(with_light_groups(write_small_store(tmp_path / "s")), VARIANTS)


@pytest.mark.long
def test_a_store_without_an_answer_shows_the_material_and_says_the_rest(adapter: None, tmp_path: Path) -> None:
    bare, notes = add_variants(write_small_store(tmp_path / "s"), VARIANTS), list[str]()
    red = image(bare, replace(SMALL, variant="red"), tmp_path, notes)
    assert red[-1, 0, 0] > 0 and red[-1, 0, 1] == 0 and any("stay as baked" in note for note in notes)
    dim = image(bare, replace(SMALL, variant="dim"), tmp_path, notes)
    assert np.array_equal(dim, image(bare, SMALL, tmp_path))
    said = [note for note in notes if "light mix of the variant not applied: the store has no light group lamp" in note]
    assert len(said) == 1
    with pytest.raises(UserError, match=r"--variant: unknown variant; found rd; expected red, dim; did you mean 'red'"):
        image(bare, replace(SMALL, variant="rd"), tmp_path)


@pytest.mark.long
def test_a_variant_has_its_light_unless_another_is_given(adapter: None, store: Path, tmp_path: Path) -> None:
    baked = image(store, SMALL, tmp_path)
    dim = image(store, replace(SMALL, variant="dim"), tmp_path)
    assert dim == pytest.approx(baked / 2, rel=6e-3, abs=2e-3)
    given = image(store, replace(SMALL, variant="dim", light=parse_light(["sun=on"])), tmp_path)
    assert given == pytest.approx(baked, rel=6e-3, abs=2e-3)
    blue = LookTrack({"plaster": ((0.0, Look(MATERIALS["plaster"].model_copy(update={"kd": (0.0, 0.0, 0.6)}))),)})
    moving = image(store, replace(SMALL, looks=blue), tmp_path)
    assert np.array_equal(image(store, replace(SMALL, variant="red", looks=blue), tmp_path), moving), "likewise looks"
    assert moving[-1, 0, 2] > 0 and moving[-1, 0, 0] == 0


@pytest.mark.long
def test_states_of_the_session_are_variants(adapter: None, store: Path, tmp_path: Path) -> None:
    """By name; the last one saved is `saved`. A state stands before the scene's variant of its name."""
    red, grey = RED.material, MATERIALS["plaster"].model_copy(update={"kd": (0.2, 0.2, 0.2)})
    gone = RoomState(materials={"no more": grey, "plaster": grey}, textures={"plaster": "no more"})
    states = {"crimson": RoomState(materials={"plaster": red}), "red": gone, "night": RoomState(light=DIM)}
    session = WalkSession(now=RoomState(materials={"plaster": red}, light=DIM), states=states)
    as_red = image(store, replace(SMALL, variant="red"), tmp_path)
    as_dim = image(store, replace(SMALL, variant="dim"), tmp_path)
    write_session(store / FILE, session)
    np.testing.assert_array_equal(image(store, replace(SMALL, variant="crimson"), tmp_path), as_red)
    np.testing.assert_array_equal(image(store, replace(SMALL, variant="night"), tmp_path), as_dim)
    both = image(store, replace(SMALL, variant="saved"), tmp_path)
    assert both == pytest.approx(as_red / 2, rel=2e-2, abs=2e-3)
    shadowed = image(store, replace(SMALL, variant="red"), tmp_path)
    assert abs(shadowed - as_red).max() > 0.01, "the state, not the variant"
    assert [one.name for one in variants_of(Store.open(store), saved=False)] == ["red", "dim", "crimson", "night"]
    (store / FILE).write_text("{")
    with pytest.raises(UserError, match=r"session\.json"):
        image(store, replace(SMALL, variant="dim"), tmp_path)


@pytest.fixture(scope="module")
def room(mi: object, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A baked room with a red variant, one of marble, and one whose image is gone after the bake."""
    scene, folder = room_with_step(), tmp_path_factory.mktemp("room")
    picture, grey = folder / "bricks.png", scene.materials["grey"]
    write_shown(picture, np.array([[[255, 0, 0], [0, 0, 255]]] * 2, np.uint8))
    looks = {"red": Look(grey.model_copy(update={"kd": COLOUR})), "marble": Look(grey, "unworn"),
             "bricks": Look(grey, ImageTexture(str(picture)))}  # fmt: skip
    variants = tuple(Variant(name, {"grey": look}) for name, look in looks.items())
    marble = MaterialTextures(diffuse=Texture(np.full((2, 2, 3), 0.5, np.float16)))
    scene = replace(
        scene, variants=variants, textures={"unworn": marble}, materials={**scene.materials, "unworn": grey}
    )
    bake(scene, folder / "s", quality=TINY, light_groups="scene").close()
    picture.unlink()
    return folder / "s"


@pytest.mark.long
def test_light_answers_a_variant_as_it_answers_the_same_colour(adapter: None, room: Path, tmp_path: Path) -> None:
    recolour = {"grey": COLOUR}
    by_variant = image(room, replace(SMALL, variant="red"), tmp_path)
    assert np.array_equal(by_variant, image(room, replace(SMALL, recolour=recolour), tmp_path))
    half = image(room, replace(SMALL, recolour=recolour, light=parse_light(["lamp=0.5"])), tmp_path)
    assert half == pytest.approx(by_variant / 2, rel=6e-3, abs=2e-3)
    plain = image(room, SMALL, tmp_path)
    assert by_variant.mean(axis=(0, 1))[1] < 0.7 * plain.mean(axis=(0, 1))[1]
    diffuse, textured = (image(room, replace(SMALL, variant=v, show="diffuse"), tmp_path) for v in (None, "marble"))
    assert 0.3 < textured.mean() / diffuse.mean() < 0.9


@pytest.mark.long
def test_every_frame_of_changing_paint_is_a_still_of_that_paint(adapter: None, room: Path, tmp_path: Path) -> None:
    colours = [(0.5, 0.5, 0.5), (0.5, 0.3, 0.3), (0.5, 0.1, 0.1)]
    keys = "".join(f"[[keys]]\nat = {at}\nmaterials.grey.kd = {list(colours[2 * at])}\n" for at in (0, 1))
    settings, paths = replace(SMALL, samples=4), [CameraPath("rest", (WITHIN, WITHIN), s) for s in (1.5, 0.5)]
    shown = frames(room, tmp_path / "f", keys, settings, paths[0])
    for number in (1, 2):
        paint = f"[[keys]]\nat = 0\nmaterials.grey.kd = {list(colours[number])}\n"
        expected, *_ = frames(room, tmp_path / str(number), paint, settings, paths[1])
        assert shown[number] == pytest.approx(expected, rel=2e-3, abs=1e-4)
    assert shown[2].mean(axis=(0, 1))[1] < 0.5 * shown[0].mean(axis=(0, 1))[1]


def test_a_baked_variant_keeps_a_copy_of_its_image(room: Path) -> None:
    (bricks,) = (one for one in variants_of(Store.open(room)) if one.name == "bricks")
    kept = Path(bricks.looks["grey"].textures.file)
    assert kept.is_file() and kept.parent == room / "images"


@pytest.mark.long
def test_a_sheet_has_every_variant_and_its_name(adapter: None, store: Path, tmp_path: Path) -> None:
    notes = list[str]()
    done = sheet(store, tmp_path / "sheet.png", "front", replace(SMALL, exposure_ev=0.0), note=notes.append)
    page = read_encoded(tmp_path / "sheet.png")
    assert done.frames == 3 and page.shape[:2] == (done.height, done.width)
    columns, _ = shape_of(3, 1.5)
    places = [divmod(number, columns) for number in range(3)]
    cells = [page[7 + y * 60 : 39 + y * 60, 7 + x * 55 : 55 + x * 55] for y, x in places]
    for cell, settings in zip(
        cells, (SMALL, replace(SMALL, variant="red"), replace(SMALL, variant="dim")), strict=True
    ):
        still(store, tmp_path / "a.png", "front", replace(settings, exposure_ev=0.0))
        assert np.abs(cell - read_encoded(tmp_path / "a.png")).max() < 0.02
    for y, x in places:
        caption = page[39 + y * 60 : 67 + y * 60, 7 + x * 55 : 55 + x * 55]
        assert caption.min() < 0.5 < caption.mean(), "letters on paper"
    assert any("stay as baked" in note for note in notes), "the store has no answer"


def test_captions_have_letters_beyond_ascii() -> None:
    font = caption_font(20)
    unknown = bytes(font.getmask("\u0378"))
    shown = [bytes(font.getmask(letter)) for letter in "üéłжλ"]
    assert unknown not in shown and len(set(shown)) == len(shown)


def test_names_and_shapes_of_sheets() -> None:
    assert shape_of(1, 1.78) == (1, 1) and shape_of(4, 1.78) == (2, 2) and shape_of(9, 1.78) == (3, 3)
    assert shape_of(12, 1.0) == (4, 3)
    pictures = [np.full((40, 60, 3), 128, np.uint8)] * 3
    page = laid_out(pictures, ["short", "a name that is much too long for its picture", "\x1b[31m"], 2)
    assert page.shape == (2 * (40 + 28) + 7, 2 * (60 + 7) + 7, 3)
    narrow = laid_out(pictures, ["short"] * 3, 2, [", EV100 11.5 and more than fits"] * 3)
    assert narrow.shape == page.shape, "a note is not cut, and a name may vanish beside it"
    assert (page[:, :6] == 255).all() and (page[7 + 68 :, 74:] == 255).all(), "an empty place"
    assert [one.name for one in with_the_baked_state(VARIANTS)] == ["as baked", "red", "dim"]
    assert [one.name for one in with_the_baked_state((Variant("plain"), *VARIANTS))] == ["plain", "red", "dim"]


def test_a_sheet_that_cannot_be_is_said(adapter: None, store: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"--variants: contact sheet is too large; found 3 pictures of 10000x10000"):
        sheet(store, tmp_path / "a.png", None, Settings(10000, 10000))
    with pytest.raises(UserError, match=r"--variants: the store has no variants"):
        sheet(write_small_store(tmp_path / "bare"), tmp_path / "a.png")
    with pytest.raises(UserError, match=r"png"):
        sheet(store, tmp_path / "a.exr")


def frames(store: Path, folder: Path, text: str, settings: Settings, path: CameraPath | str) -> list[np.ndarray]:
    """Two frames a second along a path, with keyframes."""
    folder.mkdir()
    (folder / "k.toml").write_text(f'format = "lambent-keyframes"\nversion = 1\n{text}')
    film(store, folder / "f-#.exr", path, settings, fps=2, keyframes=folder / "k.toml")
    return [read_image(file) for file in sorted(folder.glob("*.exr"))]


@pytest.mark.long
def test_films_are_linear_in_the_mix_between_keyframes(adapter: None, store: Path, tmp_path: Path) -> None:
    keys = '[[keys]]\nat = 0\nas_baked = true\n[[keys]]\nat = 2\nvariant = "dim"\n'
    plain = frames(store, tmp_path / "plain", "[[keys]]\nat = 0\nas_baked = true", SMALL, "tour")
    shown = frames(store, tmp_path / "shown", keys, SMALL, "tour")
    shares = [a.mean() / b.mean() for a, b in zip(shown, plain, strict=True)]
    assert shares == pytest.approx([1, 0.875, 0.75, 0.625, 0.5, 0.5], abs=0.01)
    with pytest.raises(UserError, match=r"--light: light is also in the keyframes"):
        frames(store, tmp_path / "twice", keys, replace(SMALL, light=parse_light(["sun=off"])), "tour")


@pytest.mark.long
def test_pictures_of_a_sheet_share_an_exposure_by_their_light(adapter: None, store: Path, tmp_path: Path) -> None:
    """Half the light is metered one stop above the light as baked, which has the exposure of its scene."""
    done = sheet(store, tmp_path / "a.png", "front", SMALL)
    found = done.ev100_by_name
    assert found is not None and list(found) == ["as baked", "red", "dim"] and done.ev100 == found["as baked"]
    assert found["red"] == found["as baked"]
    each = sheet(store, tmp_path / "a.png", "front", SMALL, exposures="each").ev100_by_name
    assert each is not None and each["red"] != each["as baked"]
    assert each["dim"] == found["dim"] == pytest.approx(each["as baked"] - 1, abs=0.03)
    with pytest.raises(UserError, match="--exposure: unknown exposure of a sheet; found all"):
        sheet(store, tmp_path / "a.png", "front", SMALL, exposures="all")


@pytest.mark.long
def test_a_stored_state_brings_its_light_to_a_saved_view(adapter: None, store: Path, tmp_path: Path) -> None:
    """A state whose light is as baked says so; a variant without a mix leaves the view's."""
    dusk = Views(cameras=(replace(WITHIN, name="dusk"),), lights={"dusk": DIM})
    change_views(store, lambda _: dusk)
    states = {"plain": RoomState(materials={"plaster": RED.material})}
    write_session(store / FILE, WalkSession(now=RoomState(), states=states))

    def mean(variant: str) -> float:
        still(store, tmp_path / "v.exr", "dusk", replace(SMALL, variant=variant))
        found = read_image(tmp_path / "v.exr").mean()
        (tmp_path / "v.exr").unlink()
        return float(found)

    assert mean("red") == pytest.approx(mean("plain") / 2, rel=6e-3)


@pytest.mark.long
def test_a_variant_shows_the_image_of_the_store(adapter: None, store: Path, tmp_path: Path) -> None:
    picture = tmp_path / "bricks.png"
    write_shown(picture, np.array([[[255, 0, 0], [0, 0, 255]]] * 2, np.uint8))
    kd = mean_and_detail(picture).mean
    look = Look(MATERIALS["plaster"].model_copy(update={"kd": kd}), ImageTexture(kept_image(store, picture)))
    add_variants(
        store, (Variant("bricks", {"plaster": look}), Variant("mean", {"plaster": replace(look, textures="")}))
    )
    picture.unlink()
    bricks, mean = (image(store, replace(SMALL, variant=name), tmp_path) for name in ("bricks", "mean"))
    assert np.abs(bricks - mean).max() > 0.05 * mean.max()
