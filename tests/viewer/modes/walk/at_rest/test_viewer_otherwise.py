"""The walk under a turned sky, and with a mesh in an object's place: the picture at rest shows what is drawn."""

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.core.pictures.images import write_image
from lambent.core.views.camera import Camera
from lambent.scenes.loaders.load import load_scene
from lambent.viewer.modes.walk.mode import open_store
from tests.baking.small_scenes import TINY
from tests.viewer.drawn_frames import drawn, until

SIZE = (48, 32)
QUALITY = TINY.changed("otherwise", light_field={"points": 32, "texels": 14, "strata": 1})
SCENE = """
format = "lambent-scene"
version = 1
name = "otherwise"
geometry = "builtin:box"
exposure_ev = 0.0
materials.white.kd = 0.7
materials.red.kd = [0.6, 0.05, 0.05]
materials.green.kd = [0.1, 0.45, 0.1]
materials.black.kd = 0.0
materials.metal = { kd = 0.3, lobes = [{ mx = 0.15, my = 0.15, r0 = 0.3 }] }
objects.sphere.light_field = { volume = true }
environment = { kind = "image", file = "sky.exr" }
"""
TALL = """
v 0 0 0
v 1 0 0
v 1 4 0
v 0 4 0
f 1 2 3 4
"""
OUTWARDS = Camera("outwards", (0.0, 0.5, 0.3), (0.0, 0.5, 2.0), fov_y_deg=60)


@pytest.fixture(scope="module")
def folder(mi, tmp_path_factory):
    """A store beside its scene, under a sky that is bright towards +z, where the box is open."""
    found = tmp_path_factory.mktemp("otherwise")
    sky = np.full((16, 32, 3), 0.1, np.float32)
    sky[:, :8] = sky[:, -8:] = 1.0
    write_image(found / "sky.exr", sky)
    (found / "scene.toml").write_text(SCENE)
    (found / "tall.obj").write_text(TALL)
    kinds = {"geometry", "environment", "light_map", "probe", "light_field"}
    bake(load_scene(found / "scene.toml"), found / "s.store", quality=QUALITY, only=kinds).close()
    return found


@pytest.fixture
def opened(adapter, screen, folder):
    """Opens the store with options; the room in the window, closed after the test."""
    made = []

    def open_with(**options):
        made.append(open_store(folder / "s.store", "walk", screen, **options))
        state, pictures = made[-1].state, made[-1].drawing
        state.look.exposure_ev, state.meter.expose_wanted = 0.0, False
        state.screen.pace.adaptive = False
        return state, pictures

    yield open_with
    for mode in made:
        mode.drawing.close()
        mode.state.session.close()


def both(state, pictures, camera):
    """The drawn picture of a camera, then the traced one in its place."""
    state.navigation.camera = camera
    drawn(pictures, state, SIZE)
    assert pictures.shown == (pictures._a,)
    before = pictures._a.read()
    until(pictures, state, SIZE, lambda: pictures.shown[0].samples >= 16)
    assert not pictures._at_rest.fault
    return before, pictures.shown[0].read()


@pytest.mark.long
def test_a_turned_sky_and_a_mesh_in_place_of_an_object_are_traced(opened, folder):
    """The mesh with its edits, in light as baked."""
    state, pictures = opened()
    inwards = state.navigation.camera
    _, sky = both(state, pictures, OUTWARDS)
    before, sphere = both(state, pictures, inwards)
    state, pictures = opened(sky_turn_deg=180.0, replaced=(f"sphere={folder / 'tall.obj'},red",))
    drawn_sky, turned = both(state, pictures, OUTWARDS)
    with_mesh, traced = both(state, pictures, inwards)
    np.testing.assert_allclose(turned.mean(), drawn_sky.mean(), rtol=0.1)
    assert sky[16].mean() > 4 * turned[16].mean()
    for got, expected in ((sphere, before), (traced, with_mesh)):
        assert np.abs(got - expected).mean() < 0.15 * expected.mean()
    changed = np.abs(traced - sphere).max(axis=-1) > 0.1 * sphere.mean()
    drawn_change = np.abs(with_mesh - before).max(axis=-1) > 0.1 * sphere.mean()
    assert changed.mean() > 0.02 and (changed & drawn_change).sum() > 0.6 * drawn_change.sum()
    red = state.scene.materials["red"]
    state.materials.edits.change("red", red.model_copy(update={"kd": (0.0, 0.0, 0.0)}))
    _, black = both(state, pictures, inwards)
    assert 0.05 < (black < 0.1 * traced)[changed, 0].mean() < 0.6, "the mesh, which is narrower than the sphere"
