"""Backs of opaque objects: a shelf seen from below and a crate turned inside out have light on what is seen."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.engine import engine
from lambent.baking.surfaces.backs import backs_of
from lambent.baking.surfaces.texels import texels_of
from lambent.baking.surfaces.visible_triangles import TriangleVisibility
from lambent.core.views.camera import Camera
from lambent.scenes.geometry import box, patch, placed
from lambent.scenes.scene import ConstantEnvironment, Scene, SceneObject
from lambent.store.store import Store
from tests.baking.small_scenes import BLACK, TINY, turned_inwards

EVEN = ConstantEnvironment((1.0, 1.0, 1.0))
LIGHT = TINY.changed("backs", light_map={"samples": (64, 64)})


def scene() -> Scene:
    """A shelf 1 m above a black floor of 2 m, seen from below and from above, and a crate turned inside out.

    Irradiance is pi times the share of an even sky that is open.
    """
    shelf = patch((-0.3, 1.0, 0.3), (0.6, 0, 0), (0, 0, -0.6))
    floor = patch((-1, 0, 1), (2, 0, 0), (0, 0, -2))
    crate = turned_inwards(placed(box((0.4, 0.4, 0.4)), (0.0, 2.0, 0.0)))
    objects = (SceneObject(n, m, "black") for n, m in (("shelf", shelf), ("floor", floor), ("crate", crate)))
    low, high = ((1.5, y, 1.5) for y in (0.5, 1.6))
    cameras = (Camera("low", low, (0, 1, 0), fov_y_deg=60), Camera("high", high, (0, 1, 0), fov_y_deg=60))
    return Scene("backs", tuple(objects), {"black": BLACK}, environment=EVEN, cameras=cameras)


def light_of(store: Store, name: str, side: str) -> np.ndarray:
    """Irradiance (n,) of the texels of an object."""
    geometry = {part: store.read(f"geometry/{part}") for part in ("positions", "normals", "uv2", "faces")}
    image = store.read(f"light_map/{side}").astype(float)
    texels = texels_of(geometry, *image.shape[1::-1])
    record = next(o for o in store.documents["scene"]["objects"] if o["name"] == name)
    first = record["first_face"]
    mine = (texels.face[:, 0] >= first) & (texels.face[:, 0] < first + record["face_count"])
    return np.asarray(image.reshape(-1, 3)[texels.index[mine], 1])


@pytest.mark.long
def test_backs_that_are_seen_have_their_own_light(tmp_path: Path) -> None:
    store = bake(scene(), tmp_path / "s", quality=LIGHT, only=("light_map",))
    assert backs_of(store) == {"shelf", "crate"}, "of the floor nobody sees the back"
    below = light_of(store, "shelf", "irradiance_back").mean() / np.pi
    # the floor, a parallel square of 2 m at 1 m, has a form factor of .554 from the middle (Howell, B-3); less aside
    assert below == pytest.approx(0.455, abs=0.03)
    assert light_of(store, "shelf", "irradiance").mean() / np.pi > 0.85, "the crate alone hides sky above"
    crate = light_of(store, "crate", "irradiance_back").mean() / np.pi
    assert crate == pytest.approx(0.93, abs=0.06), "the outside, which is the back"
    assert light_of(store, "crate", "irradiance").max() < 0.05, "inside no light gets"


def test_without_viewers_and_for_closed_objects_there_are_no_backs(tmp_path: Path) -> None:
    alone = replace(scene(), cameras=())
    store = bake(alone, tmp_path / "a", quality=LIGHT, only=("geometry",))
    assert not backs_of(store)
    block = SceneObject("block", placed(box((0.4, 0.4, 0.4)), (0, 2, 0)), "black")
    store = bake(replace(scene(), objects=(block,)), tmp_path / "b", quality=LIGHT, only=("geometry",))
    assert not backs_of(store)


def test_the_back_of_a_strip_that_fills_little_of_the_view_is_lit(tmp_path: Path) -> None:
    """The inner side of a window's frame, which few rays meet, stands out black beside the window."""
    strip = SceneObject("strip", patch((-0.015, 1.0, 0.5), (0.03, 0, 0), (0, 0, -0.03)), "black")
    few = replace(scene(), objects=(*scene().objects, strip), cameras=scene().cameras[:1])
    engine()
    from lambent.baking.tracing.seen.viewed import seen_from_behind

    assert seen_from_behind(TriangleVisibility(few), 2e-4) == ["crate", "shelf"]
    assert backs_of(bake(few, tmp_path / "s", quality=LIGHT, only=("geometry",))) == {"crate", "shelf", "strip"}


@pytest.mark.long
def test_backs_stay_as_found_when_a_camera_comes_later(tmp_path: Path) -> None:
    alone = replace(scene(), cameras=())
    store = bake(alone, tmp_path / "s", quality=LIGHT, only=("light_map",))
    before = {a.name: a.key for a in store.artefacts()}
    store.close()
    store = bake(scene(), tmp_path / "s", quality=LIGHT, only=("light_map",))
    assert before == {a.name: a.key for a in store.artefacts()}
    store.close()
    store = bake(scene(), tmp_path / "s", quality=LIGHT, only=("geometry",), resume=False)
    assert backs_of(store) == {"shelf", "crate"}
