"""`lambent render --session` draws what the window showed: its renderer and its tracing, in the same state."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.cli.main import run
from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.light.light_mix import GroupMix, LightMix
from lambent.core.pictures.images import read_image, write_shown
from lambent.core.views.camera import Camera
from lambent.realtime.frame_state import FrameState
from lambent.render import Settings, as_left, images, still
from lambent.scenes.lamp_edits import LampEdit
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import ImageTexture
from lambent.store.kept.images import kept_image
from lambent.store.kept.session import FILE, KeptLook, KeptView, RoomState, WalkSession, read_session, write_session
from lambent.store.kept.states import variants_of
from lambent.store.store import Store
from lambent.traced.picture import TracedPicture
from lambent.viewer.modes.walk.at_rest.traced import _wish_of
from lambent.viewer.modes.walk.at_rest.tracing_worker import Rooms
from lambent.viewer.modes.walk.mode import WalkMode, open_store
from lambent.viewer.screen import Rect, Screen
from tests.baking.small_scenes import TINY
from tests.viewer.conftest import Clock
from tests.viewer.drawn_frames import drawn

SIZE = (48, 32)
SCENE = """
format = "lambent-scene"
version = 1
name = "left"
geometry = "builtin:box"
exposure_ev = 0.0
materials.white.kd = 0.7
materials.red.kd = [0.6, 0.05, 0.05]
materials.green.kd = [0.1, 0.45, 0.1]
materials.black.kd = 0.0
materials.metal = { kd = 0.3, lobes = [{ mx = 0.15, my = 0.15, r0 = 0.3 }] }

[[lights]]
name = "spot"
kind = "spot"
position = [0.0, 0.9, 0.2]
intensity = [2.0, 2.0, 1.5]
direction = [0.0, -1.0, 0.0]
outer_deg = 50.0
"""
KINDS = {"geometry", "environment", "light_map", "probe", "answer", "lamps"}
THERE = Camera("there", (0.1, 0.5, 2.2), (0.0, 0.4, 0.0), fov_y_deg=45.0)


@pytest.fixture(scope="module")
def store(mi: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("left")
    (folder / "scene.toml").write_text(SCENE)
    scene = load_scene(folder / "scene.toml")
    bake(scene, folder / "s", quality=TINY, only=KINDS, light_groups="scene").close()
    return folder / "s"


@pytest.fixture
def window(adapter: None, store: Path, tmp_path: Path) -> Iterator[WalkMode]:
    """A window's mode after edits of every kind."""
    (store / FILE).unlink(missing_ok=True)
    write_shown(tmp_path / "bricks.png", np.array([[[200, 40, 0], [90, 90, 90]]] * 2, np.uint8))
    mode = open_store(store, "walk", Screen(tmp_path, Clock(), Rect(0, 0, *SIZE)))
    state = mode.state
    state.navigation.camera = THERE
    state.look.exposure_ev, state.look.view_transform, state.look.integrator, state.look.n = 1.5, "neutral", "rings", 7
    state.screen.pace.traces = state.screen.pace.adaptive = state.rebaking.on = False
    edits = state.materials.edits
    edits.change("red", edits.scene["red"].model_copy(update={"kd": (0.05, 0.1, 0.6)}))
    edits.show_texture("white", ImageTexture(kept_image(store, tmp_path / "bricks.png"), 3.0))
    edits.mix(LightMix({group.name: GroupMix(intensity=0.5) for group in state.lights.groups[:1]}))
    edits.edit_lamp(0, LampEdit((0.3, 0.8, 0.3)))
    edits.end_stroke()
    yield mode
    mode.drawing.close()
    mode.state.session.close()


def settled(mode: WalkMode) -> FrameState:
    """The window's frame, once its light has followed the edits."""
    pictures = mode.drawing
    drawn(pictures, mode.state, SIZE)
    while pictures._lane.busy:
        drawn(pictures, mode.state, SIZE)
    found: FrameState = pictures._frame(SIZE)
    return found


def left(mode: WalkMode, store: Path, **changes: Any) -> tuple[Settings, Camera | None]:
    """The window is lost after its last write; what is drawn then."""
    assert mode.state.session.save()
    return as_left(store, Settings(**changes))


@pytest.mark.long
def test_a_drawn_picture_is_the_windows_to_the_bit(window: WalkMode, store: Path, tmp_path: Path) -> None:
    frame = settled(window)
    shown: Floats = window.drawing._renderer.still_radiance(frame)
    displayed = window.drawing._renderer.still(frame)
    settings, camera = left(window, store)
    assert (settings.width, settings.height) == SIZE and settings.integrator == "rings" and camera == THERE
    found = images(Store.open(store), settings)
    assert np.array_equal(found.radiance(THERE), shown) and np.array_equal(found.displayed(THERE), displayed)
    still(store, tmp_path / "left.exr", camera, settings)
    assert np.abs(read_image(tmp_path / "left.exr") - shown).max() <= 1e-3 * shown.max(), "in half floats"
    baked = images(Store.open(store), replace(settings, variant="", light=None)).radiance(THERE)
    assert np.abs(baked - shown).mean() > 0.1 * shown.mean(), "the edits are seen"


@pytest.mark.long
@pytest.mark.parametrize("part", ["lamps", "textures", "materials", "light"])
def test_every_kind_of_edit_counts(window: WalkMode, store: Path, part: str) -> None:
    settings, _ = left(window, store)
    whole = images(Store.open(store), settings).radiance(THERE)
    session = read_session(store / FILE)
    assert session is not None
    without = session.now.model_copy(update={part: LightMix() if part == "light" else {}})
    write_session(store / FILE, session.model_copy(update={"now": without}))
    other = images(Store.open(store), as_left(store, Settings())[0]).radiance(THERE)
    assert np.abs(other - whole).max() > 0.01 * whole.max()


@pytest.mark.long
def test_a_traced_picture_is_that_of_the_window_at_rest(window: WalkMode, store: Path) -> None:
    window.state.screen.pace.traces = True
    frame, pictures = settled(window), window.drawing
    wish = replace(_wish_of(frame, pictures._appearance), kinds=("traced",))
    picture = TracedPicture(Rooms(store, 0.0, ()).of("traced", wish).tracer, wish.camera, SIZE)
    settings, camera = left(window, store, samples=4, denoise=False)
    assert settings.integrator == "traced" and settings.samples is None and camera is not None
    found = images(Store.open(store), replace(settings, samples=4)).radiance(camera)
    while picture.samples < 4:
        picture.sample(4 - picture.samples)
    assert np.array_equal(found, picture.mean())


@pytest.mark.long
def test_light_that_does_not_follow_stays(window: WalkMode, store: Path) -> None:
    window.state.answering.on = False
    frame = settled(window)
    shown = window.drawing._renderer.still_radiance(frame)
    settings, _ = left(window, store)
    assert np.array_equal(images(Store.open(store), settings).radiance(THERE), shown)


def session_of(store: Path, **changes: Any) -> None:
    look = KeptLook(exposure_ev=1.0, integrator="rings")
    view = KeptView(camera=THERE, size=(24, 16), traces=False, look=look)
    write_session(store / FILE, WalkSession(view=view).model_copy(update=changes))


@pytest.mark.long
@pytest.mark.parametrize("integrator", ["rings", "traced"])
def test_states_show_their_lamps_also_one_after_the_other(adapter: None, store: Path, integrator: str) -> None:
    moved = RoomState(lamps={0: LampEdit((0.3, 0.8, 0.3))})
    session_of(store, states={"moved": moved, "plain": RoomState()})
    how: dict[str, Any] = {"samples": 2, "denoise": False} if integrator == "traced" else {}
    settings, opened = Settings(*SIZE, integrator=integrator, exposure_ev=0.0, **how), Store.open(store)
    alone = [images(opened, replace(settings, variant=name)).radiance(THERE) for name in ("moved", "plain")]
    drawn_in_turn, named = images(opened, settings), {one.name: one for one in variants_of(opened)}
    for name, expected in zip(("moved", "plain"), alone, strict=True):
        drawn_in_turn.apply_variant(named[name])
        assert np.array_equal(drawn_in_turn.radiance(THERE), expected)
    assert np.abs(alone[0] - alone[1]).max() > 0.01 * alone[1].max()


@pytest.mark.long
def test_options_that_are_given_apply(
    adapter: None, store: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    session_of(store)
    assert run(["render", str(store), "--session", "-o", str(tmp_path / "a.exr")]) == 0
    said = capsys.readouterr().out
    assert "24x16" in said and "rings" in said
    words = ("--size", "12x8", "--integrator", "lamps", "--exposure", "2", "--recolour", "red=#0000ff")
    assert run(["render", str(store), "--session", *words, "-o", str(tmp_path / "b.png")]) == 0
    said = capsys.readouterr().out
    assert "12x8" in said and "lamps" in said


def test_a_session_without_a_view_shows_its_room(adapter: None, store: Path, tmp_path: Path) -> None:
    session_of(store, view=None, now=RoomState(lamps={0: LampEdit((0.3, 0.8, 0.3))}))
    settings, camera = as_left(store, Settings(24, 16, "rings"))
    assert camera is None and settings.variant == "saved" and settings.integrator == "rings"
    assert settings.width == 24


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (None, "there is no session"),
        ("{", "session.json"),
        ({"now": {"materials": {"chrome": {"kd": 0.2}}, "textures": {"jade": ""}}}, "names; found chrome, jade"),
        ({"now": {"materials": {}, "light": {"groups": {"moon": {"on": False}}}}}, "found moon"),
        ({"view": {"look": {"integrator": "photons"}}}, "the session's integrator is not known here: photons"),
    ],
)
def test_what_cannot_be_drawn_is_one_line(store: Path, tmp_path: Path, change: object, words: str) -> None:
    session_of(store)
    said = json.loads((store / FILE).read_text())
    (store / FILE).unlink()
    if isinstance(change, dict):
        changed = {**said, **change, "view": {**said["view"], **change.get("view", {})}}
        (store / FILE).write_text(json.dumps(changed))
    elif change is not None:
        (store / FILE).write_text(str(change))
    with pytest.raises(UserError) as raised:
        as_left(store, Settings())
    assert words in str(raised.value) and "\n" not in str(raised.value)


@pytest.mark.parametrize(
    "words", [("--variant", "saved"), ("--variants",), ("--scene", "x.toml"), ("--edit", "x.json")]
)
def test_what_says_the_room_as_well_is_refused(
    store: Path, tmp_path: Path, words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    session_of(store)
    assert run(["render", str(store), "--session", *words, "-o", str(tmp_path / "a.png")]) == 2
    said = capsys.readouterr().err
    assert f"excludes {'--edit' if words[0] == '--edit' else '--session'}" in said
