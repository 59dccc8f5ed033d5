"""A recorded scene, the state of the walk mode on it, and a virtual screen for windows."""

import numpy as np
import pytest

from lambent.core.views.camera import Camera, CameraPath
from lambent.materials.document import Lobe, Material
from lambent.store.contract import ObjectRecord, SceneRecord
from lambent.viewer.cameras.picking import Geometry
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.screen import Rect, Screen
from tests.viewer.window_session import VirtualScreen, WindowSession, missing_tools


@pytest.fixture
def scene():
    plaster = Material(name="plaster", kd=0.6)
    brass = Material(name="brass", kd=0.05, lobes=(Lobe(k=(0.9, 0.7, 0.3), mx=0.1, my=0.3, r0=(0.9, 0.7, 0.4)),))
    front = Camera(name="front", position=(0, 1.6, 3), target=(0, 1, 0))
    side = Camera(name="side", position=(3, 1.6, 0), target=(0, 1, 0))
    room = ((-4.0, 0.0, -4.0), (4.0, 2.6, 4.0))
    return SceneRecord(
        name="test room",
        objects=(
            ObjectRecord(name="floor", material="plaster", first_face=0, face_count=2, bounds=((-4, 0, -4), (4, 0, 4))),
            ObjectRecord(name="table", material="brass", first_face=2, face_count=2, bounds=((-1, 1, -1), (1, 1, 1))),
        ),
        materials={"plaster": plaster, "brass": brass},
        cameras=(front, side),
        paths=(CameraPath(name="tour", keys=(front, side), seconds=4),),
        exposure_ev=1.5,
        bounds=room,
    )


class Clock:
    """Time stands still until a test moves `now_s`."""

    now_s = 0.0

    def __call__(self):
        return self.now_s


@pytest.fixture
def screen(tmp_path):
    """In the size that shows every number."""
    shown = Screen(tmp_path, Clock(), Rect(0, 0, 400, 300))
    shown.remembered.set(size="measure", card_seen=True)
    return shown


@pytest.fixture
def state(scene, screen):
    """The walk mode on a scene whose store is the folder of the screen."""
    return WalkState.of(scene, "walk", screen, screen.folder)


@pytest.fixture
def geometry(scene):
    """The floor at 0 and the table top at 1 m of the scene."""

    def square(half, y):
        return [(-half, y, -half), (-half, y, half), (half, y, half), (half, y, -half)]

    positions = np.array(square(4, 0.0) + square(1, 1.0), np.float32)
    faces = np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)], np.uint32)
    return Geometry(positions, faces, scene.objects)


@pytest.fixture(scope="session")
def virtual_screen(adapter):
    if missing_tools():
        pytest.skip(f"not installed: {', '.join(missing_tools())}")
    screen = VirtualScreen()
    yield screen
    screen.close()


@pytest.fixture
def open_window(virtual_screen):
    """Opens windows that end with the test."""
    sessions = []

    def start(*args):
        sessions.append(WindowSession(virtual_screen, *args))
        return sessions[-1]

    yield start
    for session in sessions:
        session.kill()
