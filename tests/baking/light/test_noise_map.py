"""The light map's noise, against estimates whose deviation is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.light.noise import noise_map
from lambent.baking.light.sampling import sampled_halves
from lambent.store.store import Store
from tests.baking.small_scenes import TINY, furnace


def estimates(irradiance: np.ndarray, relative: np.ndarray) -> np.ndarray:
    """Two halves (2, H, W, 3) whose mean has the relative standard error `relative` (H, W)."""
    rng = np.random.default_rng(3)
    deviation = relative * np.sqrt(2) * rng.standard_normal((2, *irradiance.shape))
    return np.repeat((irradiance * (1 + deviation))[..., None], 3, axis=-1)


def test_relative_error_is_found() -> None:
    irradiance = np.full((80, 80), 5.0)
    relative = np.where(np.arange(80) < 40, 0.02, 0.1) * np.ones((80, 1))
    noise = noise_map(estimates(irradiance, relative), np.ones((80, 80), bool), np.zeros((80, 80), int)).astype(float)
    for part, true in ((slice(0, 36), 0.02), (slice(44, 80), 0.1)):
        squares = noise[:, part] ** 2
        assert np.sqrt(squares.mean()) == pytest.approx(true, rel=0.04)
        assert noise[:, part].std() < 0.2 * true


def test_charts_do_not_share_their_noise() -> None:
    left = np.arange(60) < 30
    labels = np.where(left, 0, 1) * np.ones((60, 1), int)
    relative = np.where(left, 0.0, 0.2) * np.ones((60, 1))
    noise = noise_map(estimates(np.ones((60, 60)), relative), np.ones((60, 60), bool), labels)
    assert noise[:, :30].max() == 0 and noise[:, 30:].min() > 0.05


def test_unsampled_texels_take_the_noise_beside_them_and_black_has_none() -> None:
    halves, known, labels = np.ones((2, 8, 8, 3)), np.ones((8, 8), bool), np.zeros((8, 8), int)
    halves[1] = 1.5
    known[3, 3], halves[:, 3, 3] = False, 0
    noise = noise_map(halves, known, labels).astype(float)
    assert np.allclose(noise, 0.25 / 1.25, rtol=1e-3)
    assert not noise_map(np.zeros((2, 8, 8, 3)), known, labels).any()


def test_bakes_keep_it_and_an_older_store_gets_it_without_new_samples(tmp_path: Path) -> None:
    path = tmp_path / "s"
    store = bake(furnace(), path, quality=TINY, only=["light_map"])
    noise, whole = store.read("light_map/noise"), store.artefact("light_map/irradiance").meta["noise"]
    assert noise.shape == store.read("light_map/irradiance").shape[:2] and noise.dtype == np.float16
    known, key = sampled_halves(store.read("light_map/traced"))[1], store.artefact("light_map/traced").key
    assert np.sqrt((noise[known].astype(float) ** 2).mean()) == pytest.approx(whole, rel=0.15)
    del store._artefacts["light_map/noise"]
    store._save()
    again = bake(furnace(), path, quality=TINY, only=["light_map"])
    assert np.array_equal(again.read("light_map/noise"), noise)
    assert Store.open(path).artefact("light_map/traced").key == key
