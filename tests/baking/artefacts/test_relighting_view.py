"""Relighting from bake to picture: against the path tracer under any environment, turned and replaced."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import lambent
from lambent.baking.artefacts import relighting
from lambent.baking.bake import bake
from lambent.baking.quality import quality_named
from lambent.baking.reference.path_traced import render_reference
from lambent.baking.transport.view import View
from lambent.cli.main import run
from lambent.core.errors import UserError
from lambent.core.geometry.latlong import lat_long_directions
from lambent.core.pictures.images import read_image, write_image
from lambent.core.progress import Cancelled
from lambent.core.views.camera import Camera
from lambent.editing.relit_view import RelitView
from lambent.scenes.geometry import patch, placed, sphere
from lambent.scenes.scene import ConstantEnvironment, ImageEnvironment, PointLight, Scene, SceneObject, SunSky
from lambent.store.contract import view_artefact_name
from lambent.store.store import Store
from tests.baking.small_scenes import GREY
from tests.baking.transport.test_transport import GLOSSY
from tests.tools.z_test import assert_same_image

SIZE = (16, 12)
CAMERA = Camera("above", (0.0, 2.2, 3.2), (0.0, 0.2, 0.0), fov_y_deg=12.0)
HOW = quality_named("preview").changed("few", relighting={"depth": 2, "samples": 256, "tolerance": 0.01})
FLOOR = 0.02  # of a pixel: triangles of 14 degrees under a smooth sky, and the middles of pixels


def sky(folder: Path, name: str, seed: int) -> Path:
    """A smooth sky that brightens towards a direction."""
    w = lat_long_directions(32, 64)
    axis = np.random.default_rng(seed).normal(size=(3, 3))
    axis[:, 1] = np.abs(axis[:, 1])
    towards = w @ (axis / np.linalg.norm(axis, axis=1, keepdims=True)).T
    write_image(folder / name, (0.4 + np.exp(2.5 * (towards - 1)) * 3).astype(np.float32))
    return folder / name


def open_scene(environment: object) -> Scene:
    floor = SceneObject("floor", patch((-30, 0, 30), (60, 0, 0), (0, 0, -60)), "glossy")
    ball = SceneObject("ball", placed(sphere(0.5, 48, 24), (1.4, 0.6, 0.0)), "grey")
    return Scene("open", (floor, ball), {"grey": GREY, "glossy": GLOSSY}, environment)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("relit")


def bake_view(scene: Scene, folder: Path) -> Store:
    return bake(scene, folder, quality=HOW, only={"relighting"}, views=[View(CAMERA, *SIZE)])


@pytest.fixture(scope="module")
def scene(folder: Path) -> Scene:
    return open_scene(ImageEnvironment(sky(folder, "a.exr", 1), rotation_deg=25.0))


@pytest.fixture(scope="module")
def store(scene: Scene, folder: Path) -> Store:
    return bake_view(scene, folder / "s")


@pytest.fixture
def view(store: Store) -> RelitView:
    return RelitView(store, CAMERA, *SIZE)


def drawn(view: RelitView) -> np.ndarray:
    view.draw()
    return view.image().astype(float)


def assert_is_traced(found: np.ndarray, scene: Scene) -> None:
    expected, variance = render_reference(scene, CAMERA, *SIZE, 512, max_depth=1)
    assert_same_image(found, (FLOOR * found) ** 2, expected, variance)
    assert np.abs(found.mean(axis=(0, 1)) / expected.mean(axis=(0, 1)) - 1).max() < FLOOR


@pytest.mark.long
def test_it_begins_with_the_light_of_the_bake(view: RelitView, scene: Scene) -> None:
    assert 0 < view.error < 0.015
    assert_is_traced(drawn(view), scene)


@pytest.mark.long
def test_a_turned_environment_is_traced_as_one(view: RelitView, scene: Scene) -> None:
    view.turn(70.0)
    assert isinstance(scene.environment, ImageEnvironment)
    turned = replace(scene.environment, rotation_deg=25.0 + 70.0)
    assert_is_traced(drawn(view), replace(scene, environment=turned))


@pytest.mark.long
def test_another_environment_is_traced_as_one_and_pictures_are_linear_in_it(
    view: RelitView, scene: Scene, folder: Path
) -> None:
    other = ImageEnvironment(sky(folder, "b.exr", 2), 0.7, -40.0, up="+x")
    view.light(other)
    single = drawn(view)
    assert_is_traced(single, replace(scene, environment=other))
    view.light(replace(other, scale=2.1))
    assert np.allclose(drawn(view), 3 * single, rtol=1e-5), "to the rounding of float32"
    view.light(ConstantEnvironment((0.0, 0.0, 0.0)))
    assert not drawn(view).any()
    view.light(ConstantEnvironment((2.0, 2.0, 2.0)))  # even light is exact whatever is left out
    even = drawn(view)
    view.turn(77.0)
    assert np.allclose(drawn(view), even, rtol=1e-4)


def test_a_whole_turn_leads_back(view: RelitView) -> None:
    start = drawn(view)
    view.turn(133.0)
    assert np.abs(drawn(view) - start).max() > 0.05
    view.turn(360.0)
    assert np.array_equal(drawn(view), start)
    view.turn(-227.0)
    there = drawn(view)
    view.turn(133.0)
    assert np.allclose(drawn(view), there, rtol=1e-6)


def test_a_new_environment_needs_no_new_transport(store: Store, scene: Scene, folder: Path) -> None:
    before = {a.name: (a.key, a.done) for a in store.artefacts()}
    again = bake_view(replace(scene, environment=ImageEnvironment(sky(folder, "c.exr", 3))), folder / "s")
    changed = {a.name.split("/")[-1] for a in again.artefacts() if before[a.name][0] != a.key}
    assert changed == {"light", "backdrop"}
    bake_view(scene, folder / "s")


@pytest.mark.long
def test_lamps_stay_while_the_environment_turns(folder: Path) -> None:
    """A point light and a glowing square under a dark sky: what the path tracer says, whatever the environment."""
    lamp = SceneObject("lamp", patch((-1.2, 0.0, -2.5), (2.4, 0, 0), (0, 0.9, 0)), "grey", (5.0, 4.0, 3.0))
    dark = open_scene(ConstantEnvironment((0.0, 0.0, 0.0)))
    lit = replace(dark, objects=(*dark.objects, lamp), lights=(PointLight((0.2, 1.0, -0.3), (3.0, 2.0, 1.0)),))
    how = HOW.changed(relighting={"depth": 1, "samples": 16, "paths": 1024})
    store = bake(lit, folder / "lamps", quality=how, only={"relighting"}, views=[View(CAMERA, *SIZE)])
    view = RelitView(store, CAMERA, *SIZE)
    view.turn(90.0)
    assert_is_traced(drawn(view), replace(lit, environment=None))


@pytest.mark.long
def test_pixels_beside_surfaces_show_the_environment(folder: Path) -> None:
    """A camera that looks past a small ball, along -z, at a picture whose middle column is front."""
    picture = np.zeros((64, 128, 3), np.float32)
    picture[:, :64] = (1.0, 0.0, 0.0)
    picture[:, 64:] = (0.0, 1.0, 0.0)
    write_image(folder / "halves.exr", picture)
    ball = SceneObject("ball", placed(sphere(0.1, 12, 6), (0.0, 0.0, -3.0)), "grey")
    camera = Camera("front", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    scene = Scene("ball", (ball,), {"grey": GREY}, ImageEnvironment(folder / "halves.exr"))
    how = HOW.changed(relighting={"depth": 1, "samples": 0})
    view = RelitView(
        bake(scene, folder / "b", quality=how, only={"relighting"}, views=[View(camera, 9, 9)]), camera, 9, 9
    )
    assert np.allclose(view.image()[0, [0, -1]], [[1, 0, 0], [0, 1, 0]])
    for given in (None, ImageEnvironment(folder / "halves.exr")):
        view.light(given)
        view.turn(180.0)
        assert np.allclose(view.image()[0, [0, -1]], [[0, 1, 0], [1, 0, 0]])


def test_python_draws_it(store: Store, view: RelitView, folder: Path) -> None:
    opened = lambent.open(store.folder)
    other = sky(folder, "other.exr", 5)
    view.light(ImageEnvironment(other, 2.0))
    view.turn(90.0)
    shown = opened.relight(CAMERA.name, environment=other, scale=2.0, turn_deg=90.0)
    np.testing.assert_allclose(shown.radiance, drawn(view), rtol=1e-6)
    assert shown.details == {"camera": CAMERA.name, "left_out": view.error}
    with pytest.raises(UserError, match="unknown camera"):
        opened.relight("below")


def test_what_cannot_be_is_said(store: Store, view: RelitView) -> None:
    with pytest.raises(UserError, match=r"no relighting for camera above, 5 x 5.*bake"):
        RelitView(store, CAMERA, 5, 5)
    shown = view.image()
    with pytest.raises(UserError, match="sunsky"):
        view.light(SunSky((0.0, 1.0, 0.0)))
    assert np.array_equal(view.image(), shown)
    assert view_artefact_name(CAMERA, *SIZE, "relighting", "spans") in store


@pytest.mark.long
def test_the_command_draws_what_python_draws(store: Store, view: RelitView, folder: Path) -> None:
    picture, out = sky(folder, "b.exr", 2), folder / "out.exr"
    assert run(["relight", str(store.folder), "-o", str(out), "--environment", str(picture), "--up", "+x",
                "--turn", "30", "--camera", "above"]) == 0  # fmt: skip
    view.light(ImageEnvironment(picture, up="+x"))
    view.turn(30.0)
    assert np.allclose(read_image(out), drawn(view), rtol=1e-3, atol=1e-6)
    assert run(["relight", str(store.folder), "-o", str(folder / "out.png")]) == 0
    for wrong in (["--camera", "none"], ["--environment", str(folder / "no.hdr")]):
        assert run(["relight", str(store.folder), "-o", str(folder / "x.exr"), *wrong]) == 2


@pytest.mark.long
def test_an_interrupted_bake_ends_with_the_same_arrays(
    scene: Scene, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for constant, value in (("POINTS", 50), ("ENTRIES", 4096)):
        monkeypatch.setattr(relighting, constant, value)
    monkeypatch.setattr("lambent.baking.artefacts.transport.ENTRIES", 4096)
    views, found, starts = [View(CAMERA, *SIZE)], None, 0
    while found is None:
        starts += 1
        blocks = iter((True, True, False))

        def stop(done: float, total: float, what: str, blocks: object = blocks) -> None:
            if "triangles" in what and not next(blocks, True):  # type: ignore[call-overload]
                raise Cancelled

        try:
            found = bake(scene, folder / "i", quality=HOW, only={"relighting"}, views=views, progress=stop)
        except Cancelled:
            assert starts < 5
    assert starts > 1
    whole = bake(scene, folder / "w", quality=HOW, only={"relighting"}, views=views)
    for part in ("spans", "points", "values", "errors", "lamps", "light"):
        name = view_artefact_name(CAMERA, *SIZE, "relighting", part)
        assert np.array_equal(found.read(name), whole.read(name)), part
