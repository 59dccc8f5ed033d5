"""`lambent render` with other colours, variants and mixes of the light: what is drawn, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from lambent.bake.bake import bake
from lambent.core.pictures.images import read_encoded, read_image
from lambent.core.views.camera import Camera, CameraPath
from lambent.materials.document import Material
from lambent.scenes.geometry import placed, sphere
from lambent.scenes.scene import Look, Scene, SceneObject, Variant
from tests.bake.small_scenes import TINY, room_with_step
from tests.viewer.small_store import write_small_store

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
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lit") / "s"
    bake(room(), folder, quality=TINY, light_groups="scene").close()
    return folder


@pytest.mark.usefixtures("adapter", "mi")
def test_colours_and_a_mix_go_together(lambent: Command, store: Path, tmp_path: Path) -> None:
    pictures = {}
    for name, more in {
        "plain": (),
        "red": ("--recolour", "grey=#c83232"),
        "dim": ("--recolour", "grey=#c83232", "--light", "lamp=0.5"),
    }.items():
        done = lambent("render", store, "-o", tmp_path / f"{name}.exr", *SMALL, *more)
        assert done.code == 0 and ("are estimated for the changed materials" in done.err) == (name != "plain")
        pictures[name] = read_image(tmp_path / f"{name}.exr")
    assert pictures["dim"] == pytest.approx(pictures["red"] / 2, rel=6e-3, abs=2e-3)
    mean = {name: picture.mean(axis=(0, 1)) for name, picture in pictures.items()}
    assert mean["red"][1] < 0.4 * mean["plain"][1], "green is lost on walls, and again on what walls light"


@pytest.mark.usefixtures("adapter", "mi")
def test_an_image_is_a_texture_and_the_light_follows(lambent: Command, store: Path, tmp_path: Path) -> None:
    """One red image on all walls lights the room as red paint does; halves are seen as such."""
    Image.fromarray(np.full((8, 8, 3), (200, 50, 50), np.uint8)).save(tmp_path / "red.png")
    Image.fromarray(np.repeat([[0], [255]], 4, axis=0).repeat(8, axis=1).astype(np.uint8)).save(tmp_path / "halves.png")
    pictures = {}
    for name, more in {
        "painted": ("--recolour", "grey=#c83232"),
        "even": ("--texture", f"grey={tmp_path / 'red.png'}"),
        "halves": ("--texture", f"gr*={tmp_path / 'halves.png'},0.5"),
    }.items():
        done = lambent("render", store, "-o", tmp_path / f"{name}.exr", *SMALL, *more)
        assert done.code == 0 and "are estimated for the changed materials" in done.err, done.err
        pictures[name] = read_image(tmp_path / f"{name}.exr")
    assert pictures["even"] == pytest.approx(pictures["painted"], rel=2e-3, abs=1e-3)
    dark, bright = np.quantile(pictures["halves"].mean(axis=-1), (0.2, 0.8))
    assert bright > 10 * dark


@pytest.mark.usefixtures("adapter", "mi")
def test_a_variant_a_sheet_and_a_film(lambent: Command, store: Path, tmp_path: Path) -> None:
    assert lambent("render", store, "--variant", "blue", "-o", tmp_path / "blue.png", *SMALL).code == 0
    blue = read_encoded(tmp_path / "blue.png").mean(axis=(0, 1))
    assert blue[2] > 1.5 * blue[1]
    sheet = lambent("render", store, "--variants", "-o", tmp_path / "sheet.png", *SMALL, "--json")
    assert sheet.code == 0 and sheet.json["frames"] == 2 and sheet.json["height"] > 64
    keys = '[[keys]]\nat = 0\nas_baked = true\n[[keys]]\nat = 1\nvariant = "blue"'
    (tmp_path / "k.toml").write_text(f'format = "lambent-keyframes"\nversion = 1\n{keys}')
    film = lambent(
        "render", store, "--path", "rest", "--keyframes", tmp_path / "k.toml", "--fps", 2, "-o", tmp_path / "f-#.exr",
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
def test_what_is_wrong_is_one_line(refused: Command, store: Path, tmp_path: Path, more: tuple[str, ...]) -> None:
    import re

    said = refused("render", store, "-o", tmp_path / "a.png", *SMALL, *more)
    assert re.search(WRONG[more], said), said
    assert not (tmp_path / "a.png").exists()


@pytest.mark.usefixtures("adapter")
def test_what_a_store_lacks_is_said(refused: Command, store: Path, tmp_path: Path) -> None:
    bare = write_small_store(tmp_path / "s")
    colour = ("--recolour", "plaster=#ff0000")
    assert "--only answer" in refused("render", bare, "-o", tmp_path / "a.png", *SMALL, *colour)
    missing = ("--path", "rest", "--keyframes", tmp_path / "none.toml")
    assert "none.toml" in refused("render", store, "-o", tmp_path / "a-#.png", *SMALL, *missing)
