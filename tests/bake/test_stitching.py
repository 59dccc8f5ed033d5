"""Closed seams: what both sides of a cut look up, of a smooth body in few texels and of a body with hard edges."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from lambent.bake.light.sampling import cleaned
from lambent.bake.light.stitching import Cuts, cuts_of, stitched
from lambent.bake.surfaces.atlas import merged, unwrap
from lambent.bake.surfaces.texels import BEYOND, chart_labels, texels_of
from lambent.core.directions import normalize
from lambent.scenes.geometry import box, placed, sphere
from lambent.scenes.scene import Mesh, Scene, SceneObject
from tests.bake.small_scenes import GREY

Floats = NDArray[np.floating]
TOWARDS = normalize(np.array([0.3, 0.8, 0.5]))


def lit(mesh: Mesh, texels_along: int, noise: float) -> tuple[Floats, Floats, Cuts, Floats]:
    """Light maps of a body under one lamp and an even sky before and after, its cuts, and its charts."""
    atlas = unwrap(Scene("body", (SceneObject("body", mesh, "grey"),), {"grey": GREY}), texels_along)
    geometry = merged(atlas)
    texels = texels_of(geometry, atlas.width, atlas.height)
    labels = chart_labels(geometry, texels)
    light = 1 + 3 * np.maximum(texels.normals @ TOWARDS, 0).mean(axis=1)
    light *= 1 + noise * np.random.default_rng(0).normal(size=light.shape)
    image = np.zeros((atlas.height, atlas.width, 3))
    image.reshape(-1, 3)[texels.index] = light[:, None] * [1.0, 0.8, 0.6]
    known = image.any(axis=-1)
    cuts = cuts_of(geometry, atlas.width, atlas.height)
    none = Cuts(cuts.here[:0], cuts.there[:0])
    before, after = (cleaned(image, known, texels, labels, which).astype(float) for which in (none, cuts))
    return before, after, cuts, labels


def steps(image: Floats, cuts: Cuts) -> Floats:
    """Differences across the cuts over their light."""
    height, width = image.shape[:2]
    a, b = (
        map_coordinates(image[..., 0], [uv[:, 1] * height - 0.5, uv[:, 0] * width - 0.5], order=1, mode="nearest")
        for uv in (cuts.here, cuts.there)
    )
    return np.asarray(2 * np.abs(a - b) / (a + b))


@pytest.mark.parametrize("texels_along", [12, 40])
def test_cuts_of_a_ball_close_and_its_light_stays(texels_along: int) -> None:
    before, after, cuts, labels = lit(placed(sphere(0.5, 32, 16), (0, 1, 0)), texels_along, 0.05)
    assert len(cuts.here) > 30
    assert steps(after, cuts).mean() < steps(before, cuts).mean() / 4 and np.quantile(steps(after, cuts), 0.95) < 0.03
    inside = labels >= 0
    assert np.abs(after - before)[inside].mean() < 0.1 * before[inside].mean()
    assert after[inside].mean() == pytest.approx(before[inside].mean(), rel=0.03)


def test_hard_edges_are_no_cuts() -> None:
    before, after, cuts, _ = lit(box((1, 1, 1)), 40, 0.05)
    assert not len(cuts.here) and np.array_equal(before, after)


def test_hidden_parts_darkness_and_nothing_stay() -> None:
    image = np.random.default_rng(0).random((8, 8, 3))
    cuts = Cuts(np.array([[0.2, 0.3]]), np.array([[0.8, 0.7]]))
    hidden = np.full((8, 8), BEYOND)
    assert np.array_equal(stitched(image, cuts, hidden), image)
    assert not stitched(0 * image, cuts, np.zeros((8, 8), int)).any()
    moved = stitched(image, cuts, np.zeros((8, 8), int))
    assert steps(moved, cuts)[0] < 0.1 * steps(image, cuts)[0] and np.isfinite(moved).all()
    assert (moved != image).any(axis=-1).sum() <= 8
