"""Flicker: frames reprojected by hand, and a bench that sees what flickers and nothing else."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.engine import engine
from lambent.baking.quality import quality_named
from lambent.bench.pictures import flicker
from lambent.bench.pictures.flicker import Distance, reprojected
from lambent.core.views.camera import Camera, pixel_rays
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import merge, patch
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import Mesh
from lambent.store.contract import FAR

BEFORE = Camera("before", (0.0, 0.0, 2.0), (0.0, 0.0, 0.0))
AFTER = Camera("after", (0.13, 0.05, 1.9), (0.1, 0.0, 0.0))


def surfaces(mesh: Mesh) -> Distance:
    engine()
    from lambent.baking.tracing.rays import distances, rays_from
    from lambent.baking.tracing.scene_builder import bare_scene

    traced = bare_scene(mesh.corners)
    return lambda origin, directions: np.minimum(distances(traced, rays_from(origin, directions)), FAR)


def stripes(camera: Camera, width: int = 96, height: int = 64) -> np.ndarray:
    """A smooth pattern on the wall z = 0."""
    rays = pixel_rays(camera, width, height)
    eye = np.asarray(camera.position)
    x = (eye + rays * (-eye[2] / rays[..., 2])[..., None])[..., :2]
    return np.stack([np.sin(3 * x[..., 0]), np.cos(2 * x[..., 1]), x.sum(axis=-1)], axis=-1)


def test_a_pattern_stays_on_its_wall() -> None:
    wall = patch((-5, -5, 0), (10, 0, 0), (0, 10, 0))
    moved, seen = reprojected(stripes(BEFORE), BEFORE, AFTER, surfaces(wall))
    assert 0.8 < seen.mean() < 1, "a margin comes into view"
    assert np.abs(moved - stripes(AFTER))[seen].max() < 2e-3
    assert np.abs(stripes(BEFORE) - stripes(AFTER)).mean() > 0.05


def test_what_was_hidden_is_not_taken_from_what_hid_it() -> None:
    both = merge([patch((-5, -5, 0), (10, 0, 0), (0, 10, 0)), patch((-0.2, -0.2, 1), (0.4, 0, 0), (0, 0.4, 0))])
    _, seen = reprojected(stripes(BEFORE), BEFORE, AFTER, surfaces(both))
    alone = patch((-5, -5, 0), (10, 0, 0), (0, 10, 0))
    _, without = reprojected(stripes(BEFORE), BEFORE, AFTER, surfaces(alone))
    assert 0.01 < (without & ~seen).mean() < 0.2


@pytest.mark.long
@pytest.mark.usefixtures("adapter")
def test_bench_sees_what_flickers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    coarse = quality_named("preview").changed("coarse", geometry={"texels": 64}, environment={"texels": 32})
    store = bake(load_scene("builtin:box"), tmp_path / "box.store", quality=coarse)
    effort = flicker.Effort(96, 64, 1, (1, 2, 20), 4)
    rows = {row["case"]: row for row in flicker.run(effort, inputs=[tmp_path / "box.store"])["rows"]}
    assert list(rows) == ["still", "change over", "at rest", "walk", "walk, traced", "walk, smooth"]
    assert rows["still"]["flip"] == 0
    assert rows["at rest"]["pairs"] == 2
    assert 0 < rows["at rest"]["flip"] < rows["change over"]["flip"] < 0.1
    assert 0 < rows["walk, traced"]["flip"] < 0.1
    assert 0 < rows["walk, smooth"]["flip"] <= rows["walk"]["flip"] < 0.1
    frames = iter(range(1000))
    shown = Renderer.display_image

    def uneven(self: Renderer, state: object) -> object:
        return shown(self, replace(state, exposure_ev=state.exposure_ev + 0.5 * (next(frames) % 2)))

    monkeypatch.setattr(Renderer, "display_image", uneven)
    flickering = {row["case"]: row for row in flicker.rows_of(store, effort)}
    assert flickering["still"]["flip"] > 0.02 and flickering["walk"]["flip"] > 3 * rows["walk"]["flip"]
    assert flickering["walk, traced"] == rows["walk, traced"], "traced pictures repeat"
