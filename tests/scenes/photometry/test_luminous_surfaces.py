"""Luminaires of a scene.toml that shine from the openings of their files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.triangles import triangle_areas, triangle_normals
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import Scene

SCENE = """format = "lambent-scene"
version = 1
name = "sized"
geometry = "floor.obj"

[[lights]]
kind = "point"
position = [0.0, 1.0, 0.0]
candela = 3.0

[[lights]]
kind = "ies"
file = "lamp.ies"
position = [0.5, 2.0, -0.25]
direction = [0.0, 0.0, -1.0]
name = "panel"
opening = "{opening}"
"""
FLOOR = "o panel\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nf 1 2 3 4\n"


def loaded(folder: Path, size: str, candela: str = "100 50 0", opening: str = "file", angles: str = "0 45 90") -> Scene:
    (folder / "floor.obj").write_text(FLOOR)
    numbers = f"1 -1 1 {len(angles.split())} 1 1 2 {size}\n1 1 9\n{angles}\n0\n{candela}\n"
    (folder / "lamp.ies").write_text(f"IESNA:LM-63-2002\n[TEST] t\nTILT=NONE\n{numbers}")
    (folder / "scene.toml").write_text(SCENE.format(opening=opening))
    return load_scene(folder / "scene.toml")


def test_a_rectangle_faces_where_the_luminaire_is_aimed(tmp_path: Path) -> None:
    scene = loaded(tmp_path, "0.2 1.2 0")
    (panel,) = (o for o in scene.objects if o.luminaire is not None)
    assert panel.name == "panel_2", "the floor has the name already"
    low, high = panel.mesh.positions.min(axis=0), panel.mesh.positions.max(axis=0)
    np.testing.assert_allclose((low + high) / 2, (0.5, 2.0, -0.25), atol=1e-6)
    np.testing.assert_allclose(high - low, (1.2, 0.2, 0.0), atol=1e-6)  # the length is along horizontal angle 0
    np.testing.assert_allclose(triangle_normals(panel.mesh.corners), [[0, 0, -1]] * 2, atol=1e-6)
    np.testing.assert_allclose(panel.mesh.normals, [[0, 0, -1]] * 4, atol=1e-6)
    assert min(panel.emission) > 0 and panel.emission[0] == pytest.approx(panel.emission[2])


@pytest.mark.parametrize(
    ("size", "extent", "area"),
    [
        ("-0.3 -0.3 0", (0.3, 0.3, 0.0), np.pi * 0.0225),
        ("-0.04 1.2 -0.04", (1.2, 0.04, 0.04), np.pi * 0.04 * 1.2 + 2 * np.pi * 0.0004),
        ("-0.3 -0.3 -0.3", (0.3, 0.3, 0.3), np.pi * 0.09),
        ("0.2 0.4 0.1", (0.4, 0.2, 0.1), 2 * (0.08 + 0.02 + 0.04)),
    ],
)
def test_round_and_solid_openings_have_the_sizes_of_their_file(
    tmp_path: Path, size: str, extent: tuple[float, ...], area: float
) -> None:
    (panel,) = (o for o in loaded(tmp_path, size).objects if o.luminaire is not None)
    x, y, z = extent  # z is along the axis, here the world's -z; y the world's y
    found = np.ptp(panel.mesh.positions, axis=0)
    np.testing.assert_allclose(found, (x, y, z), atol=0.003)
    assert float(triangle_areas(panel.mesh.corners).sum()) == pytest.approx(area, rel=0.01)
    centre = panel.mesh.positions.mean(axis=0)
    out = np.einsum("ij,ij->i", triangle_normals(panel.mesh.corners), panel.mesh.corners.mean(axis=1) - centre)
    assert (out >= -1e-6).all(), "faces look outwards"


def test_a_flat_opening_that_shines_backwards_too_is_a_thin_box(tmp_path: Path) -> None:
    scene = loaded(tmp_path, "0.2 0.4 0", "100 50 0 50 100", angles="0 45 90 135 180")
    (panel,) = (o for o in scene.objects if o.luminaire is not None)
    assert len(panel.mesh.faces) == 12 and 0 < np.ptp(panel.mesh.positions[:, 2]) < 0.005


def test_points_stay_points_and_other_openings_are_refused(tmp_path: Path) -> None:
    assert len(loaded(tmp_path, "0.2 0.4 0", opening="point").lights) == 2
    assert len(loaded(tmp_path, "0 0 0").lights) == 2, "the file has no opening"
    with pytest.raises(UserError, match="opening"):
        loaded(tmp_path, "0.2 0.4 0", opening="disc")
