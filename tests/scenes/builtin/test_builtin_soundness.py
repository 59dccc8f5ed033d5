"""What every built-in scene must be: sound meshes, closed but for its sheets, materials that conserve energy."""

from __future__ import annotations

from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from lambent.core.geometry.triangles import triangle_normals
from lambent.materials.bsdf import MaterialBSDF
from lambent.scenes import builtin, load_scene, validate
from lambent.scenes.geometry import signed_volume
from lambent.scenes.scene import Scene
from tests.scenes.geometry.test_geometry import boundary_edges

# Objects that are sheets, or end in others.
OPEN = {
    "room": "floor_tiles_light floor_tiles_dark grout walls window_reveal ceiling shell curtains screen_pane terrace "
    "lawn hedge lamp_cap teapot",
    "box": "floor ceiling back left right",
    "teatray": "teapot teapot_spout teapot_handle teapot_knob",
    "earrings": "cloth",
    "cornell": "floor ceiling back_wall left_wall right_wall lamp",
    "vase": "",
    "loft": "",
    "ring": "",
    "pavilion": "teapot cloth lawn",
}
TEXTURED = {"teatray": {"wood"}, "vase": {"table", "flowers"}, "loft": {"floor", "books", "toys"},
            "pavilion": {"deck", "cloth"}}  # fmt: skip


@pytest.fixture(scope="module", params=list(OPEN))
def scene(request: pytest.FixtureRequest) -> Scene:
    return load_scene(f"builtin:{request.param}")


def name_of(scene: Scene) -> str:
    return str(scene.origin).removeprefix("builtin:")


def test_no_fault_is_found(scene: Scene) -> None:
    assert scene.warnings == () and validate(scene) == []
    names = [o.name for o in scene.objects]
    assert len(set(names)) == len(names)


def test_closed_objects_are_closed_and_face_outwards(scene: Scene) -> None:
    for o in scene.objects:
        shading = o.mesh.normals[o.mesh.faces]
        assert np.einsum("tk,tvk->tv", triangle_normals(o.mesh.corners), shading).min() > 0, o.name
        if o.name not in OPEN[name_of(scene)].split():
            assert boundary_edges(o.mesh) == 0, o.name
            middle = np.mean(o.mesh.bounds, axis=0).astype(np.float32)
            assert signed_volume(replace(o.mesh, positions=o.mesh.positions - middle)) > 0, o.name


def test_materials_reflect_no_more_than_arrives(scene: Scene) -> None:
    theta = np.radians([0, 30, 60, 80])
    wo = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=-1)
    for name, material in scene.materials.items():
        assert MaterialBSDF(material).albedo(wo).max() < 1.02, name


def test_textures_have_a_mean_of_one(scene: Scene) -> None:
    assert set(scene.textures) == TEXTURED.get(name_of(scene), set())
    for name, textures in scene.textures.items():
        assert textures.diffuse is not None
        texels = textures.diffuse.texels.astype(float)
        assert texels.mean(axis=(0, 1)) == pytest.approx(1, abs=0.01)
        assert (texels * scene.materials[name].kd).max() < 0.9


def test_a_copy_of_its_file_is_the_same_scene(scene: Scene, tmp_path: Path) -> None:
    """Each .toml names its geometry, so that it may be copied anywhere and changed; a byte order mark is ignored."""
    for mark in ("", "\ufeff"):
        copy = tmp_path / "scene.toml"
        copy.write_text(mark + (files(builtin) / f"{name_of(scene)}.toml").read_text("utf-8"), "utf-8")
        other = load_scene(copy)
        assert other.materials == scene.materials and other.cameras == scene.cameras and other.sources == (copy,)
        assert [o.name for o in other.objects] == [o.name for o in scene.objects]
