"""Seams of the light map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lambent.bake.light.seams import blend_seams
from lambent.bake.light.stitching import Cuts
from lambent.bake.surfaces.texels import BEYOND, POINTS, Texels

N, GAP = 20, 4
ROWS = (np.arange(N) + 0.5) / N
EDGES = (N - 1e-3) / (2 * N + GAP), (N + GAP + 1e-3) / (2 * N + GAP)
CUT = Cuts(*(np.stack([np.full(N, edge), ROWS], axis=-1) for edge in EDGES))
NO_CUT = Cuts(np.zeros((0, 2)), np.zeros((0, 2)))


def two_charts(height: float) -> tuple[Texels, np.ndarray, np.ndarray]:
    """Two squares of N texels of 1 m that meet at x = N in the scene, apart in the map; the second `height` higher."""
    width = 2 * N + GAP
    labels = np.full((N, width), -1)
    labels[:, :N], labels[:, N + GAP :] = 0, 1
    index = np.flatnonzero(labels >= 0)
    row, column = np.divmod(index, width)
    second = column >= N
    position = np.stack([column + 0.5 - GAP * second, height * second, row + 0.5], axis=-1)
    points = np.repeat(position[:, None], POINTS, axis=1).astype(np.float32)
    up = np.broadcast_to(np.float32([0, 1, 0]), points.shape)
    texels = Texels(
        width, N, index, np.zeros((len(index), POINTS), int), points, up, up, np.ones(len(index)), np.ones(len(index))
    )
    return texels, labels, np.where(labels == 1, 1.2, 1.0)[..., None] * np.ones(3)


def test_a_step_at_a_seam_becomes_a_slope() -> None:
    texels, labels, image = two_charts(height=0.0)
    blended = blend_seams(image, labels >= 0, texels, labels, CUT)
    left, right = blended[:, N - 1], blended[:, N + GAP]
    assert np.abs(right - left).max() < 0.1 < 0.2
    assert np.allclose(blended[5:-5, 5:14], 1.0) and np.allclose(blended[5:-5, N + GAP + 6 : -5], 1.2)


def test_what_lies_above_is_not_mixed_in() -> None:
    texels, labels, image = two_charts(height=2.0)
    assert np.allclose(blend_seams(image, labels >= 0, texels, labels, CUT)[:, :N], 1.0, atol=1e-3)


def test_texels_that_were_not_sampled_do_not_count() -> None:
    texels, labels, image = two_charts(height=0.0)
    assert np.allclose(blend_seams(image, labels == 0, texels, labels, CUT)[:, :N], 1.0)


def test_triangles_without_area_and_hidden_parts_are_left_alone() -> None:
    texels, labels, image = two_charts(height=0.0)
    with np.errstate(all="raise"):
        bare = replace(texels, spacing=np.zeros(len(texels.index)))
        assert (blend_seams(image, labels >= 0, bare, labels, CUT) == image).all()
    hidden = np.where(labels == 1, 1 + BEYOND, labels)
    assert np.allclose(blend_seams(image, labels >= 0, texels, hidden, CUT)[:, :N], 1.0)


def test_charts_that_no_cut_parts_keep_their_light() -> None:
    """Mouldings side by side, which face the same way, are two surfaces."""
    texels, labels, image = two_charts(height=0.0)
    np.testing.assert_allclose(blend_seams(image, labels >= 0, texels, labels, NO_CUT), image)
