"""Meshes keep the patches that they were made of: moved, mirrored, merged, divided, cut."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.bake.probes.division import sub_mesh
from lambent.bake.surfaces.cutting import cut, cut_across
from lambent.core.geometry import triangle_normals
from lambent.scenes.geometry import bezier, merge, patch, placed, sphere, subdivided, teapot, transformed, turn
from lambent.scenes.loaders.meshes.creases import creased
from lambent.scenes.mesh import NO_PATCH, Mesh

POT = teapot(0.25, 6)
MATRICES = {
    "moved": np.array([[1, 0, 0, 2], [0, 1, 0, 3], [0, 0, 1, 4], [0, 0, 0, 1.0]]),
    "stretched": np.diag([2.0, 0.5, 3.0, 1.0]),
    "mirrored": np.diag([-1.0, 1.0, 1.0, 1.0]),
    "sheared": np.array([[1, 0.4, 0, 0], [0, 1, 0, 0], [0.2, 0, 1, 0], [0, 0, 0, 1.0]]),
}


def check(mesh: Mesh, on_patches: float = 1.0, tolerance_m: float = 1e-6) -> None:
    """Vertices are where their patch has their parameters; normals are those of the patch, but for the side."""
    patches = mesh.patches
    assert patches is not None and len(patches.number) == len(patches.uv) == len(mesh.positions)
    mine = patches.number >= 0
    place = patches.control[patches.number[mine]], *patches.uv[mine].T
    assert np.abs(bezier.positions(*place) - mesh.positions[mine]).max() < tolerance_m
    assert (mesh.patch_of_faces >= 0).mean() == pytest.approx(on_patches, abs=0.02)


@pytest.mark.parametrize("name", MATRICES)
def test_transforms_carry_control_points(name: str) -> None:
    moved = transformed(POT, MATRICES[name])
    check(moved)
    assert moved.patches is not None
    exact = bezier.normals(moved.patches.control[moved.patches.number], *moved.patches.uv.T)
    assert np.abs((exact * moved.normals).sum(axis=1)).min() > 0.9999
    flat = triangle_normals(moved.corners)
    outside = (flat * moved.normals[moved.faces].sum(axis=1)).sum(axis=1) > 0
    assert outside.mean() > 0.99, "the outside stays outside, but for folds of a few long triangles"


def test_placing_turns_patches() -> None:
    check(placed(POT, (1, 2, 3), turn("y", 30)))


def test_merging_numbers_patches_one_mesh_after_the_other() -> None:
    both = merge([sphere(0.1), POT, patch((0, 0, 0), (1, 0, 0), (0, 1, 0)), placed(POT, (1, 0, 0))])
    check(both, 2 * len(POT.faces) / len(both.faces))
    assert both.patches is not None and len(both.patches.control) == 64
    assert set(both.patches.number.tolist()) == {NO_PATCH, *range(64)}
    assert merge([sphere(0.1), sphere(0.2)]).patches is None


def test_splitting_and_taking_parts() -> None:
    check(creased(POT, 20.0))
    part = sub_mesh(POT, np.arange(0, len(POT.faces), 3))
    check(part)


def test_new_vertices_lie_between_parameters() -> None:
    """They lie on triangles, whose places on the patch are those of their parameters; on flat patches, exactly."""
    for mesh in (subdivided(POT, 1e-3, 4 * len(POT.faces)), cut_across(POT, (1.0, 0.3, 0.2, 0.01))):
        assert len(mesh.positions) > len(POT.positions)
        check(mesh, tolerance_m=0.01)
    from lambent.scenes.geometry.tessellation import tessellated
    from tests.scenes.test_bezier import sheet

    large = tessellated(sheet()[None] * 100, 1)
    for mesh in (cut_across(large, (1.0, 0.5, 0.0, -37.0)), cut(large, np.zeros((1, 3)), 5.0)):
        assert len(mesh.positions) > 4
        check(mesh, tolerance_m=1e-4)


def test_vertices_between_two_patches_are_of_none() -> None:
    assert POT.patches is not None
    pair = np.array([[0, len(POT.positions) - 1]])
    longer = POT.patches.with_vertices_between(pair, np.full((1, 1), 0.5))
    assert longer.number[-1] == NO_PATCH
