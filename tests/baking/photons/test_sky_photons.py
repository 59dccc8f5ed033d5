"""Photons of the sky: what comes in by a window is known by hand; they stop at the noise that was asked for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.photons.maps import BATCHES, FEWEST, shot_of
from lambent.baking.photons.shooting import learnt_sky, shoot
from lambent.scenes.scene import ConstantEnvironment
from lambent.store.store import Store
from tests.baking.sky.test_sky_guide import HALF, built, pit, sunny
from tests.baking.small_scenes import TINY, furnace

SMALL = TINY.changed(light_map={"photons_per_texel": 64, "max_depth": 8})


def shot(store: Store) -> np.ndarray:
    return shot_of(store.read("light_map/photons")).astype(float)


@pytest.mark.long
def test_window_lets_in_the_flux_of_its_area(tmp_path: Path) -> None:
    scene = pit(ConstantEnvironment((1.0, 2.0, 1.0)))
    store = bake(scene, tmp_path / "s", quality=SMALL, light_map="photons", only=["light_map"])
    flux = shot(store)[:, 0].sum(axis=(1, 2))  # black walls: each photon lands once
    error = flux.std(axis=0, ddof=1) / np.sqrt(len(flux))
    wanted = np.pi * (2 * HALF) ** 2 * np.array([1, 2, 1])
    assert np.all(np.abs(flux.mean(axis=0) - wanted) < 4 * error) and np.all(error < 0.05 * wanted)


@pytest.mark.long
def test_landing_places_bring_the_same_light_as_the_disc(tmp_path: Path) -> None:
    scene = pit(sunny(tmp_path))
    scene = replace(scene, materials={"black": scene.materials["black"].model_copy(update={"kd": (0.5, 0.5, 0.5)})})
    builder, whole = built(scene)
    mesh = scene.objects[0].mesh
    builder.meshes["pit"].add_attribute("vertex_uv2", 3, np.zeros(3 * len(mesh.positions), np.float32))
    sky = learnt_sky(scene, whole, np.ones((1, 1)), 4)
    assert sky is not None
    shape, flux = (2, 1, 1), {}
    for name, drawn_by in (("landing", sky), ("disc", None)):
        flux[name] = np.array([shoot(whole, shape, 1 << 16, 4, seed, drawn_by)[:, 0, 0, 1] for seed in range(8)])
    means = [f.mean(axis=0) for f in flux.values()]
    error = np.sqrt(sum(f.var(axis=0, ddof=1) / len(f) for f in flux.values()))
    assert np.all(np.abs(means[0] - means[1]) < 4.5 * error), "on either side"


@pytest.mark.long
def test_photons_stop_at_the_noise(tmp_path: Path) -> None:
    quality = SMALL.changed(light_map={"noise": 1.0})
    few = bake(furnace(), tmp_path / "few", quality=quality, light_map="photons", only=["light_map"])
    assert len(shot(few)) == FEWEST
    assert 0 < few.artefact("light_map/irradiance").meta["noise"] <= 1.0
    all_ = bake(furnace(), tmp_path / "all", quality=SMALL, light_map="photons", only=["light_map"])
    assert len(shot(all_)) == BATCHES
    assert shot(few).mean(axis=0).sum() == pytest.approx(shot(all_).mean(axis=0).sum(), rel=0.01)
