"""Saved views, read with suspicion and never mixed up with what is baked; arrays of a view, found by what it sees."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.views.camera import Camera, CameraPath
from lambent.store.contract import SceneRecord, ViewRecord, baked_views, view_artefact_name, view_key, view_meta
from lambent.store.kept.views import FILE, Views, change_views, checked_name, free_name, read_views, with_views
from lambent.store.store import Store

A = Camera(name="a", position=(0, 1, 0), target=(0, 1, -1))
B = Camera(name="b", position=(2, 1, 0), target=(2, 1, -1), fov_y_deg=60)
WALK = CameraPath(name="w", keys=(A, A, B), seconds=3.0, times_s=(0.0, 2.0, 3.0))


def test_round_trip(tmp_path):
    assert read_views(tmp_path) == Views()
    saved = Views(cameras=(A, B), paths=(WALK,))
    assert change_views(tmp_path, lambda views: saved) == saved == read_views(tmp_path)
    change_views(tmp_path, lambda views: views.model_copy(update={"cameras": (*views.cameras, A)}))
    assert [c.name for c in read_views(tmp_path).cameras] == ["a", "b", "a"]
    assert [p.name for p in tmp_path.iterdir()] == [FILE]


@pytest.mark.parametrize(
    ("damage", "word"),
    [
        (lambda d: d.update(version=2), "version"),
        (lambda d: d.update(more=1), "more"),
        (lambda d: d["cameras"][0].update(position=[0, float("nan"), 0]), "beyond 1e9 m"),
        (lambda d: d["cameras"][0].update(position=[0, 1e308, 0]), "beyond 1e9 m"),
        (lambda d: d["cameras"][0].update(fov_y_deg=180), "impossible field of view"),
        (lambda d: d["paths"][0].update(times_s=[0, 3]), "one time for each key"),
        (lambda d: d["paths"][0].update(times_s=[0, 3, 3]), "start at 0, increase"),
        (lambda d: d["paths"][0].update(seconds=9), "start at 0, increase"),
        (lambda d: d["paths"][0].update(keys=[], times_s=[]), "one time for each key"),
    ],
)
def test_damage_is_said_and_nothing_is_overwritten(tmp_path, damage, word):
    document = Views(cameras=(A,), paths=(WALK,)).model_dump(mode="json")
    damage(document)
    (tmp_path / FILE).write_text(json.dumps(document))
    before = (tmp_path / FILE).read_bytes()
    for attempt in (lambda: read_views(tmp_path), lambda: change_views(tmp_path, lambda views: views)):
        with pytest.raises(UserError, match=word):
            attempt()
    assert (tmp_path / FILE).read_bytes() == before


@pytest.mark.parametrize("text", ["", "[]", "{", '{"format": "lambent-store", "version": 1}', "[" * 100_000])
def test_other_files_are_refused(tmp_path, text):
    (tmp_path / FILE).write_text(text)
    with pytest.raises(UserError, match=r"views\.json"):
        read_views(tmp_path)


def test_a_folder_that_is_gone_is_said(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cannot be written"):
        change_views(tmp_path / "file", lambda views: views)


def test_names():
    assert checked_name("  my/view ", {"other"}) == "my/view"
    assert free_name("view", {"view 1", "view 3"}) == "view 2"
    for bad in ("", "  ", "a\nb", "x" * 81, "taken"):
        with pytest.raises(UserError):
            checked_name(bad, {"taken"})


def test_the_scene_hides_saved_names():
    scene = SceneRecord(
        name="s", objects=(), materials={}, cameras=(A,), paths=(CameraPath(name="w", keys=(A, B), seconds=1),),
        bounds=((0, 0, 0), (1, 1, 1)),
    )  # fmt: skip
    whole = with_views(scene, Views(cameras=(replace(A, fov_y_deg=9), B), paths=(WALK,)))
    assert whole.cameras == (A, B) and whole.paths == scene.paths


def test_two_changes_at_once_wait_for_each_other(tmp_path):
    def added(camera):
        return lambda views: views.model_copy(update={"cameras": (*views.cameras, camera)})

    other = Thread(target=change_views, args=(tmp_path, added(B)))

    def slowly(views):
        other.start()
        other.join(0.5)  # time enough to write its own, were it not kept waiting
        return added(A)(views)

    change_views(tmp_path, slowly)
    other.join()
    assert {c.name for c in read_views(tmp_path).cameras} == {"a", "b"}
    assert [p.name for p in tmp_path.iterdir()] == [FILE]


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
