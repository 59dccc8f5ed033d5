"""A moved and an exchanged lamp: baked again, read into the picture, and traced at rest."""

from dataclasses import replace

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.running.again import bake_again, rebaked_copy
from lambent.core.views.camera import Camera
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import open_device
from lambent.realtime.light.baked import read_baked
from lambent.realtime.renderer import Renderer
from lambent.scenes.lamp_edits import LampEdit, with_lamp_edits
from lambent.scenes.loaders.load import load_scene
from lambent.store.source import scene_of
from lambent.store.store import Store
from lambent.viewer.modes.walk.at_rest.tracing import Wish
from lambent.viewer.modes.walk.at_rest.tracing_worker import Rooms
from lambent.viewer.modes.walk.rebake.arrivals import Arrived, Region
from lambent.viewer.modes.walk.rebake.rebaked_light import Rebaked
from tests.baking.small_scenes import TINY
from tests.realtime.lamps.test_changed_lamps import IES
from tests.traced.test_traced_pictures import traced

SIZE = 64
CAMERA = Camera("above", (0.4, 2.6, 1.6), (0.0, 0.3, 0.0), fov_y_deg=50.0)
SCENE = """
format = "lambent-scene"
version = 1
name = "two lamps"
geometry = "room.obj"
[materials.grey]
kd = 0.5
[assign]
"*" = "grey"
[[lights]]
name = "spot"
position = [0.8, 2.4, 0.2]
direction = [-0.3, -1, 0]
{first}
[[lights]]
kind = "point"
name = "bulb"
position = [-0.9, 1.8, -0.5]
candela = 60
"""
SPOT = 'kind = "spot"\nouter_deg = 40\ncandela = 300'
DISC = 'kind = "ies"\nfile = "disc.ies"\nlumens = 300'
FACES = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))  # of a box, outwards
MOVED = {0: LampEdit((-0.6, 2.0, 0.7), (0.5, -1.0, -0.6), 20.0)}


def box_obj(name, low, high, first, inwards):
    """Lines of an OBJ with a box whose vertices are numbered from `first`."""
    corners = [[(low, high)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)]
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in corners)
    order = (0, 3, 2, 1) if inwards else (0, 1, 2, 3)
    return vertices + f"o {name}\n" + "".join(f"f {' '.join(str(first + face[k]) for k in order)}\n" for face in FACES)


@pytest.fixture(scope="module", params=[("none", SPOT), ("scene", DISC)], ids=["spot", "opening, by group"])
def stores(request, mi, tmp_path_factory):
    """The store, its copy with edited lamps, and the edits: a move and an exchange."""
    groups, first = request.param
    folder = tmp_path_factory.mktemp("lamps")
    (folder / "wide.ies").write_text(IES)
    (folder / "disc.ies").write_text(IES.replace("2 0 0 0", "2 -0.2 -0.2 0"))
    (folder / "scene.toml").write_text(SCENE.format(first=first))
    room = box_obj("room", (-2, 0, -2), (2, 3, 2), 1, True) + box_obj(
        "block", (-0.2, 0.05, -0.2), (0.2, 0.6, 0.2), 9, False
    )
    (folder / "room.obj").write_text(room)
    store = folder / "room.store"
    bake(load_scene(folder / "scene.toml"), store, quality=TINY, light_groups=groups).close()
    edits = {**MOVED, 1: LampEdit((-0.9, 1.8, -0.5), (0.2, -1.0, 0.0), 0.0, str(folder / "wide.ies"))}
    bake_again(store, rebaked_copy(store), {}, lamps=edits, quality=TINY).close()
    return store, rebaked_copy(store), edits


def image(renderer):
    state = FrameState(CAMERA, SIZE, SIZE, antialias=False, show="diffuse")
    return np.asarray(renderer.still_radiance(state, 1), float)


@pytest.mark.long
def test_light_baked_again_is_drawn_as_a_bake_of_the_edited_scene_is(stores):
    store, copy, edits = stores
    device = open_device()
    renderer, expected = Renderer(device, read_baked(Store.open(store))), image(Renderer(device, Store.open(copy)))
    before = image(renderer)
    renderer.resources.changed_lamps.show(edits)
    names = frozenset(one.name for one in Store.open(copy).artefacts("probe"))
    again = Rebaked.read(copy, renderer.scene, Arrived(None, True, names, True), lamps=True)
    if again.scene.groups is not None:
        renderer.mixer.answer(again.scene.groups)
    else:
        renderer.resources.show_light_map(again.layers({}, renderer.resources.light_layers))
    found = image(renderer)
    assert np.abs(before - expected).mean() > 0.2 * expected.mean()
    off = np.abs(found - expected).max(axis=-1) > 0.02 * expected.mean() + 0.02 * expected.max(axis=-1)
    assert off.mean() < 0.02, "but at edges of shadows"


@pytest.mark.long
def test_regions_wait_for_what_the_map_holds_of_lamps(stores):
    store, copy, _ = stores
    scene = read_baked(Store.open(store))
    size = scene.irradiance.shape[:2]
    groups = 1 if scene.groups is None else len(scene.groups.records)
    region = Region(np.ones((groups, *size, 3), np.float16), np.ones(size, bool))
    part = Rebaked.read(copy, scene, Arrived(region), lamps=True)
    assert not part.lit.any()
    shown = [np.zeros((*size, 4), np.float16)]
    assert part.layers({}, shown)[0] is shown[0]


@pytest.mark.long
@pytest.mark.parametrize("rebaked", [False, True])
def test_the_picture_at_rest_has_the_edited_lamps(stores, rebaked):
    store, _, edits = stores
    rooms = Rooms(store, 0.0, ())
    wish = Wish(1, ("traced",), CAMERA, (SIZE, SIZE), lamps=edits, rebaked=rebaked)
    found = traced(rooms.of("traced", wish), 64, camera=CAMERA).mean()
    assert (rooms._rebaked is not None) == rebaked
    scene = with_lamp_edits(scene_of(Store.open(store)), edits)
    assert scene.lights[0].position == MOVED[0].position
    exact = traced(
        rooms.of("path", replace(wish, kinds=("path",), rebaked=False)), 256, path=True, camera=CAMERA
    ).mean()
    before = traced(rooms.of("traced", replace(wish, lamps={}, rebaked=False)), 64, camera=CAMERA).mean()
    assert np.abs(before - exact).mean() > 0.3 * exact.mean()
    off = np.abs(found - exact).mean() / exact.mean()
    assert off < (0.08 if rebaked else 0.12), "indirect light is estimated before"
