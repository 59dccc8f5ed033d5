"""Luminous openings: the signs of IES files, and silhouettes by quadrature over the surface."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry.directions import direction
from lambent.scenes.photometry.opening import Opening, opening_of_signs

CYLINDER, ELLIPSOID = "cylinder", "ellipsoid"


@pytest.mark.parametrize(
    ("signs", "expected", "words"),
    [
        ((0, 0, 0), Opening(), "point"),
        ((0.5, 2, 0), Opening("box", (2, 0.5, 0)), "rectangle, 2 x 0.5 x 0 m"),
        ((0.5, 2, 0.1), Opening("box", (2, 0.5, 0.1)), "box, 2 x 0.5 x 0.1 m"),
        ((-0.5, -0.5, 0), Opening(CYLINDER, (0.5, 0.5, 0)), "disc, 0.5 x 0.5 x 0 m"),
        ((-0.5, -2, 0), Opening(CYLINDER, (2, 0.5, 0)), "disc, 2 x 0.5 x 0 m"),
        ((-0.5, -0.5, 3), Opening(CYLINDER, (0.5, 0.5, 3)), "cylinder, 0.5 x 0.5 x 3 m"),
        ((-0.5, -2, 3), Opening(CYLINDER, (2, 0.5, 3)), "cylinder, 2 x 0.5 x 3 m"),
        ((-0.5, -0.5, -0.5), Opening(ELLIPSOID, (0.5, 0.5, 0.5)), "ellipsoid, 0.5 x 0.5 x 0.5 m"),
        ((-0.5, -2, -1), Opening(ELLIPSOID, (2, 0.5, 1)), "ellipsoid, 2 x 0.5 x 1 m"),
        ((-0.1, 2, -0.1), Opening(CYLINDER, (2, 0.1, 0.1), 0), "cylinder along x, 2 x 0.1 x 0.1 m"),
        ((2, -0.1, -0.1), Opening(CYLINDER, (0.1, 2, 0.1), 1), "cylinder along y, 0.1 x 2 x 0.1 m"),
        ((-0.1, 0, -0.1), Opening(CYLINDER, (0, 0.1, 0.1), 0), "disc, 0 x 0.1 x 0.1 m"),
        ((-0.1, 0, -0.3), Opening(CYLINDER, (0, 0.1, 0.3), 0), "disc, 0 x 0.1 x 0.3 m"),
    ],
)
def test_signs_of_2002_and_2019(signs: tuple[float, float, float], expected: Opening, words: str) -> None:
    """Width along horizontal angle 90, length along 0, height."""
    assert opening_of_signs(*signs) == expected and str(expected) == words


@pytest.mark.parametrize(
    ("signs", "expected"),
    [
        ((-0.5, 0, 0), Opening(CYLINDER, (0.5, 0.5, 0))),
        ((-0.5, 0, -0.5), Opening(ELLIPSOID, (0.5, 0.5, 0.5))),
        ((-0.5, 0, 2), Opening(CYLINDER, (0.5, 0.5, 2))),
        ((0, 2, -0.1), Opening(CYLINDER, (2, 0.1, 0.1), 0)),
        ((2, 0, -0.1), Opening(CYLINDER, (0.1, 2, 0.1), 1)),
        ((-0.5, 2, 0.3), Opening(CYLINDER, (2, 0.5, 0.3))),
        ((2, -0.5, 0.3), Opening(CYLINDER, (0.5, 2, 0.3))),
        ((-0.5, 2, -0.3), Opening(ELLIPSOID, (2, 0.5, 0.3))),
        ((2, -0.5, -0.3), Opening(ELLIPSOID, (0.5, 2, 0.3))),
        ((0.5, 2, 0), Opening("box", (2, 0.5, 0))),
    ],
)
def test_signs_up_to_1995(signs: tuple[float, float, float], expected: Opening) -> None:
    assert opening_of_signs(*signs, ellipsoids=True) == expected


def surface(opening: Opening) -> tuple[np.ndarray, np.ndarray]:
    """Normals times areas (n, 3) of small pieces of the closed surface, by differences of its points."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 721), np.linspace(0, np.pi, 361), indexing="ij")
    half = np.array(opening.size_m) / 2
    if opening.shape == "ellipsoid":
        parts = [np.stack([np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)], axis=-1)]
    elif opening.shape == "box":
        s, t = np.meshgrid([-1.0, 1.0], [-1.0, 1.0], indexing="ij")
        parts = [np.stack(np.roll([s, t, 0 * s + end], k, axis=0), axis=-1) for k in range(3) for end in (-1, 1)]
    else:
        flat = [v / np.pi * np.cos(u), v / np.pi * np.sin(u)]
        sides = [np.cos(u), np.sin(u), 2 * v / np.pi - 1]
        parts = [
            np.stack(np.roll(p, opening.axis + 1, axis=0), axis=-1)
            for p in (sides, [*flat, 0 * u - 1], [*flat, 0 * u + 1])
        ]
    pieces = []
    for part in parts:
        p = part * half
        pieces.append(np.cross(p[1:, 1:] - p[:-1, :-1], p[:-1, 1:] - p[1:, :-1]).reshape(-1, 3) / 2)
    return np.concatenate(pieces)


@pytest.mark.parametrize(
    "opening",
    [
        Opening("box", (2, 0.5, 0)), Opening("box", (2, 0.5, 0.7)), Opening(CYLINDER, (0.5, 0.5, 0)),
        Opening(CYLINDER, (2, 0.5, 0.7)), Opening(CYLINDER, (2, 0.5, 0.7), 0), Opening(CYLINDER, (2, 0.5, 0.7), 1),
        Opening(CYLINDER, (0, 0.5, 0.7), 0), Opening(ELLIPSOID, (2, 0.5, 0.7)),
    ],
    ids=str,
)  # fmt: skip
def test_silhouettes(opening: Opening) -> None:
    """Of a closed convex surface, half the integral of |n.w|."""
    w = direction(np.radians([0, 25, 60, 90, 90, 90, 130]), np.radians([0, 40, 200, 0, 30, 90, 300]))
    expected = np.abs(surface(opening) @ w.T).sum(axis=0) / 2
    assert opening.projected_m2(w) == pytest.approx(expected, rel=2e-4, abs=1e-9)
    assert opening.projected_m2(w[1]).shape == ()


def test_a_point_has_no_silhouette() -> None:
    assert Opening().projected_m2(np.eye(3)) == pytest.approx([0, 0, 0])
