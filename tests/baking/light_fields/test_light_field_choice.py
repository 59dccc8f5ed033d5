"""Which objects get light fields where nobody says it, and how a bake is asked for them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from lambent.baked.light_fields.stored import read_light_field
from lambent.baking.bake import bake
from lambent.baking.light_fields import choosing
from lambent.baking.light_fields.choosing import SHARE, WORTH, chosen, worth_trying
from lambent.baking.light_fields.request import as_asked, light_fields_of, noted
from lambent.baking.light_fields.trial import COUNTS, PROBE, Option, ProbeLight, Trial, helps, options_of
from lambent.core.errors import UserError
from lambent.core.geometry.cubemap import face_directions
from lambent.core.geometry.directions import normalize
from lambent.core.views.camera import Camera
from lambent.scenes.geometry import box, placed
from lambent.scenes.scene import LightFieldWish, Scene, SceneObject, SunSky
from lambent.store.store import Store
from tests.baking.small_scenes import MIRROR, TINY, room_with_step

MB = 64**2 * 8 / 1e6  # of a point with maps of 64 texels a side


def of_points(errors: dict[int, float]) -> dict[Option, float]:
    return {Option(count, 64): error for count, error in errors.items()}


def trial(probe: float, fields: dict[Option, float], size_sr: float, noise: float = 0.0) -> Trial:
    """Held-out errors are those given; those of light fields are `noise` more and less in turn."""
    up_and_down = noise * (-1.0) ** np.arange(100)
    held_out = {option: error + up_and_down for option, error in fields.items()}
    return Trial(probe, fields, size_sr, {PROBE: np.full(100, probe)} | held_out)


def no_sample_map(name: str, points: int) -> float:
    return 0.0


def test_points_go_where_they_take_most_away() -> None:
    trials = {
        "large": trial(0.4, of_points({16: 0.2, 64: 0.1}), 0.02),
        "small": trial(0.4, of_points({16: 0.2, 64: 0.1}), 0.01),
        "hopeless": trial(0.4, of_points({16: 0.39, 64: 0.385}), 1.0),
        "right already": trial(0.0, of_points({16: 0.1, 64: 0.05}), 1.0),
        "by chance": trial(0.4, of_points({16: 0.37, 64: 0.36}), 1.0, noise=0.5),
    }

    def counts(points: float) -> dict[str, int]:
        return {one.object: one.points for one in chosen(trials, points * MB, 8, no_sample_map)}

    assert counts(15) == {} and counts(16) == {"large": 16}
    assert counts(33) == {"large": 16, "small": 16}
    assert counts(85) == {"large": 64, "small": 16} and counts(1000) == {"large": 64, "small": 64}
    one = chosen(trials, 16 * MB, 8, no_sample_map)[0]
    assert one.megabytes == pytest.approx(16 * MB) and (one.probe_error, one.error) == (0.4, 0.2)
    for noise, expected in ((0.01, ["one"]), (0.5, [])):  # small gains are taken where they are certain
        small = {"one": trial(0.4, of_points({16: 0.37}), 1.0, noise)}
        assert [one.object for one in chosen(small, 100.0, 8, no_sample_map)] == expected


def test_memory_buys_points_or_texels_by_what_they_gain() -> None:
    rough = {Option(64, 30): 0.2, Option(16, 94): 0.3, Option(1024, 30): 0.1, Option(64, 94): 0.2}
    narrow = {Option(64, 30): 0.39, Option(16, 94): 0.2, Option(1024, 30): 0.39, Option(64, 94): 0.1}
    trials = {"rough": trial(0.4, rough, 1.0), "narrow": trial(0.4, narrow, 1.0)}
    found = {one.object: (one.points, one.texels) for one in chosen(trials, 100.0, 8, no_sample_map)}
    assert found == {"rough": (1024, 30), "narrow": (64, 94)}
    whole = sum(one.megabytes for one in chosen(trials, 100.0, 8, no_sample_map))
    assert whole == pytest.approx((1024 * 30**2 + 64 * 94**2) * 8e-6)
    spare = chosen(trials, whole + 3.9, 8, lambda name, points: 2.0)
    assert {one.object: one.points for one in spare} != {"rough": 1024, "narrow": 64}, "sample maps count as well"


def test_memory_is_kept_where_it_takes_next_to_nothing_away() -> None:
    """A gain by a tenth of the error of the probe, for 17 MB: .36 of the least, 1.5 times the least, and far more."""
    fields = {Option(16, 94): 0.2, Option(256, 94): 0.16}
    sizes_sr = {"seen": 0.1, "just": 0.0026, "hardly": 0.0006}
    trials = {name: trial(0.4, fields, size_sr) for name, size_sr in sizes_sr.items()}
    found = {one.object: one.points for one in chosen(trials, 1000.0, 8, no_sample_map)}
    assert found == {"seen": 256, "just": 256, "hardly": 16}
    nearly = {"nearly right": trial(0.4, {Option(16, 94): 0.01, Option(256, 94): 0.001}, 1.0)}
    assert [one.points for one in chosen(nearly, 1000.0, 8, no_sample_map)] == [16]


def test_sizes_are_those_that_trials_tell_apart() -> None:
    assert {one.texels for one in options_of(94)} == {62, 94, 190}
    assert all(count in COUNTS for count, _ in options_of(94)) and Option(1024, 190) not in options_of(94)
    assert {one.texels for one in options_of(310)} == {310}, "206 and 620 would be tried with as many texels"
    assert all(one.texels >= 8 for one in options_of(8))
    errors = {Option(16, 30): 0.4, Option(64, 30): 0.3, Option(64, 94): 0.2, Option(256, 30): 0.3}
    assert [helps(errors, one) for one in errors] == [True, True, True, False]
    assert not helps(errors | {Option(64, 190): 0.2}, Option(64, 190))
    found = trial(0.4, of_points({16: 0.2, 64: 0.1, 256: 0.11}), 1.0)
    assert [found.count_for(error) for error in (0.3, 0.15, 0.01)] == [16, 64, 64]


def test_of_very_many_the_largest_are_looked_at_and_the_worst_tried(mi: Any) -> None:
    meshes = {f"{k}": placed(box((0.1 * k, 0.1, 0.1)), (float(k % 2), 0, 0)) for k in range(1, 9)}
    scene = Scene("many", tuple(SceneObject(name, mesh, "mirror") for name, mesh in meshes.items()), {"mirror": MIRROR})
    places = np.array([[0.5, 0, 4.0], [0.5, 3.0, 2.0]])
    assert choosing.look_largest(scene, list(meshes), places, 3) == ["6", "7", "8"]
    assert choosing.look_largest(scene, list(meshes), places, 8) == list(meshes)
    assert worth_trying({"a": 1.0, "b": 10.0, "c": 11 * SHARE / 2, "d": 0.0}) == ["b", "a"]
    assert worth_trying({"a": 0.0}) == []


def test_a_probe_is_looked_up_as_the_renderer_does() -> None:
    """In a room of 4 m whose walls show the place on them; from off the centre, by planes and by distances."""
    w = face_directions(64)
    on_wall = 2 * w / np.abs(w).max(axis=-1, keepdims=True)
    distance = np.linalg.norm(on_wall, axis=-1)
    planes = np.array([[*(sign * axis), 2.0] for axis in np.eye(3) for sign in (-1, 1)])
    centre, rng = np.array([5.0, 0, 0]), np.random.default_rng(0)
    world = planes + np.outer(planes[:, :3] @ -centre, [0, 0, 0, 1])
    x, direction = rng.uniform(-1, 1, (50, 4, 3)), normalize(rng.standard_normal((50, 4, 3)))
    t = ((2 * np.sign(direction) - x) / direction).min(axis=-1, keepdims=True)
    for given in (world, world[:0]):
        light = ProbeLight(on_wall + 2, distance, given, centre)
        found = light.along(x + centre, direction) - 2
        assert np.quantile(np.abs(found - (x + t * direction)).max(axis=-1), 0.9) < 0.1
    np.testing.assert_allclose(light.far(w), on_wall + 2, atol=0.05)


def test_names_and_patterns_say_which() -> None:
    ball = LightFieldWish(points=9)
    scene = replace(room_with_step(), light_fields={"ball": ball})
    assert as_asked(scene, "scene").light_fields == as_asked(scene, "auto").light_fields == {"ball": ball}
    assert as_asked(scene, "none").light_fields == {}
    assert as_asked(scene, "b*").light_fields == {"ball": ball, "block": LightFieldWish()}
    assert as_asked(scene, "shell,lamp").light_fields.keys() == {"shell", "lamp"}
    with pytest.raises(UserError, match=r"--light-fields: matches no object; found bal; .* did you mean 'ball'\?"):
        as_asked(scene, "lamp,bal")
    assert noted({}, None, None) == {"light_fields": "scene", "light_field_mb": "256.0"}
    before = noted({}, "auto", 64.0)
    assert noted(before, None, None) == before and noted(before, "none", None)["light_field_mb"] == "64.0"


@pytest.fixture(scope="module")
def beside() -> Scene:
    """A ball and two mirrors of a corner that stand close about it: one centre does not see what the corner mirrors."""
    scene = room_with_step()
    corner = SceneObject("corner", placed(box((0.5, 0.5, 0.04)), (-0.8, 0.5, -0.4)), "mirror")
    eyes = (Camera("a", (0.6, 1.2, 1.4), (-0.8, 0.4, 0)), Camera("b", (-1.5, 1.2, 1.5), (-0.8, 0.5, 0)))
    return replace(
        scene, objects=(*scene.objects, corner), materials={**scene.materials, "mirror": MIRROR}, cameras=eyes
    )


def test_reflectors_show_shares_of_areas(beside: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    parts = [SimpleNamespace(object=name, area_m2=0.25) for name in ("corner", "corner", "gone")]
    record = SimpleNamespace(reflectors=[SimpleNamespace(parts=parts)])
    monkeypatch.setattr(choosing, "scene_record", lambda store: record)
    shown = choosing.shown_by_reflectors(beside, cast("Any", None))
    assert shown == {"corner": pytest.approx(0.5 / 0.58)}, "both large faces of a thin box"


@pytest.mark.long
def test_a_bake_chooses_and_keeps_its_choice(
    beside: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("lambent.baking.light_fields.trial.COUNTS", (16, 32))
    monkeypatch.setattr("lambent.baking.light_fields.trial.FINENESS", (1,))
    quality = TINY.changed("tiny", light_field={"points": 12, "texels": 30, "strata": 1})

    def baked(**asked: Any) -> Store:
        return bake(beside, tmp_path / "s", quality=quality, only=("light_field",), **asked)

    store = baked(light_fields="auto")
    fields = {one["object"]: one for one in light_fields_of(store)}
    assert "ball" in fields
    for name, one in fields.items():
        assert one["error"] < (1 - WORTH) * one["probe_error"] and one["seconds"] > 0
        side = read_light_field(store, name).radiance.shape[1]
        assert side == 30
    keys, steps = {a.name: a.key for a in store.artefacts()}, list[str]()
    store = baked(progress=lambda done, total, what: steps.append(what))
    assert {a.name: a.key for a in store.artefacts()} == keys and not steps, "chosen once, as the store says"
    assert "shiny objects" not in caplog.text
    monkeypatch.setattr(choosing, "MOST_WATCHED", 1)
    assert {one["object"] for one in light_fields_of(baked(light_field_mb=100))} == {"ball"}, "the larger one"
    assert "tried on 1 of 2 shiny objects" in caplog.text
    store = baked(light_fields="none")
    assert not light_fields_of(store) and not store.artefacts("light_field")


@pytest.mark.long
def test_an_error_that_is_asked_for_decides_how_many_points(beside: Scene, tmp_path: Path) -> None:
    quality = TINY.changed("tiny", light_field={"points": 24, "texels": 8, "strata": 1})
    counts = []
    for error in (100.0, 1e-6):
        asked = replace(beside, light_fields={"ball": LightFieldWish(error=error)})
        store = bake(asked, tmp_path / "s", quality=quality, only=("light_field",))
        counts.append(light_fields_of(store)[0]["points"])
    assert counts[0] == 16 and counts[0] <= counts[1] <= 24


@pytest.mark.long
def test_what_stands_alone_under_the_sky_keeps_its_probe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A convex box far from everything: the probe is right."""
    monkeypatch.setattr("lambent.baking.light_fields.trial.COUNTS", (16, 32))
    monkeypatch.setattr("lambent.baking.light_fields.trial.FINENESS", (1,))
    objects = (SceneObject("box", box((0.4, 0.3, 0.2)), "mirror"),)
    eyes = (Camera("a", (1.0, 0.8, 1.2), (0, 0, 0)), Camera("b", (-1.2, -0.6, 0.7), (0, 0, 0)))
    scene = Scene("alone", objects, {"mirror": MIRROR}, environment=SunSky((0.39, 0.86, -0.32)), cameras=eyes)
    quality = TINY.changed("tiny", light_field={"points": 12, "texels": 30, "strata": 1})
    store = bake(scene, tmp_path / "s", quality=quality, light_fields="auto", only=("light_field",))
    assert light_fields_of(store) == []
