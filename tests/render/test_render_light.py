"""Mixes of light groups in stills and films without a window."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.light.light_mix import GroupMix, LightMix, parse_light
from lambent.core.pictures.images import read_image
from lambent.render import Settings, film, still
from lambent.store.kept.views import change_views
from tests.viewer.small_store import FRONT, with_light_groups, write_small_store

SMALL = Settings(48, 32, integrator="rings")
DIMMED = Settings(48, 32, integrator="rings", light=parse_light(["lamp=0.5", "sky=0.5", "sun=0.5"]))
HALF = LightMix({name: GroupMix(intensity=0.5) for name in ("lamp", "sky", "sun")})


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return with_light_groups(write_small_store(tmp_path_factory.mktemp("lit") / "s"))


@pytest.fixture(scope="module")
def baked(adapter: None, store: Path) -> np.ndarray:
    still(store, store.parent / "baked.exr", "front", SMALL)
    return read_image(store.parent / "baked.exr")


@pytest.mark.long
def test_a_still_takes_a_mix(store: Path, baked: np.ndarray, tmp_path: Path) -> None:
    still(store, tmp_path / "a.exr", "front", DIMMED)
    assert read_image(tmp_path / "a.exr") == pytest.approx(baked / 2, rel=6e-3, abs=2e-3)


@pytest.mark.long
def test_a_saved_view_has_its_mix_unless_another_is_given(store: Path, baked: np.ndarray, tmp_path: Path) -> None:
    saved = {"cameras": (FRONT.__class__("dusk", FRONT.position, FRONT.target, fov_y_deg=FRONT.fov_y_deg),)}
    change_views(store, lambda views: views.model_copy(update={**saved, "lights": {"dusk": HALF}}))
    still(store, tmp_path / "a.exr", "dusk", SMALL)
    assert read_image(tmp_path / "a.exr") == pytest.approx(baked / 2, rel=6e-3, abs=2e-3)
    still(store, tmp_path / "b.exr", "dusk", Settings(48, 32, integrator="rings", light=parse_light(["sun=on"])))
    assert read_image(tmp_path / "b.exr") == pytest.approx(baked, rel=6e-3, abs=2e-3)


@pytest.mark.long
def test_the_light_of_a_film_changes_with_its_time(adapter: None, store: Path, tmp_path: Path) -> None:
    names = ("lamp", "sky", "sun")
    track = parse_light([f"{name}={value}@{at}" for name in names for value, at in (("1", 0), ("0", 2))])
    frames = {}
    for name, light in {"plain": None, "lit": track}.items():
        (tmp_path / name).mkdir()
        settings = Settings(48, 32, integrator="rings", light=light)
        assert film(store, tmp_path / name / "f-#.exr", "tour", settings, fps=2).frames == 6
        frames[name] = [read_image(path).mean() for path in sorted((tmp_path / name).iterdir())]
    shares = np.array(frames["lit"]) / np.array(frames["plain"])
    assert shares == pytest.approx([1, 0.75, 0.5, 0.25, 0, 0], abs=0.01)


@pytest.mark.long
def test_what_cannot_be_dimmed_is_said(adapter: None, store: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"unknown light group.*lamp, sky, sun"):
        still(store, tmp_path / "a.exr", "front", Settings(8, 8, light=parse_light(["lomp=off"])))


def test_a_store_without_groups_says_what_to_bake(adapter: None, tmp_path: Path) -> None:
    bare = write_small_store(tmp_path / "s")
    with pytest.raises(UserError, match=r"--light: the store has no light groups.*--light-groups scene"):
        still(bare, tmp_path / "a.exr", "front", DIMMED)
