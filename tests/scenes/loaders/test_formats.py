"""Formats of scenes are found: a module with NAME, ENDINGS and load among the loaders is one more."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.scenes import load_scene, loaders
from lambent.scenes.loaders.load import formats, is_scene

TOY = '''
from lambent.scenes.geometry import box
from lambent.scenes.loaders.contents import Contents
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.materials.document import Material
from lambent.scenes.scene import SceneObject

NAME, ENDINGS = "Toy", (".toy",)


def recognise(head):
    return head.startswith(b"toy")


def load(path, options):
    """A cube of the size that the file names."""
    files = SceneFiles(path, options.root)
    size = float(files.read(path, 100).split()[1])
    return Contents((SceneObject("cube", box((size,) * 3), "wood"),), {"wood": Material(name="wood", kd=(0.5,) * 3)},
                    sources=tuple(files.sources))
'''


@pytest.fixture
def toy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file of a format that a folder beside the loaders adds."""
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "toy_format.py").write_text(TOY)
    monkeypatch.setattr(loaders, "__path__", [*loaders.__path__, str(tmp_path / "more")])
    path = tmp_path / "cube.toy"
    path.write_text("toy 3")
    return path


def test_a_new_format_is_one_file(toy: Path) -> None:
    assert "Toy" in {module.NAME for module in formats()}
    scene = load_scene(toy)
    assert np.array_equal(scene.bounds, [(-1.5,) * 3, (1.5,) * 3]) and scene.sources == (toy,)
    assert scene.environment is not None and len(scene.cameras) == 1
    assert is_scene(toy, b"toy 3") and not is_scene(toy, b"boy 3")
    (toy.parent / "scene.toml").write_text(
        'format = "lambent-scene"\nversion = 1\ngeometry = { file = "cube.toy", scale = 2.0 }\n'
    )
    assert load_scene(toy.parent / "scene.toml").object("cube").mesh.bounds[1].tolist() == [3.0, 3.0, 3.0]


def test_what_no_loader_reads_is_told_with_every_ending(tmp_path: Path) -> None:
    (tmp_path / "a.fbx").touch()
    with pytest.raises(UserError, match=r"unknown scene format; found .fbx; expected .bpt, .*.gltf, .*.ply, .toml"):
        load_scene(tmp_path / "a.fbx")
    with pytest.raises(UserError, match=r"unknown scene format; found a folder; expected .bpt"):
        load_scene(tmp_path)
    with pytest.raises(
        UserError, match=r"found rom; expected box, cornell, .*, room, teatray, vase; did you mean 'room'"
    ):
        load_scene("builtin:rom")
