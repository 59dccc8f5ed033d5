"""A terrace in inches, exported from Blender and read back: its world, its animated camera, its names."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry.latlong import lat_long_directions
from lambent.core.pictures.images import read_image
from lambent.scenes.camera_paths import camera_at
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import ImageEnvironment

INCH = 0.0254
UPRIGHT = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
WIDTH, HEIGHT, COLUMN, ROW, TURN_DEG, STRENGTH, FRAMES, FPS = 64, 32, 40, 20, 25.0, 2.0, 49, 24


@pytest.fixture(scope="module")
def terrace(blender, tmp_path_factory):
    folder = tmp_path_factory.mktemp("terrace")
    return blender("terrace", folder), load_scene(folder / "テラス.blend")


def test_imperial_units_and_names_of_other_scripts(terrace):
    truth, scene = terrace
    assert {o.name for o in scene.objects} == {"Boden", "花瓶 [1]*"} and scene.name == "テラス"
    ((low, high),) = truth["boxes"]["花瓶 [1]*"]
    mesh = scene.object("花瓶 [1]*").mesh
    size = mesh.positions.max(axis=0) - mesh.positions.min(axis=0)
    assert size == pytest.approx(np.abs(UPRIGHT @ np.subtract(high, low)) * INCH, abs=2e-4)
    assert {"石", "釉薬"} <= set(scene.materials)


def test_an_object_gets_the_light_field_that_its_property_asks_for(terrace):
    assert set(terrace[1].light_fields) == {"花瓶 [1]*"}


def test_the_worlds_picture_shines_from_where_blender_has_it(terrace):
    environment = terrace[1].environment
    assert isinstance(environment, ImageEnvironment)
    picture = read_image(environment.file)
    row, column = np.unravel_index(picture.sum(axis=-1).argmax(), picture.shape[:2])
    assert environment.scale * picture[row, column] == pytest.approx(STRENGTH * np.array([5, 4, 3]), rel=1e-3)
    # Lambent's direction of the texel, turned from front (-z) towards the left (-x)
    angle = np.radians(environment.rotation_deg)
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    ours = turn @ lat_long_directions(HEIGHT, WIDTH)[row, column]
    # Blender's: u = 1/2 - atan2(y, x)/2 pi, v = 1/2 + asin(z)/pi of the direction turned by the mapping
    azimuth = (0.5 - (COLUMN + 0.5) / WIDTH) * 2 * np.pi - np.radians(TURN_DEG)
    height = ((ROW + 0.5) / HEIGHT - 0.5) * np.pi
    blenders = [np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height)]
    assert ours == pytest.approx(UPRIGHT @ blenders, abs=1e-5)


def test_an_animated_camera_is_a_path_with_its_times(terrace):
    truth, scene = terrace
    (path,) = scene.paths
    assert path.name == "Spaziergang" and path.seconds == pytest.approx((FRAMES - 1) / FPS)
    for frame, (at, ahead) in truth["frames"].items():
        camera = camera_at(path, (int(frame) - 1) / FPS)
        assert camera.position == pytest.approx(UPRIGHT @ at * INCH, abs=1e-4)
        assert np.subtract(camera.target, camera.position) == pytest.approx(UPRIGHT @ ahead, abs=1e-4)
    assert {c.name for c in scene.cameras} == {"Spaziergang", "fest"}


def test_the_camera_is_that_of_the_open_frame(terrace):
    truth, scene = terrace
    camera = next(c for c in scene.cameras if c.name == "Spaziergang")
    assert camera.position == pytest.approx(UPRIGHT @ truth["frames"]["13"][0] * INCH, abs=1e-5)


@pytest.fixture(scope="module")
def pictures(blender, tmp_path_factory):
    folder = tmp_path_factory.mktemp("pictures")
    return blender("pictures", folder), folder


def test_worlds_are_skies_colours_or_said_to_be_lost(pictures):
    worlds, notes = pictures[0]["worlds"], "\n".join(pictures[0]["notes"])
    assert worlds["grey"] == {"kind": "constant", "radiance": pytest.approx([0.3, 0.6, 0.9])}
    sky = worlds["sky"]
    towards = UPRIGHT @ [np.sin(2) * np.cos(0.5), np.cos(2) * np.cos(0.5), np.sin(0.5)]
    assert sky["kind"] == "sunsky" and sky["sun_direction"] == pytest.approx(towards)
    assert (sky["sky_scale"], sky["sun_scale"]) == (2, 2) and sky["sun_radius_deg"] == pytest.approx(np.degrees(0.01))
    assert not any(worlds[name] for name in ("night", "noise", "tilted", "negative"))
    for said in ("sun is below the horizon", "a Noise Texture is not carried", "turned about z only"):
        assert said in notes


def test_pictures_keep_their_light_in_every_state(pictures):
    """Floats are linear; bytes, on disk or not, are sRGB."""
    found, tmp_path = pictures
    assert found["files"].pop("missing") is None and found["notes"][0] == "world: picture missing is missing: left out"
    assert len(set(found["files"].values())) == 6
    for name, file in found["files"].items():
        value = np.array([0.5, 0.25, 1.0])
        linear = value if name == "floats" else ((value + 0.055) / 1.055) ** 2.4
        assert read_image(tmp_path / file)[..., :3] == pytest.approx(np.broadcast_to(linear, (2, 4, 3)), abs=0.01), name
