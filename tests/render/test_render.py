"""Stills, films and sequences from Python: what is written, what a note says, what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.light.colour import srgb_encode
from lambent.core.light.exposure import KEY, ev100_of
from lambent.core.light.false_colour import fitting_range
from lambent.core.light.photometry import photometric
from lambent.core.pictures.images import read_encoded, read_image, to_bytes
from lambent.core.views.camera import CameraPath
from lambent.editing.interreflection.whole import whole_picture
from lambent.editing.session.session import Session
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import open_device
from lambent.realtime.renderer import Renderer
from lambent.render import Settings, film, images, still
from lambent.render.edited import edited_still
from lambent.store.contract import SceneRecord, scene_record, write_scene_record
from lambent.store.store import Store
from tests.editing.written_view import SIZE
from tests.viewer.edited_view import CAMERA, TRAY, WALL, write_light
from tests.viewer.small_store import FRONT, SIDE, write_small_store

pytestmark = pytest.mark.usefixtures("adapter")
SMALL = Settings(48, 32, integrator="lamps")


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_small_store(tmp_path_factory.mktemp("render") / "small.store")


@pytest.mark.long
def test_a_camera_by_name_by_itself_or_the_first(store: Path, tmp_path: Path) -> None:
    stills = {name: tmp_path / f"{name}.exr" for name in ("first", "front", "side", "itself")}
    still(store, stills["first"], settings=SMALL)
    still(str(store), str(stills["front"]), "front", SMALL)
    still(Store.open(store), stills["side"], "side", SMALL)
    done = still(store, stills["itself"], replace(SIDE, name="unknown to the scene"), SMALL)
    assert (done.file, done.width, done.height, done.frames) == (stills["itself"], 48, 32, 1) and done.seconds > 0
    found = {name: read_image(file) for name, file in stills.items()}
    np.testing.assert_array_equal(found["first"], found["front"])
    np.testing.assert_array_equal(found["side"], found["itself"])
    assert not np.array_equal(found["front"], found["side"])


def test_a_film_along_any_path(store: Path, tmp_path: Path) -> None:
    steps: list[float] = []
    path = CameraPath("mine", (FRONT, SIDE), 2.0)
    done = film(
        store, tmp_path / "a-#.png", path, SMALL, fps=2, progress=lambda done, total, what: steps.append(done / total)
    )
    assert done.frames == path.frames(2) == 4 and steps == [0.0, 0.25, 0.5, 0.75, 1.0]
    moving = images(Store.open(store), SMALL, moving=True)
    first = read_encoded(tmp_path / "a-1.png")
    np.testing.assert_array_equal(to_bytes(first), moving.displayed(replace(FRONT, name="mine")))
    with pytest.raises(UserError, match=r"expected \.mp4, \.png, \.exr"):
        film(store, tmp_path / "a.hdr", path, SMALL)


@pytest.mark.long
def test_a_fitted_scale_is_kept(store: Path) -> None:
    """The second camera of a film sees another range of luminances: its colours have to mean the same."""
    opened, settings = Store.open(store), Settings(96, 64, view="false-colour")
    drawn = images(opened, settings)
    scales = [fitting_range(photometric(drawn.radiance(camera), drawn.quantity)) for camera in (FRONT, SIDE)]
    assert scales[0] != scales[1]
    drawn.displayed(FRONT)
    kept = drawn.displayed(SIDE)
    for scale, same in zip(scales, (True, False), strict=True):
        own = images(opened, replace(settings, scale=scale)).displayed(SIDE)
        assert np.array_equal(kept, own) is same


def test_notes_say_what_is_wrong_with_a_store(tmp_path: Path) -> None:
    opened, notes = Store.open(write_small_store(tmp_path / "s")), []
    irradiance = np.full((4, 4, 3), np.nan, np.float16)
    opened.put("light_map/irradiance", "light_map", irradiance, key="damaged")
    images(opened, SMALL, note=notes.append)
    assert notes == ["light_map/irradiance: 48 values are negative or not finite and were set to 0"]


@pytest.mark.slow
def test_the_path_tracer_sees_the_scene_that_was_baked(mi, tmp_path: Path) -> None:
    from lambent.baking.bake import bake
    from lambent.scenes.loaders.load import load_scene
    from lambent.store.source import SOURCE

    made = bake(load_scene("builtin:box"), tmp_path / "box", only=("geometry",))
    made.set_document(SOURCE, "builtin:box")
    settings, notes = Settings(24, 16, "path", samples=4), []
    image = images(made, settings, note=notes.append).radiance(load_scene("builtin:box").cameras[0])
    assert image.shape == (16, 24, 3) and image.mean() > 0 and notes == []
    with pytest.raises(UserError, match="shows all light"):
        images(made, replace(settings, show="diffuse"))


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"view": "filmc"}, "did you mean 'filmic'"),
        ({"exposure_ev": float("nan")}, "-64 to 64"),
        ({"integrator": "ring"}, "did you mean 'rings'"),
        ({"planar": "thesis"}, "way for planar reflectors"),
    ],
)
def test_nonsense(store: Path, change: dict, word: str) -> None:
    with pytest.raises(UserError, match=word):
        images(Store.open(store), replace(SMALL, **change))


@pytest.mark.long
def test_exposure_in_stops_is_the_scenes_unless_told(tmp_path: Path) -> None:
    """Linear light, encoded: one stop doubles it. Without an exposure that of the scene counts."""
    opened = Store.open(write_small_store(tmp_path / "s"))
    record = scene_record(opened)
    write_scene_record(opened, record.model_copy(update={"exposure_ev": -2.0}))
    settings = replace(SMALL, view="linear", integrator="qmc", samples=2)
    for told, stops in ((None, -2.0), (0.0, 0.0), (1.0, 1.0)):
        drawn = images(opened, replace(settings, exposure_ev=told))
        light = np.clip(2.0**stops * drawn.radiance(FRONT).astype(float), 0, 1)
        shown = drawn.displayed(FRONT).astype(int)
        assert np.abs(shown - to_bytes(srgb_encode(light))).max() <= 1
    single = images(opened, replace(SMALL, view="linear", exposure_ev=1.0), moving=True).displayed(FRONT)
    light = images(opened, replace(SMALL, view="linear", exposure_ev=0.0), moving=True).displayed(FRONT)
    assert single.astype(int).sum() > 1.2 * light.astype(int).sum()


def test_so_many_samples_are_taken(store: Path) -> None:
    opened = Store.open(store)
    renderer = Renderer(open_device(), opened)
    frame = FrameState(FRONT, 48, 32, integrator="qmc", exposure_ev=0.0, view_transform="filmic")
    for samples in (1, 8):
        drawn = images(opened, replace(SMALL, integrator="qmc", samples=samples, exposure_ev=0.0))
        np.testing.assert_array_equal(drawn.radiance(FRONT), renderer.converged(frame, samples))


@pytest.mark.long
def test_a_film_shows_single_frames_and_a_still_the_mean_of_many(store: Path) -> None:
    opened = Store.open(store)
    renderer = Renderer(open_device(), opened)
    frame = FrameState(FRONT, 48, 32, view_transform="filmic")
    settings = replace(SMALL, exposure_ev=0.0)
    moving, still_ = (images(opened, settings, moving=m).displayed(FRONT) for m in (True, False))
    np.testing.assert_array_equal(moving, renderer.display_image(replace(frame, covers=True)))
    np.testing.assert_array_equal(still_, renderer.still(frame))


def test_films_have_even_sizes_of_their_own(store: Path, tmp_path: Path) -> None:
    path = CameraPath("mine", (FRONT, SIDE), 1.0)
    done = film(store, tmp_path / "a.mp4", path, replace(SMALL, width=51, height=33), fps=2)
    assert (done.width, done.height) == (50, 32)


@pytest.mark.long
def test_a_scene_without_an_exposure_is_metered(tmp_path: Path) -> None:
    """Its middle is middle grey in every way of drawing, whatever its light; a film keeps the exposure of its start."""
    opened = Store.open(write_small_store(tmp_path / "s"))
    record = scene_record(opened)
    write_scene_record(opened, record.model_copy(update={"exposure_ev": None}))
    exposures = []
    for factor in (1.0, 64.0):
        for name in ("light_map/irradiance", "environment/radiance", "probe/ball/radiance"):
            meta = opened.artefact(name).meta
            opened.put(name, name.split("/")[0], opened.read(name) * np.float16(factor), key=f"{factor}", meta=meta)
        done = still(opened, tmp_path / f"{factor}.png", FRONT, replace(SMALL, view="linear"))
        shown = photometric(images(opened, replace(SMALL, view="linear")).radiance(FRONT)) / 179
        assert done.exposure_ev is not None and done.ev100 == pytest.approx(ev100_of(done.exposure_ev))
        assert np.exp(np.log(shown[shown > 0]).mean()) * 2**done.exposure_ev == pytest.approx(KEY, rel=0.25)
        exposures.append(done.exposure_ev)
        slow = images(opened, replace(SMALL, integrator="qmc", samples=8))
        slow.displayed(FRONT)
        assert slow.exposure_ev == pytest.approx(done.exposure_ev, abs=0.1)
    assert exposures[0] - exposures[1] == pytest.approx(6, abs=0.05)
    moving = images(opened, SMALL, moving=True)
    moving.displayed(FRONT)
    before = moving.exposure_ev
    moving.displayed(SIDE)
    assert moving.exposure_ev == before
    assert still(opened, tmp_path / "a.exr", FRONT, SMALL).exposure_ev is None
    measured = still(opened, tmp_path / "a.png", FRONT, replace(SMALL, show="light-map", view="false-colour"))
    assert measured.exposure_ev is None and measured.scale is not None and measured.scale["unit"] == "lx"
    assert measured.scale["low"] < 128 * 179 <= measured.scale["high"]


@pytest.mark.parametrize(
    ("level", "said"), [(1e-6, "hardly any light reaches this view"), (0.0, "no light"), (0.1, "")]
)
def test_a_view_without_light_is_said(store: Path, level: float, said: str, caplog: pytest.LogCaptureFixture) -> None:
    drawn = images(Store.open(store), SMALL)
    drawn.exposure_ev = None
    drawn.exposed(np.full((8, 8, 3), level))
    assert said in caplog.text and bool(said) == bool(caplog.text)


def test_an_edited_view_is_drawn_as_its_session_says(tmp_path: Path) -> None:
    session = Session.new("small room", CAMERA, {"tray": TRAY, "wall": WALL}, size=SIZE)
    write_light(tmp_path / "s", session, 20)
    materials, bounds = {"tray": TRAY, "wall": WALL}, ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))
    record = SceneRecord(name="small room", objects=(), materials=materials, cameras=(CAMERA,), bounds=bounds)
    with Store.open(tmp_path / "s") as store:
        write_scene_record(store, record)
    session.change("wall", WALL.model_copy(update={"kd": (0.25, 0.1, 0.25)}))
    session.save(tmp_path / "s.edits.json")
    done = edited_still(tmp_path / "s", tmp_path / "s.edits.json", tmp_path / "a.exr", replace(SMALL, exposure_ev=0.0))
    picture = whole_picture(Store.open(tmp_path / "s"), session)
    np.testing.assert_allclose(read_image(done.file), np.maximum(picture.image(), 0), rtol=2e-3)
    assert (done.width, done.height) == SIZE
