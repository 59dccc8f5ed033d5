"""Closed seams: what both sides of a cut look up, of a smooth body in few texels and of a body with hard edges."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from lambent.baking.bake import bake
from lambent.baking.light.sampling import cleaned
from lambent.baking.light.stitching import Cuts, cuts_of, stitched
from lambent.baking.surfaces.atlas import merged, unwrap
from lambent.baking.surfaces.texels import BEYOND, chart_labels, texels_of
from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize
from lambent.scenes.geometry import box, grid, merge, patch, placed, sphere
from lambent.scenes.scene import ConstantEnvironment, Mesh, Scene, SceneObject
from tests.baking.small_scenes import BLACK, GREY, TINY

TOWARDS = normalize(np.array([0.3, 0.8, 0.5]))


FIFTH = np.full((8, 8), 0.2)  # of each texel is surface


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
    image = 1 + 0.1 * np.random.default_rng(0).random((8, 8, 3))
    cuts = Cuts(np.array([[0.2, 0.3]]), np.array([[0.8, 0.7]]))
    hidden = np.full((8, 8), BEYOND)
    full = np.ones((8, 8))
    assert np.array_equal(stitched(image, cuts, hidden, full, FIFTH), image)
    assert not stitched(0 * image, cuts, np.zeros((8, 8), int), full, FIFTH).any()
    moved = stitched(image, cuts, np.zeros((8, 8), int), full, FIFTH)
    assert steps(moved, cuts)[0] < 0.1 * steps(image, cuts)[0] and np.isfinite(moved).all()
    assert (moved != image).any(axis=-1).sum() <= 8


def two_sides(right: float, area_right: float = 1.0, covered: Floats = FIFTH) -> tuple[Floats, Floats, Cuts]:
    """A map of light 1, and `right` from column 4 on, before and after closing a cut between columns 2 and 5."""
    image, area_m2, along = np.ones((8, 8, 3)), np.ones((8, 8)), (np.arange(1, 7) + 0.5) / 8
    image[:, 4:], area_m2[:, 4:] = right, area_right
    cuts = Cuts(*(np.stack([np.full(6, (column + 0.5) / 8), along], axis=1) for column in (2, 5)))
    return image, stitched(image, cuts, np.zeros((8, 8), int), area_m2, covered), cuts


def test_a_whole_texel_of_surface_keeps_more_of_its_light_than_the_rim_of_one() -> None:
    covered = np.ones((8, 8))
    covered[:, :4] = 0.3
    _, moved, _ = two_sides(0.5, covered=covered)
    assert np.abs(moved[1:7, 5] - 0.5).mean() < 0.6 * np.abs(moved[1:7, 2] - 1).mean()


def test_a_sliver_follows_the_broad_side() -> None:
    """The second side is a sliver with a little less light."""
    image, moved, cuts = two_sides(0.95, 0.1)
    assert np.array_equal(moved[:, :4], image[:, :4])
    assert steps(moved, cuts).max() < 0.01
    both = two_sides(0.95)[1]
    assert np.allclose(both[1:7, 2], both[1:7, 5], rtol=0.01) and 0.96 < both[1:7, 2].mean() < 0.99


@pytest.mark.parametrize("area", [0.1, 1.0])
def test_a_gap_stays_dark_beside_a_lit_surface(area: float) -> None:
    """The second side is in a gap with a hundredth of the light, a sliver or not."""
    _, moved, _ = two_sides(0.01, area)
    assert moved[:, 4:].max() < 0.011 and moved[:, :4].min() > 0.98


def test_the_fit_does_not_swing_beyond_the_light_beside_it() -> None:
    """Three texels' worth of noisy slivers along a cut: no channel leaves the range of what is met."""
    rng = np.random.default_rng(0)
    image = rng.random((16, 16, 3)) ** 4 + 0.01
    along = (np.arange(1, 60) / 4 + 0.5) / 16
    cuts = Cuts(*(np.stack([np.full(59, (column + 0.5) / 16), along], axis=1) for column in (2.3, 7.6)))
    area = np.where(np.arange(16) < 6, 1.0, 0.05) * np.ones((16, 1))
    moved = stitched(image, cuts, np.zeros((16, 16), int), area, 0.2 * np.ones((16, 16)))
    assert (moved != image).any()
    assert moved.min() >= image.min() and moved.max() <= image.max()
    assert steps(moved, cuts).mean() < steps(image, cuts).mean()


def tile(half: float, chamfer: float, deep: float) -> Mesh:
    """Top at y = 0 and, as surfaces of their own, chamfers whose normals lean from sideways to upwards, and sides."""
    top = half - chamfer
    rings = np.array([
        [(-r, y, -r), (-r, y, r), (r, y, r), (r, y, -r), (-r, y, -r)]
        for r, y in ((half, -deep), (half, -chamfer), (top, 0.0))
    ])  # fmt: skip
    parts = [patch((-top, 0, top), (2 * top, 0, 0), (0, 0, -2 * top))]
    for k, out in enumerate([(-1, 0, 0), (0, 0, 1), (1, 0, 0), (0, 0, -1)]):
        for low, upper in ((0, out), (1, (0, 1, 0))):
            corners = rings[[low, low + 1]][:, [k, k + 1]]
            normals = np.array([[out, out], [upper, upper]], float)
            parts.append(grid(corners, normals, (1, 0, 0), corners[..., [0, 2]]))
    return merge(parts)


@pytest.mark.long
def test_chamfers_leave_no_lines_on_a_floor_of_tiles(tmp_path: Path) -> None:
    """Tops of tiles under an even sky receive pi, also where they meet the chamfers, whose light is less."""
    one, step = tile(0.3, 0.003, 0.01), 0.602
    tiles = merge(placed(one, (step * x, 0, step * z)) for x in (-1, 0, 1) for z in (-1, 0, 1))
    even = ConstantEnvironment((1.0, 1.0, 1.0))
    scene = Scene("tiles", (SceneObject("tiles", tiles, "black"),), {"black": BLACK}, environment=even)
    store = bake(scene, tmp_path / "s", quality=TINY.changed("tiles", geometry={"texels": 100}), only=("light_map",))
    image = store.read("light_map/irradiance")[..., 1].astype(float)
    geometry = {name: store.read(f"geometry/{name}") for name in ("positions", "uv2", "faces")}
    corners = geometry["positions"][geometry["faces"]]
    top = (corners[..., 1] > -1e-6).all(axis=1)
    weights = np.random.default_rng(0).dirichlet((0.3, 0.3, 0.3), (top.sum(), 400))  # mostly near the borders
    uv = np.einsum("fnc,fcx->fnx", weights, geometry["uv2"][geometry["faces"][top]].astype(float)).reshape(-1, 2)
    height, width = image.shape
    found = map_coordinates(image, [uv[:, 1] * height - 0.5, uv[:, 0] * width - 0.5], order=1, mode="nearest")
    assert found.mean() == pytest.approx(np.pi, rel=0.01)
    assert np.quantile(found, 0.01) > 0.95 * np.pi
