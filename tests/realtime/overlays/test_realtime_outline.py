"""The outline of an object, and frames that are drawn over another one: against rays and whole frames."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.core.views.camera import Camera, pixel_rays
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.targets import DISPLAY_FORMAT, target_texture
from lambent.realtime.overlays.outline import REACH_PX
from lambent.realtime.renderer import Renderer
from lambent.store.contract import ObjectRecord, whole_objects
from lambent.store.store import Store
from lambent.viewer.cameras.picking import Geometry
from tests.viewer.small_store import MATERIALS, write_small_store

# The ball stands before the wall and hides a part of it; the second camera has the ball at the picture's edge.
FRONT = Camera(name="front", position=(0, 1.6, 3), target=(0, 1, 0), fov_y_deg=60)
BESIDE = Camera(name="beside", position=(1.1, 1.4, 2.2), target=(1.1, 1.2, 0), fov_y_deg=50)
SIZE = (72, 54)


@pytest.fixture(scope="module")
def renderer(device: Any, tmp_path_factory: pytest.TempPathFactory) -> Renderer:
    return Renderer(device, Store.open(write_small_store(tmp_path_factory.mktemp("outline") / "store")))


def line(renderer: Renderer, state: FrameState, name: str) -> np.ndarray:
    record = next(one for one in renderer.scene.record.objects if one.name == name)
    return line_of(renderer, state, record)


def line_of(renderer: Renderer, state: FrameState, record: ObjectRecord) -> np.ndarray:
    texture = renderer.outline().draw(state, record).texture
    width, height = state.size
    data = renderer.device.queue.read_texture({"texture": texture}, {"bytes_per_row": 4 * width}, (width, height, 1))
    return np.frombuffer(data, np.uint8).reshape(height, width, 4)[..., 3] / 255


def spread(flags: np.ndarray, reach: int) -> np.ndarray:
    """Whether any of the pixels within `reach` is set."""
    padded = np.pad(flags, reach, mode="edge")
    height, width = flags.shape
    shifts = range(2 * reach + 1)
    return np.any([padded[y : y + height, x : x + width] for y in shifts for x in shifts], axis=0)


def check_line(renderer: Renderer, camera: Camera, record: ObjectRecord, names: set[str]) -> None:
    """The line of a record is the border of what rays see of the objects with these names."""
    baked = renderer.scene
    geometry = Geometry(baked.positions, baked.faces, baked.record.objects)
    rays = pixel_rays(camera, *SIZE)
    found = [[geometry.pick(camera.position, ray) for ray in row] for row in rays]
    seen = np.array([[item is not None and item.name in names for item in row] for row in found])
    others = np.pad(~seen, 1, mode="edge")
    border = seen & (others[2:, 1:-1] | others[:-2, 1:-1] | others[1:-1, 2:] | others[1:-1, :-2])
    alpha = line_of(renderer, FrameState(camera, *SIZE), record)
    assert border.any()
    assert (alpha[border] > 0.3).mean() > 0.97
    assert (alpha[~spread(border, REACH_PX)] == 0).all()


@pytest.mark.long
@pytest.mark.parametrize(("camera", "name"), [(FRONT, "wall"), (BESIDE, "ball")])
def test_the_line_runs_along_the_border_of_what_is_seen(renderer: Renderer, camera: Camera, name: str) -> None:
    check_line(renderer, camera, next(o for o in renderer.scene.record.objects if o.name == name), {name})


def test_an_object_in_parts_has_one_line(renderer: Renderer) -> None:
    floor, wall, ball = renderer.scene.record.objects
    room, other = whole_objects([*(o.model_copy(update={"part_of": "room"}) for o in (floor, wall)), ball])
    assert (room.name, room.first_face, room.face_count) == ("room", 0, floor.face_count + wall.face_count)
    assert other == ball and np.allclose(room.bounds, renderer.scene.record.bounds)
    check_line(renderer, FRONT, room, {"floor", "wall"})
    apart = wall.model_copy(update={"part_of": "room", "first_face": wall.first_face + 1})
    assert len(whole_objects([floor.model_copy(update={"part_of": "room"}), apart])) == 2, "others are between them"


def shown(renderer: Renderer, *states: FrameState) -> np.ndarray:
    """The display image of the last of frames that are drawn one after another."""
    for state in states:
        texture = target_texture(renderer.device, (*state.size, 1), DISPLAY_FORMAT)
        renderer.draw(state, texture.create_view())
    width, height = states[-1].size
    data = renderer.device.queue.read_texture({"texture": texture}, {"bytes_per_row": 4 * width}, (width, height, 1))
    return np.frombuffer(data, np.uint8).reshape(height, width, 4)[..., :3].astype(int)


RED = {"brass": MATERIALS["brass"].model_copy(update={"kd": (0.5, 0.0, 0.0)})}


def test_a_frame_over_another_is_the_whole_frame(renderer: Renderer) -> None:
    before = FrameState(FRONT, *SIZE)
    over = replace(before, over=True, materials=RED)
    drawn = shown(renderer, before, over)
    assert renderer.statistics["draw_calls"] < 5
    assert np.array_equal(drawn, shown(renderer, replace(over, over=False)))
    assert not np.array_equal(drawn, shown(renderer, before))


def test_where_more_has_changed_the_frame_is_whole(renderer: Renderer) -> None:
    before = FrameState(FRONT, *SIZE)
    for change in ({"camera": BESIDE}, {"exposure_ev": 1.0}, {"n": 3}, {"show": "diffuse"}):
        after = replace(before, over=True, materials=RED, **change)
        drawn = shown(renderer, before, after)
        assert renderer.redrawn(replace(before, **change)) == {"brass"}  # the frame just drawn is what counts
        assert np.array_equal(drawn, shown(renderer, replace(after, over=False)))
