"""`lambent bake` and `render` on a store: pictures in every format, other colours, variants and light, edited views."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from lambent.baking.bake import bake
from lambent.core.light.false_colour import Range, false_colour
from lambent.core.light.photometry import LM_PER_W, photometric
from lambent.core.pictures.images import read_encoded, read_image, write_image
from lambent.core.views.camera import Camera, CameraPath
from lambent.editing.session.document import Surroundings
from lambent.editing.session.session import Session
from lambent.materials.document import Material
from lambent.scenes.geometry import placed, sphere
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import Look, Scene, SceneObject, Variant
from lambent.store.store import Store
from tests.baking.small_scenes import TINY, room_with_step
from tests.cli.edited_floor import SIZE, saved, write_floor
from tests.viewer.small_store import write_small_store


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_small_store(tmp_path_factory.mktemp("cli") / "small.store")


@pytest.mark.long
def test_still_in_every_format(lambent, store, tmp_path):
    shown = {}
    for suffix in ("png", "exr", "hdr"):
        file = tmp_path / f"a.{suffix}"
        outcome = lambent("render", store, "-o", file, "--size", "96x64", "--camera", "side", "--json")
        assert outcome.code == 0 and outcome.json["frames"] == 1, outcome
        shown[suffix] = read_image(file)
        assert shown[suffix].shape == (64, 96, 3)
    np.testing.assert_allclose(shown["hdr"], shown["exr"], rtol=0.02, atol=0.01)
    assert shown["png"].mean() > 0.02


@pytest.mark.long
def test_false_colour_names_the_luminance(lambent, store, tmp_path):
    """The plaster of the small store has a luminance of kd E/pi everywhere: the picture says so in its colour."""
    file = tmp_path / "a.png"
    common = ("render", store, "-o", file, "--size", "192x128", "--view", "false-colour", "--show", "diffuse")
    assert lambent(*common, "--range", "10:1000").code == 0
    floor = read_encoded(file)[-8, 20]
    expected = false_colour(photometric(np.array([0.6, 0.55, 0.5]) * 2 / np.pi), Range(10, 1000))
    np.testing.assert_allclose(floor, expected, atol=0.01)
    assert lambent(*common, "--linear").code == 0, "the range is found"


@pytest.mark.long
def test_luminance_and_illuminance_by_their_names(lambent, store, tmp_path):
    """2 W/m2 arrive everywhere; --show names the quantity, and the view and the unit follow."""
    file = tmp_path / "a.png"
    common = ("render", store, "-o", file, "--size", "192x128", "--force")
    for what, value, unit in (("illuminance", 2 * LM_PER_W, "lx"), ("luminance", 0, "cd/m2")):
        said = lambent(*common, "--show", what, "--range", "10:1000", "--json").json
        assert said["scale"] == {"low": 10, "high": 1000, "log": True, "unit": unit} and said["exposure_ev"] is None
        if value:
            expected = false_colour(np.array(value), Range(10, 1000))
            np.testing.assert_allclose(read_encoded(file)[-8, 20], expected, atol=0.01)


@pytest.mark.long
def test_exposure_as_ev100(lambent, store, tmp_path):
    common = ("render", store, "-o", tmp_path / "a.png", "--size", "32x24", "--force", "--json")
    assert lambent(*common, "--ev100", "9").json["ev100"] == pytest.approx(9)
    said = lambent(*common, "--exposure", "-2").json
    assert said["exposure_ev"] == -2 and said["ev100"] == pytest.approx(np.log2(LM_PER_W / 1.2) + 2)


def test_bake_of_the_geometry(lambent, tmp_path):
    outcome = lambent("bake", "builtin:box", "-o", tmp_path / "s", "--only", "geometry", "--json")
    assert outcome.code == 0, outcome
    assert outcome.json["arrays"]["geometry/faces"] == "complete"
    assert lambent("inspect", tmp_path / "s", "--json").json["is"] == "store"


def test_a_bake_says_what_its_scene_lost(lambent, tmp_path):
    corners = [f"v {x} {y} 0" for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    (tmp_path / "a.obj").write_text("\n".join([*corners, "v nan 0 0", "f 1 2 3", "f 1 3 4", "f 1 2 5"]))
    done = lambent("bake", tmp_path / "a.obj", "-o", tmp_path / "a.store", "--only", "geometry")
    assert "warning: object: 1 triangles dropped: a vertex is not finite" in done.err


Command = Callable[..., Any]
WITHIN = Camera("within", (1.4, 1.2, -1.4), (-0.8, 0.5, 0.0), fov_y_deg=70)
SMALL = ("--size", "48x32", "--integrator", "rings")


def room() -> Scene:
    """The room with a pebble without uv, a camera, a path, and a variant of other colour."""
    whole, pebble = room_with_step(), placed(sphere(0.1, 8, 4), (-1.5, 0.1, -1.5))
    bare = SceneObject("pebble", replace(pebble, uv=np.zeros_like(pebble.uv)), "bare")
    whole = replace(whole, objects=(*whole.objects, bare), materials={**whole.materials, "bare": Material(kd=0.3)})
    blue = Look(whole.materials["grey"].model_copy(update={"kd": (0.05, 0.05, 0.5)}))
    path = CameraPath("rest", (WITHIN, WITHIN), 1.0)
    return replace(whole, cameras=(WITHIN,), paths=(path,), variants=(Variant("blue", {"grey": blue}),))


@pytest.fixture(scope="module")
def lit(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lit") / "s"
    bake(room(), folder, quality=TINY, light_groups="scene").close()
    return folder


@pytest.mark.long
@pytest.mark.usefixtures("adapter", "mi")
def test_colours_and_a_mix_go_together(lambent: Command, lit: Path, tmp_path: Path) -> None:
    pictures = {}
    for name, more in {
        "plain": (),
        "red": ("--recolour", "grey=#c83232"),
        "dim": ("--recolour", "grey=#c83232", "--light", "lamp=0.5"),
    }.items():
        done = lambent("render", lit, "-o", tmp_path / f"{name}.exr", *SMALL, *more)
        assert done.code == 0 and ("are estimated for the changed materials" in done.err) == (name != "plain")
        pictures[name] = read_image(tmp_path / f"{name}.exr")
    assert pictures["dim"] == pytest.approx(pictures["red"] / 2, rel=6e-3, abs=2e-3)
    mean = {name: picture.mean(axis=(0, 1)) for name, picture in pictures.items()}
    assert mean["red"][1] < 0.4 * mean["plain"][1], "green is lost on walls, and again on what walls light"


@pytest.mark.long
@pytest.mark.usefixtures("adapter", "mi")
def test_an_image_is_a_texture_and_the_light_follows(lambent: Command, lit: Path, tmp_path: Path) -> None:
    """One red image on all walls lights the room as red paint does; halves are seen as such."""
    Image.fromarray(np.full((8, 8, 3), (200, 50, 50), np.uint8)).save(tmp_path / "red.png")
    Image.fromarray(np.repeat([[0], [255]], 4, axis=0).repeat(8, axis=1).astype(np.uint8)).save(tmp_path / "halves.png")
    pictures = {}
    for name, more in {
        "painted": ("--recolour", "grey=#c83232"),
        "even": ("--texture", f"grey={tmp_path / 'red.png'}"),
        "halves": ("--texture", f"gr*={tmp_path / 'halves.png'},0.5"),
    }.items():
        done = lambent("render", lit, "-o", tmp_path / f"{name}.exr", *SMALL, *more)
        assert done.code == 0 and "are estimated for the changed materials" in done.err, done.err
        pictures[name] = read_image(tmp_path / f"{name}.exr")
    assert pictures["even"] == pytest.approx(pictures["painted"], rel=2e-3, abs=1e-3)
    dark, bright = np.quantile(pictures["halves"].mean(axis=-1), (0.2, 0.8))
    assert bright > 10 * dark


@pytest.mark.long
@pytest.mark.usefixtures("adapter", "mi")
def test_a_variant_a_sheet_and_a_film(lambent: Command, lit: Path, tmp_path: Path) -> None:
    assert lambent("render", lit, "--variant", "blue", "-o", tmp_path / "blue.png", *SMALL).code == 0
    blue = read_encoded(tmp_path / "blue.png").mean(axis=(0, 1))
    assert blue[2] > 1.5 * blue[1]
    sheet = lambent("render", lit, "--variants", "-o", tmp_path / "sheet.png", *SMALL, "--json")
    assert sheet.code == 0 and sheet.json["frames"] == 2 and sheet.json["height"] > 64
    keys = '[[keys]]\nat = 0\nas_baked = true\n[[keys]]\nat = 1\nvariant = "blue"'
    (tmp_path / "k.toml").write_text(f'format = "lambent-keyframes"\nversion = 1\n{keys}')
    film = lambent(
        "render", lit, "--path", "rest", "--keyframes", tmp_path / "k.toml", "--fps", 2, "-o", tmp_path / "f-#.exr",
        *SMALL,
    )  # fmt: skip
    assert film.code == 0
    frames = [read_image(file).mean(axis=(0, 1)) for file in sorted(tmp_path.glob("f-*.exr"))]
    green = np.array(frames)[:, 1]
    assert len(frames) >= 2 and (np.diff(green) < 0).all()


WRONG = {
    ("--recolour", "gray=#ff0000"): "--recolour: unknown material; found gray; .*did you mean 'grey'",
    ("--recolour", "grey=red"): "--recolour: cannot be read as a recoloured material; found grey=red; expected MAT",
    ("--texture", "grey"): "--texture: cannot be read as an exchanged texture; found grey; expected MATERIAL=FILE, ",
    ("--texture", "grey=missing.png"): "--texture: is neither a material with textures nor a file; found missing.png",
    ("--texture", "grey=pyproject.toml,0"): "--texture: repetition is out of range; found 0.0",
    ("--variant", "blu"): "--variant: unknown variant; found blu; expected blue; did you mean 'blue'",
    ("--light", "lomp=off"): "unknown light group; found lomp; expected lamp",
}


@pytest.mark.usefixtures("adapter", "mi")
@pytest.mark.parametrize("more", WRONG, ids=" ".join)
def test_what_is_wrong_is_one_line(refused: Command, lit: Path, tmp_path: Path, more: tuple[str, ...]) -> None:
    import re

    said = refused("render", lit, "-o", tmp_path / "a.png", *SMALL, *more)
    assert re.search(WRONG[more], said), said
    assert not (tmp_path / "a.png").exists()


@pytest.mark.usefixtures("adapter")
def test_what_a_store_lacks_is_said(refused: Command, lit: Path, tmp_path: Path) -> None:
    bare = write_small_store(tmp_path / "s")
    colour = ("--recolour", "plaster=#ff0000")
    assert "--only answer" in refused("render", bare, "-o", tmp_path / "a.png", *SMALL, *colour)
    missing = ("--path", "rest", "--keyframes", tmp_path / "none.toml")
    assert "none.toml" in refused("render", lit, "-o", tmp_path / "a-#.png", *SMALL, *missing)


@pytest.mark.long
def test_an_error_names_the_command_that_bakes_what_is_missing(lambent, refused, tmp_path):
    scene, store, picture = write_floor(tmp_path), tmp_path / "a store", tmp_path / "a.exr"

    def drawn_after(session: Path, fault: str) -> np.ndarray:
        error = refused("render", store, "--edit", session, "-o", picture)
        assert fault in error
        command = re.search("run `(.*)`", error)
        assert command is not None
        program, *arguments = shlex.split(command[1])
        assert program == "lambent"
        baked = lambent(*arguments)
        assert baked.code == 0, baked
        outcome = lambent("render", store, "--edit", session, "-o", picture, "--force", "--json")
        assert outcome.code == 0, outcome
        assert (outcome.json["width"], outcome.json["height"]) == SIZE
        return read_image(picture)[6:10, 8:16].mean(axis=(0, 1))

    assert lambent("bake", scene, "-o", store, "--only", "transport", "--view", "above:8x8").code == 0
    plain = drawn_after(saved(scene, "plain.json"), "no transport for camera above, 24 x 16")
    np.testing.assert_allclose(plain, [0.5, 0.5, 0.25], rtol=0.01)
    write_image(tmp_path / "sky.exr", np.full((8, 16, 3), 2.0, np.float32))
    sky = Surroundings(file=str(tmp_path / "sky.exr"), scale=3.0)
    lit = drawn_after(saved(scene, "sky.json", environment=sky), "another environment")
    np.testing.assert_allclose(lit, 6 * plain, rtol=0.01)
    other = Material(kd=0.5, kd_coupled=True)
    changed = drawn_after(saved(scene, "other.json", environment=sky, start=other), "other terms")
    assert changed.min() > 0
    again = drawn_after(saved(scene, "plain.json"), "another environment")
    np.testing.assert_allclose(again, plain, rtol=1e-6)
    png = tmp_path / "a.png"
    for ev, options in ((1.0, ()), (1.0, ("--exposure", "1")), (-3.0, ("--exposure", "-3"))):
        command = ("render", store, "--edit", tmp_path / "plain.json", "-o", png, "--force", "--view", "linear")
        assert lambent(*command, *options).code == 0
        shown = read_image(png)[6:10, 8:16].mean(axis=(0, 1))
        np.testing.assert_allclose(shown, np.minimum(plain * 2**ev, 1), rtol=0.03)


BOUNCED = "--only", "interreflection", "--view", "above:12x8", "--series", "4,1", "--samples", "4"


@pytest.mark.long
def test_what_a_session_changed_is_proposed_for_edits(lambent, tmp_path):
    """Chrome, which hardly anybody sees, is fixed until a session changes it."""
    loaded, file = load_scene(str(write_floor(tmp_path))), tmp_path / "chrome.edits.json"
    chrome = loaded.materials["chrome"].model_copy(update={"kd": (0.1, 0.1, 0.1)})
    session = Session.new("s", loaded.cameras[0], {"chrome": chrome}, size=(12, 8))
    for change, fixed in (({}, ["chrome"]), ({"kd": (0.1, 0.2, 0.3)}, [])):
        session.change("chrome", chrome.model_copy(update=change))
        session.save(file)
        asked = lambent("bake", tmp_path / "scene.toml", "--edit", file, *BOUNCED[4:], "--propose", "--json")
        assert asked.code == 0 and asked.json["proposals"][0]["bounces"]["fixed"] == fixed, asked


@pytest.mark.long
def test_interreflections_are_proposed_and_baked_as_the_user_wants(lambent, tmp_path):
    scene = write_floor(tmp_path)
    asked = lambent("bake", scene, "--view", "above:12x8", "--series", "4,1", "--samples", "4", "--propose")
    assert asked.code == 0 and "paint " in asked.out and "on disk" in asked.out and not list(tmp_path.glob("*.store"))
    said = lambent("bake", scene, *BOUNCED[2:], "--propose", "--fixed", "paint", "--json").json["proposals"][0]
    assert said["bounces"] == {"series": [4, 1], "samples": 4, "fixed": ["paint"]} and said["seconds"] > 0
    store = tmp_path / "a.store"
    first = lambent("bake", scene, "-o", store, *BOUNCED, "--editable", "chrome")
    assert first.code == 0 and re.search("chrome +edited", first.err) and "samples/s" in first.err, first.err

    def edited() -> set[str]:
        found = (a for a in Store.open(store).artefacts("interreflection") if a.name.endswith("/tails"))
        return {name for a in found for name, _ in a.meta["tails"]["slots"]} - {""}

    chosen = edited()
    assert "chrome" in chosen
    more = lambent("bake", scene, "-o", store, *BOUNCED[:-1], "8")
    assert more.code == 0 and edited() == chosen and "that the store has: chrome" in more.err, more.err
    assert lambent("bake", scene, "-o", store, *BOUNCED, "--fixed", "chrome").code == 0 and edited() == {"paint"}
