"""Refraction by two faces, against rays traced through panes and lenses by hand."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baked.light_fields.thin_glass import (
    exits_beside,
    mirrored_back,
    refracted,
    sideways,
    through_glass,
)
from lambent.core.geometry.directions import normalize

ETA, DEPTH = 1.5, 0.02


def rays(count: int = 500, most_deg: float = 60.0) -> np.ndarray:
    """Unit directions (count, 3) downwards."""
    rng = np.random.default_rng(2)
    theta, phi = np.radians(most_deg) * np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), -np.cos(theta)], axis=-1)


UP = np.array([0.0, 0.0, 1.0])


def test_snell() -> None:
    w = rays()
    found, passes = refracted(w, np.broadcast_to(UP, w.shape), 1 / ETA)
    assert passes.all()
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1)
    np.testing.assert_allclose(found[:, :2], w[:, :2] / ETA, atol=1e-12)
    back, passes = refracted(rays(most_deg=89), np.broadcast_to(UP, w.shape), ETA)
    beyond = np.linalg.norm(rays(most_deg=89)[:, :2], axis=1) > 1 / ETA
    np.testing.assert_array_equal(passes, ~beyond)
    np.testing.assert_allclose(back[beyond], rays(most_deg=89)[beyond] * [1, 1, -1])


def test_a_pane_displaces_rays_and_keeps_their_direction() -> None:
    """By d tan of the angle inside."""
    w = rays()
    n = np.broadcast_to(UP, w.shape)
    exits = np.broadcast_to([0.0, 0.0, -0.9, DEPTH], (len(w), 4))
    offset, leaving, cosine, share = through_glass(w, n, exits, ETA)
    np.testing.assert_allclose(leaving, w, atol=1e-12)
    np.testing.assert_allclose(offset[:, 2], -DEPTH)
    sine = np.linalg.norm(w[:, :2], axis=1)
    inside = sine / ETA / np.sqrt(1 - (sine / ETA) ** 2)
    np.testing.assert_allclose(np.linalg.norm(offset[:, :2], axis=1), DEPTH * inside)
    np.testing.assert_allclose(cosine, -w[:, 2])
    np.testing.assert_allclose(share, 0.9)


def test_a_sheet_lets_rays_pass() -> None:
    w = rays()
    offset, leaving, cosine, share = through_glass(w, np.broadcast_to(UP, w.shape), np.full((len(w), 4), -1.0), ETA)
    assert (offset == 0).all() and (leaving == w).all() and (cosine == 1).all() and (share == 1).all()


@pytest.mark.parametrize("most_deg", [2.0, 25.0])
def test_a_thin_lens_brings_parallel_light_to_its_focus(most_deg: float) -> None:
    """Plane in front, behind a sphere of radius R: f = R/(eta - 1). Beside rays traced exactly."""
    radius, thickness, rng = 1.0, 0.02, np.random.default_rng(4)
    x = np.concatenate([0.1 * (rng.random((300, 2)) - 0.5), np.zeros((300, 1))], axis=1)
    w = normalize(np.concatenate([np.tan(np.radians(most_deg)) * (rng.random((300, 2)) - 0.5), -np.ones((300, 1))], 1))
    centre = np.array([0.0, 0.0, radius - thickness])
    depth = np.sqrt(radius**2 - (x[:, :2] ** 2).sum(axis=1)) - centre[2]
    normal = (x - [0, 0, 1] * depth[:, None] - centre) / radius
    offset, leaving, _, _ = through_glass(w, np.broadcast_to(UP, x.shape), np.column_stack([normal, depth]), ETA)
    inside, _ = refracted(w, np.broadcast_to(UP, x.shape), 1 / ETA)
    along = np.sum(inside * (x - centre), axis=1)
    t = -along + np.sqrt(along**2 - np.sum((x - centre) ** 2, axis=1) + radius**2)
    exact_at = x + t[:, None] * inside
    exact, _ = refracted(inside, -(exact_at - centre) / radius, ETA)
    turned = np.degrees(np.arccos(np.clip(np.sum(exact * w, axis=1), -1, 1)))
    wrong = np.degrees(np.arccos(np.clip(np.sum(exact * leaving, axis=1), -1, 1)))
    assert wrong.max() < 0.12 * turned.max()
    assert np.abs(offset - (exact_at - x)).max() < 0.15 * thickness
    if most_deg < 5:
        focal = radius / (ETA - 1)
        slope = leaving[:, :2] / -leaving[:, 2:] - w[:, :2] / -w[:, 2:]
        np.testing.assert_allclose(slope, -x[:, :2] / focal, atol=2e-3)


def test_oblique_rays_leave_a_lens_by_the_face_behind_their_exit() -> None:
    """Up to 40 degrees: with the plane behind their entry alone, they err by four times as much and more."""
    radius, thickness, rng = 1.0, 0.05, np.random.default_rng(4)
    centre = np.array([0.0, 0.0, radius - thickness])

    def exits(x: np.ndarray) -> np.ndarray:
        depth = np.sqrt(radius**2 - (x[:, :2] ** 2).sum(axis=1)) - centre[2]
        return np.column_stack([(x - [0, 0, 1] * depth[:, None] - centre) / radius, depth])

    x = np.concatenate([0.2 * (rng.random((300, 2)) - 0.5), np.zeros((300, 1))], axis=1)
    w, n = rays(300, 40.0), np.broadcast_to(UP, x.shape)
    inside, _ = refracted(w, n, 1 / ETA)
    along = np.sum(inside * (x - centre), axis=1)
    t = -along + np.sqrt(along**2 - np.sum((x - centre) ** 2, axis=1) + radius**2)
    exact, passes = refracted(inside, -(x + t[:, None] * inside - centre) / radius, ETA)
    step = sideways(through_glass(w, n, exits(x), ETA)[0], n)
    wrong = []
    for of in (exits(x), exits_beside(exits(x), exits(x + step), step, n)):
        _, leaving, _, _ = through_glass(w, n, of, ETA)
        wrong.append(np.degrees(np.arccos(np.clip(np.sum(exact * leaving, axis=1), -1, 1)))[passes])
    assert passes.mean() > 0.9 and np.median(wrong[1]) < 0.25 * np.median(wrong[0])
    assert np.quantile(wrong[1], 0.95) < 0.25 * np.quantile(wrong[0], 0.95)


def test_another_face_beside_does_not_continue_the_exit() -> None:
    """Sheets, faces round an edge, and faces that the ray does not leave by."""
    here = np.array([[0.0, 0.0, -0.9, DEPTH]])
    n, step = UP[None], np.array([[0.01, 0.0, 0.0]])
    for beside in ([0.9, 0.0, 0.0, DEPTH], [0.0, 0.0, 0.9, DEPTH], [0.0, 0.0, -0.9, -1.0]):
        np.testing.assert_array_equal(exits_beside(here, np.array([beside]), step, n), here)
    tilted = np.array([[-np.sin(0.2), 0.0, -np.cos(0.2), DEPTH]])  # passes DEPTH below the place beside
    found = exits_beside(here, tilted, step, n)
    np.testing.assert_allclose(found[0, 3], DEPTH + 0.01 * np.tan(-0.2))


def test_clear_glass_in_even_light_is_as_bright_as_what_is_behind_it() -> None:
    """However many faces there are; each that is coloured takes its part."""
    cosine = np.cos(np.radians([0, 40, 60]))
    fresnel = 0.04 + 0.96 * (1 - cosine) ** 5
    for faces in (0, 2, 6):
        share = np.full(3, 0.96**faces)
        back = mirrored_back(cosine, share, 1.5, (0.96, 0.96, 0.96))
        np.testing.assert_allclose(back, 1 - (1 - fresnel) * share, rtol=1e-9)
        assert ((1 - fresnel) * share + 0.96 * back > 0.96).all()
    np.testing.assert_allclose(
        mirrored_back(cosine, np.full(3, 0.48**2), 1.5, (0.48,) * 3), 1 - (1 - fresnel) * 0.96**2
    )
