"""Traced stills and films: what ends them, what they keep, what is drawn instead."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.core.errors import UserError
from lambent.core.light.light_mix import parse_light
from lambent.core.pictures.images import read_image
from lambent.core.views.projections import Projection
from lambent.render import Settings, film, images, still
from lambent.scenes.loaders.load import load_scene
from lambent.store.contract import scene_record
from lambent.store.source import SOURCE
from lambent.store.store import Store
from tests.baking.small_scenes import TINY

pytestmark = [pytest.mark.usefixtures("mi"), pytest.mark.slow]
TRACED = Settings(48, 32, samples=16)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory, mi: Any) -> Path:
    folder = tmp_path_factory.mktemp("traced") / "box"
    kinds = ("light_map", "answer")
    return bake(load_scene("builtin:box"), folder, quality=TINY, only=kinds, light_groups="scene").folder


def drawn(store: Path, settings: Settings, notes: list[str] | None = None) -> np.ndarray:
    opened = Store.open(store)
    made = images(opened, settings, note=[].append if notes is None else notes.append)
    return np.asarray(made.radiance(scene_record(opened).cameras[0]))


@pytest.mark.long
def test_a_still_ends_at_its_noise_or_its_samples(store: Path, tmp_path: Path) -> None:
    rough, fine = (still(store, tmp_path / "a.exr", settings=Settings(48, 32, noise=n)) for n in (0.1, 0.02))
    assert rough.integrator == fine.integrator == "traced"
    assert rough.noise is not None and fine.noise is not None and fine.noise <= 0.02 < 0.1
    assert rough.noise <= 0.1 and 8 <= (rough.samples or 0) <= (fine.samples or 0)
    counted = still(store, tmp_path / "b.exr", settings=replace(TRACED, samples=3))
    assert (counted.samples, counted.noise) == (3, None)


@pytest.mark.long
def test_it_shows_what_paths_show(store: Path) -> None:
    many = replace(TRACED, samples=400)
    found, true = drawn(store, many), drawn(store, replace(many, integrator="path", denoise=True))
    assert found.mean(axis=(0, 1)) == pytest.approx(true.mean(axis=(0, 1)), rel=0.02)
    assert np.abs(found - true).mean() < 0.05 * true.mean()


def test_denoising_is_a_choice(store: Path) -> None:
    few = replace(TRACED, samples=2, integrator="path")
    true = drawn(store, replace(few, samples=400))
    noisy, clean = (np.abs(drawn(store, replace(few, denoise=one)) - true).mean() for one in (None, True))
    assert clean < 0.7 * noisy


@pytest.mark.long
@pytest.mark.parametrize("integrator", ["traced", "path"])
def test_mixes_colours_and_variants_show(store: Path, integrator: str) -> None:
    usual = replace(TRACED, integrator=integrator, samples=64)
    whole = drawn(store, usual)
    half = drawn(store, replace(usual, light=parse_light(["lamp=0.5"])))
    assert half.mean() == pytest.approx(whole.mean() / 2, rel=0.05)
    red = drawn(store, replace(usual, recolour={"white": (0.7, 0.05, 0.05)}))
    assert red[..., 1].mean() < 0.7 * whole[..., 1].mean() < whole[..., 0].mean()


def test_parts_of_the_light(store: Path) -> None:
    parts = [drawn(store, replace(TRACED, show=show, denoise=False)).mean() for show in ("full", "diffuse", "specular")]
    assert parts[0] > parts[1] > parts[2] > 0
    with pytest.raises(UserError, match="the path tracer shows all light"):
        drawn(store, replace(TRACED, show="diffuse", integrator="path"))


def test_the_light_map_itself_is_drawn(adapter: None, store: Path) -> None:
    lux = replace(TRACED, show="light-map", samples=None)
    np.testing.assert_array_equal(drawn(store, lux), drawn(store, replace(lux, integrator="lamps")))


def test_projections(store: Path) -> None:
    eye = drawn(store, replace(TRACED, width=32, projection=Projection.fisheye, samples=4))
    assert eye.shape == (32, 32, 3) and eye[16, 16].min() > 0 and not eye[0, 0].any(), "beyond the circle"


def test_a_film(store: Path, tmp_path: Path) -> None:
    done = film(store, tmp_path / "a-#.exr", settings=replace(TRACED, samples=2), fps=1)
    frames = [read_image(path) for path in sorted(tmp_path.iterdir())]
    assert done.frames == len(frames) > 1 and done.integrator == "traced"
    assert all(frame.mean() > 0 for frame in frames) and not np.array_equal(frames[0], frames[-1])


@pytest.mark.long
def test_ctrl_c_keeps_the_picture_so_far(store: Path, tmp_path: Path) -> None:
    notes: list[str] = []

    def press(done: float, total: float, what: str) -> None:
        if done >= 6:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        still(store, tmp_path / "a.exr", settings=replace(TRACED, samples=1000), note=notes.append, progress=press)
    kept = read_image(tmp_path / "a.exr")
    assert kept.mean() == pytest.approx(drawn(store, TRACED).mean(), rel=0.1)
    assert any(note.startswith("interrupted: the picture has") for note in notes)
    with pytest.raises(KeyboardInterrupt):
        film(store, tmp_path / "b-#.exr", settings=replace(TRACED, samples=1000), progress=press)


@pytest.mark.long
@pytest.mark.parametrize(("place", "why"), [(None, "no path of its scene"), ("gone/scene.toml", "is not there")])
def test_a_store_without_its_scene_is_drawn(
    adapter: None, store: Path, tmp_path: Path, place: str | None, why: str
) -> None:
    import shutil

    copy, notes = tmp_path / "copy", list[str]()
    shutil.copytree(store, copy)
    with Store.open(copy) as opened:
        opened.set_document(SOURCE, place)
    settings = replace(TRACED, noise=0.05, samples=None)
    found = drawn(copy, settings, notes)
    assert any(f"drawn by lamps, not traced: {why}" in note or why in note for note in notes)
    np.testing.assert_array_equal(found, drawn(copy, Settings(48, 32, integrator="lamps")))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (Settings(8, 8, noise=2.0), "--noise: is out of range"),
        (Settings(8, 8, noise=float("nan")), "--noise: is out of range"),
        (Settings(8, 8, noise=0.1, samples=4), "--noise: excludes --samples"),
        (Settings(8, 8, integrator="lamps", noise=0.1), "--noise: applies to traced pictures only"),
        (Settings(8, 8, integrator="rings", denoise=True), "--denoise: applies to traced pictures only"),
        (Settings(8, 8, planar="off"), "--planar: applies to drawn pictures only"),
        (Settings(8, 8, lookup="plain"), "--lookup: applies to drawn pictures only"),
        (Settings(8, 8, light=parse_light(["lomp=off"])), "unknown light group"),
    ],
)
def test_impossible_settings_are_refused(store: Path, settings: Settings, message: str) -> None:
    with pytest.raises(UserError, match=message):
        drawn(store, settings)
