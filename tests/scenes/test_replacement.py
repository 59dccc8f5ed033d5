"""Meshes that stand in the place of objects: what is asked for, and the scene that is path traced."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.replacement import parse_replacements, with_replacements

TRIANGLES = "v 0 0 0\nv 2 0 0\nv 0 4 0\nv 0 0 2\nf 1 2 3\no other\nf 1 3 4\n"


@pytest.fixture
def mesh(tmp_path: Path) -> Path:
    file = tmp_path / "a.obj"
    file.write_text(TRIANGLES)
    return file


def test_all_objects_of_a_file_stand_in_the_box(mesh: Path) -> None:
    (one,) = parse_replacements([f"sphere={mesh}"])
    assert (one.object, one.material, len(one.mesh.faces)) == ("sphere", None, 2)
    scene = load_scene("builtin:box")
    changed = with_replacements(scene, [one])
    before, after = scene.object("sphere"), changed.object("sphere")
    low, high = before.mesh.bounds
    assert after.material == before.material
    np.testing.assert_allclose(
        np.ptp(after.mesh.positions, axis=0), np.array([0.5, 1, 0.5]) * (high - low)[1], rtol=1e-5
    )
    np.testing.assert_allclose(after.mesh.bounds[0][1], low[1], atol=1e-6)
    assert [o.name for o in changed.objects] == [o.name for o in scene.objects]
    other = next(name for name in scene.materials if name != before.material)
    (named,) = parse_replacements([f"sphere={mesh},{other}"])
    assert with_replacements(scene, [named]).object("sphere").material == other


def test_a_file_may_have_a_comma_in_its_name(tmp_path: Path) -> None:
    file = tmp_path / "a,b.obj"
    file.write_text(TRIANGLES)
    assert parse_replacements([f"sphere={file}"])[0].material is None


@pytest.mark.parametrize("text", ["sphere", "=a.obj", "sphere=", "sphere=a.obj,"])
def test_what_is_no_replacement_is_refused(text: str) -> None:
    with pytest.raises(UserError, match=r"--replace.*OBJECT=FILE"):
        parse_replacements([text])


def test_wrong_names_and_files_are_told(mesh: Path, tmp_path: Path) -> None:
    scene = load_scene("builtin:box")
    for text, message in (
        (f"spere={mesh}", "did you mean 'sphere'"),
        (f"sphere={mesh},nothing", "--replace.*nothing"),
    ):
        with pytest.raises(UserError, match=message):
            with_replacements(scene, parse_replacements([text]))
    with pytest.raises(UserError, match="twice"):
        parse_replacements([f"sphere={mesh}"] * 2)
    with pytest.raises(UserError, match=r"none\.obj"):
        parse_replacements([f"sphere={tmp_path / 'none.obj'}"])
    empty = tmp_path / "empty.obj"
    empty.write_text("v 0 0 0\n")
    with pytest.raises(UserError):
        parse_replacements([f"sphere={empty}"])
