"""views.json: saved whole, read with suspicion, and never mixed up with what is baked."""

import json
from dataclasses import replace
from threading import Thread

import pytest

from lambent.core.errors import UserError
from lambent.core.views.camera import Camera, CameraPath
from lambent.store.contract import SceneRecord
from lambent.store.kept.views import FILE, Views, change_views, checked_name, free_name, read_views, with_views

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
