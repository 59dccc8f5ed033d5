"""Arrays that belong to one view are found by what its camera sees, not by its name."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.store.contract import ViewRecord, baked_views, view_artefact_name, view_key, view_meta
from lambent.store.store import Store

CAMERA = Camera("entrance", (0.1, 1.6, 3.0), (0.0, 1.0, 0.0))
SIZE = (64, 48)


def put(store: Store, camera: Camera, part: str = "vectors") -> str:
    name = view_artefact_name(camera, *SIZE, "transport", part)
    store.put(name, "transport", np.ones((2, 2), np.float32), key="k", meta=view_meta(camera, *SIZE))
    return name


def test_a_camera_that_is_renamed_keeps_them_and_one_that_moves_does_not(tmp_path: Path) -> None:
    store = Store.create(tmp_path / "s", {})
    name = put(store, CAMERA)
    assert name == f"view/{view_key(CAMERA, *SIZE)}/transport/vectors"
    assert view_artefact_name(replace(CAMERA, name="door"), *SIZE, "transport", "vectors") in store
    x, y, z = CAMERA.position
    for moved in (
        replace(CAMERA, position=(float(np.nextafter(x, 1)), y, z)),
        replace(CAMERA, target=(0.0, 1.0, 1e-12)),
        replace(CAMERA, up=(0.0, 1.0, 1e-12)),
        replace(CAMERA, fov_y_deg=float(np.nextafter(45, 46))),
    ):
        assert view_artefact_name(moved, *SIZE, "transport", "vectors") not in store, moved
    assert len({view_key(CAMERA, *size) for size in ((64, 48), (48, 64), (6, 448), (0, 0))}) == 4


def test_the_key_is_of_values_and_the_same_everywhere() -> None:
    assert view_key(CAMERA, 64, 48) == "d0e8c330f9501c05"
    whole = Camera("w", (0, 1, 3), (0, -0.0, 0))
    assert view_key(whole) == view_key(Camera("v", (0.0, 1.0, 3.0), (-0.0, 0.0, 0.0)))


def test_the_views_that_a_store_holds_something_for_are_listed(tmp_path: Path) -> None:
    store = Store.create(tmp_path / "s", {})
    store.put("view_of_something_else", "x", np.ones(2), key="k")
    assert baked_views(store) == {}
    other = replace(CAMERA, name="side", fov_y_deg=30.0)
    put(store, CAMERA)
    put(store, CAMERA, "bounce")
    name = view_artefact_name(other, 0, 0, "transport", "vectors")
    store.begin(name, "transport", (2,), (1,), "float32", key="k", meta=view_meta(other))
    store = Store.open(tmp_path / "s")
    assert baked_views(store) == {
        view_key(CAMERA, *SIZE): ViewRecord(camera=CAMERA, width=64, height=48),
        view_key(other): ViewRecord(camera=other),
    }


@pytest.mark.parametrize("meta", [{}, {"view": 3}, {"view": {**view_meta(CAMERA)["view"], "width": "wide"}}])
def test_an_array_that_does_not_say_its_view(tmp_path: Path, meta: dict[str, object]) -> None:
    store = Store.create(tmp_path / "s", {})
    store.put(view_artefact_name(CAMERA, *SIZE, "transport", "vectors"), "transport", np.ones(2), key="k", meta=meta)
    with pytest.raises(UserError, match="view: broken store"):
        baked_views(store)
