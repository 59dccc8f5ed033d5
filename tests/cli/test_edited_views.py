"""Edited views from the command line: their bake, their stills, and the command that an error names."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from lambent.core.pictures.images import read_image, write_image
from lambent.editing.session.document import Surroundings
from lambent.editing.session.session import Session
from lambent.materials.models import model_named
from lambent.scenes import load_scene
from lambent.store.store import Store

SIZE = (24, 16)
SCENE = """
format = "lambent-scene"
version = 1
name = "floor"
geometry = "floor.obj"
exposure_ev = 1.0
[environment]
kind = "constant"
radiance = [1.0, 1.0, 1.0]
[materials.paint]
kd = 0.5
[materials.chrome]
lobes = [{ mx = 0.3, my = 0.3 }]
[[cameras]]
name = "above"
position = [0.0, 2.0, 1.0]
target = [0.0, 0.0, 0.0]
fov_y_deg = 30.0
"""
FLOOR = """
v -9 0 -9
v -9 0 9
v 9 0 9
v 9 0 -9
v -9 -1 -9
v -9 -1 9
v 9 -1 9
usemtl paint
o floor
f 1 2 3 4
usemtl chrome
o below
f 5 6 7
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "floor.obj").write_text(FLOOR)
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path / "scene.toml"


def saved(scene: Path, name: str, **changes: object) -> Path:
    """A session of the floor's paint, half of it in blue."""
    loaded = load_scene(str(scene))
    start = changes.pop("start", loaded.materials["paint"])
    session = Session.new("s", loaded.cameras[0], {"paint": start}, size=SIZE, **changes)  # type: ignore[arg-type]
    session.tint("paint", session.editable("paint").terms[0].name, (1.0, 1.0, 0.5))
    session.save(scene.parent / name)
    return scene.parent / name


def test_an_error_names_the_command_that_bakes_what_is_missing(lambent, refused, scene, tmp_path):
    store, picture = tmp_path / "a store", tmp_path / "a.exr"

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
    other = model_named("oren-nayar")()
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


@pytest.mark.parametrize(
    "option",
    [("--size", "9x9"), ("--camera", "above"), ("--path", "tour"), ("--integrator", "path"), ("--samples", "4"),
     ("--show", "diffuse"), ("--planar", "off"), ("--scene", "x"), ("--fps", "25")],
)  # fmt: skip
def test_what_a_session_decides_is_no_option(refused, scene, tmp_path, option):
    session = saved(scene, "a.json")
    error = refused("render", tmp_path / "none", "--edit", session, "-o", tmp_path / "a.png", *option)
    assert f"error: {option[0]}: " in error and "fixes camera, size and light" in error


def test_views_that_cannot_be_baked(refused, scene, tmp_path):
    def error(*options: object) -> str:
        return refused("bake", scene, "-o", tmp_path / "s", *options)

    view = "--only", "transport", "--view"
    assert "unknown camera" in (found := error(*view, "abov:9x9")) and "expected above" in found
    for size in ("0x9", "9x99999", "9x99999999999"):
        assert "expected WIDTHxHEIGHT" in error(*view, f"above:{size}")
    assert "name them with --view" in error("--only", "transport")
    assert "--only" in error("--only", "geometry", "--view", "above")
    stranger = Session.new("s", load_scene(str(scene)).cameras[0], {"wool": model_named("oren-nayar")()})
    stranger.save(tmp_path / "wool.json")
    assert "unknown material" in error("--only", "transport", "--edit", tmp_path / "wool.json")
    assert not (tmp_path / "s").exists()


BOUNCED = "--only", "interreflection", "--view", "above:12x8", "--series", "4,1", "--samples", "4"


def test_interreflections_are_proposed_and_baked_as_the_user_wants(lambent, scene, tmp_path):
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


@pytest.mark.parametrize(
    ("fault", "options"),
    [
        ("--view: is missing", ("-o", "s", "--only", "interreflection")),
        ("expected 2 to 6 numbers", (*BOUNCED[2:], "--propose", "--series", "64")),
        ("expected powers of two", (*BOUNCED[2:], "--propose", "--series", "63,1")),
        ("--editable: unknown material", (*BOUNCED[2:], "--propose", "--editable", "carpet")),
        ("--fixed and --editable; found paint", (*BOUNCED[2:], "--propose", "--fixed", "paint", "--editable", "paint")),
        ("--editable: applies to interreflections only", ("-o", "s", "--editable", "paint")),
        ("--fixed: applies to", ("-o", "s", "--only", "transport", "--view", "above", "--fixed", "paint")),
        ("exclude each other", ("-o", "s", *BOUNCED, "--workers", "2", "--cluster", "a:1")),
    ],
)
def test_proposals_that_cannot_be_made(refused, scene, tmp_path, monkeypatch, fault, options):
    monkeypatch.chdir(tmp_path)
    assert fault in refused("bake", scene, *options)
    assert not (tmp_path / "s").exists()
