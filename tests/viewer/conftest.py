"""A recorded scene for tests that need no store."""

import pytest

from lambent.core.camera import Camera, CameraPath
from lambent.materials.document import Lobe, Material
from lambent.store.contract import ObjectRecord, SceneRecord
from lambent.viewer.state import Choices


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


@pytest.fixture
def choices():
    return Choices(
        integrators=("rings", "qmc"),
        view_transforms=("filmic", "linear"),
        shows=("full", "diffuse", "specular"),
        lookups=("planes", "plain"),
        sample_counts=(1, 3, 5, 7),
    )
