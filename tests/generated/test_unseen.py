"""Scenes of `unseen` are read with few warnings, or refused in one line, and are lit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.scenes.loaders.load import load_scene
from lambent.store.contract import SIDES
from tests.baking.small_scenes import TINY
from tests.generated.unseen import NOISY, READABLE, TILE, UNSEEN, compared, misses

REFUSED = {"sun_below": "the sun is below the horizon", "sharpest": "lobes.0.mx: must be greater"}
LARGE = {"cad_nodes", "million", "texture_8k", "damaged_table", "one_wavelength", "sixteen_wavelengths"}
BAKED = ("broken", "inside_out", "leak_0mm")  # others with --long


def with_long(names: set[str], chosen: set[str]) -> list[Any]:
    """Parameters: the chosen names, and the others for long runs alone."""
    return [pytest.param(name, marks=() if name in chosen else pytest.mark.long) for name in sorted(names)]


@pytest.mark.parametrize("name", with_long({*UNSEEN}, UNSEEN.keys() - LARGE))
def test_it_is_read_or_refused_in_one_line(name: str, tmp_path: Path) -> None:
    scene = UNSEEN[name](tmp_path)
    if name in REFUSED:
        with pytest.raises(UserError, match=REFUSED[name]) as refusal:
            load_scene(scene)
        assert "\n" not in str(refusal.value)
        return
    warnings = load_scene(scene).warnings
    assert len(warnings) <= READABLE
    assert len({*warnings}) == len(warnings)


@pytest.mark.long
@pytest.mark.parametrize("name", with_long(UNSEEN.keys() - REFUSED.keys(), {*BAKED}))
def test_its_light_is_finite_and_not_black(name: str, mi: Any, tmp_path: Path) -> None:
    from lambent.baking.bake import bake

    scene = load_scene(UNSEEN[name](tmp_path))
    with bake(scene, tmp_path / "store", quality=TINY, only=["light_map"]) as store:
        sides = [store.read(f"light_map/{side}") for side in SIDES if f"light_map/{side}" in store]
    assert all(np.isfinite(side.astype(np.float32)).all() for side in sides)
    assert any(side.any() for side in sides)


@pytest.mark.long
@pytest.mark.parametrize(("name", "rare"), [("keyhole", True), ("kitchen_in_metres", False)])
def test_light_that_paths_rarely_find_is_said(name: str, rare: bool, mi: Any, tmp_path: Path, caplog: Any) -> None:
    from lambent.baking.bake import bake

    bake(load_scene(UNSEEN[name](tmp_path)), tmp_path / "store", quality=TINY, only=["light_map"]).close()
    assert ("too rare to be found" in caplog.text) == rare


def test_a_row_names_what_it_misses() -> None:
    row = {"outcome": "baked", "flip": 0.1, "noise": 0.05, "worst_tile": 0.2, "warnings": ["a", "b"]}
    assert misses(row) == ["flip"]
    assert misses({**row, "flip": 0.06, "worst_tile": 0.4}) == ["tile"]
    assert misses({**row, "flip": 0.06, "warnings": ["a", "a"]}) == ["warnings"]
    assert misses({"outcome": "refused: scene.toml: kd"}) == []
    assert misses({"outcome": "fault: code 1, ValueError"}) == ["fault: code 1, ValueError"]
    assert misses({"outcome": "baked", "dark": 0.1}) == ["not dark"]


def test_noisy_paths_are_compared_by_means_of_squares() -> None:
    rest, random = np.full((108, 192, 3), 0.5, np.float32), np.random.default_rng(0)
    quiet, noisy = (
        [rest * random.gamma(1 / spread, spread, (108, 192, 1)).astype(np.float32) for _ in range(2)]
        for spread in (0.001, 1.0)
    )
    assert "of_pixels" not in compared(rest, *quiet)
    row = compared(rest, *noisy)
    assert row["of_pixels"] > 1 and row["noise"] <= NOISY and not misses({"outcome": "baked", **row})
    holed = rest.copy()
    holed[32:48, 64:80] = 0
    assert compared(holed, *noisy)["worst_tile"] > TILE > row["worst_tile"]
