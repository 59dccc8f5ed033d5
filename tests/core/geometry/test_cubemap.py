"""Cube maps: faces as in WebGPU's table, look-ups, and solid angles."""

from __future__ import annotations

import numpy as np

from lambent.core.geometry.cubemap import directions_at, face_directions, on_face, sample, texel_solid_angles

# WebGPU, "Texture views": the axis of each face, and where its columns and rows run.
FACES = {
    "+x": "-z -y", "-x": "+z -y", "+y": "+x +z", "-y": "+x -z", "+z": "+x -y", "-z": "-x -y",
}  # fmt: skip


def axis(name: str) -> np.ndarray:
    return np.eye(3)["xyz".index(name[1])] * (1 if name[0] == "+" else -1)


def test_faces_are_those_of_webgpu() -> None:
    at = np.linspace(-0.75, 0.75, 4)  # centres of 4 texels
    for number, (face, (columns, rows)) in enumerate((face, axes.split()) for face, axes in FACES.items()):
        expected = axis(face) + at[:, None] * axis(columns) + at[:, None, None] * axis(rows)
        assert np.allclose(face_directions(4)[number], expected), face
        there = directions_at(np.array([number]), np.array([0.3]), np.array([-0.6]))
        assert np.allclose(there, axis(face) + 0.3 * axis(columns) - 0.6 * axis(rows)), face
        for found, wanted in zip(on_face(5 * there), (number, 0.3, -0.6), strict=True):
            assert np.allclose(found, wanted), face


def test_look_ups_are_bilinear_within_a_face() -> None:
    cube = np.random.default_rng(1).random((6, 4, 4, 2))
    w = face_directions(4)
    assert np.allclose(sample(cube, w), cube)
    assert np.allclose(sample(cube, (w[:, 1:, 1:] + w[:, :-1, :-1]) / 2)[3, 1, 2], cube[3, 1:3, 2:4].mean(axis=(0, 1)))
    assert np.allclose(sample(cube, axis("+y") - 0.99 * axis("+x")), cube[2, 1:3, 0].mean(axis=0)), "clamped"


def test_solid_angles_are_those_of_a_sphere() -> None:
    assert np.isclose(texel_solid_angles(1)[0, 0], 4 * np.pi / 6)
    assert np.isclose(texel_solid_angles(7).sum(), 4 * np.pi / 6)
    small, toward = texel_solid_angles(64), face_directions(64)[0]
    assert np.allclose(small, (2 / 64) ** 2 / np.linalg.norm(toward, axis=-1) ** 3, rtol=1e-3)
