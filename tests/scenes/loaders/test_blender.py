"""Blender's files where there is no Blender, an old one, or one that fails: stand-ins for the program on PATH."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from lambent.core.errors import UserError
from lambent.scenes.loaders import blender
from lambent.scenes.loaders.load import load_scene

PROGRAM = """#!{python}
import json, sys
open({asked!r}, "w").write(json.dumps(sys.argv[1:]))
{does}
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "my room.blend"
    path.write_bytes(b"BLENDER-v500")
    return path


def blender_that(does: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Put a program `blender` on PATH that writes its arguments into the returned file, then `does`."""
    program, asked = tmp_path / "bin" / "blender", tmp_path / "asked.json"
    program.parent.mkdir()
    program.write_text(PROGRAM.format(python=sys.executable, asked=str(asked), does=does))
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(program.parent), prepend=":")
    return asked


def test_without_blender_one_line_says_what_to_install(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = blender.find_spec
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(blender, "find_spec", lambda name: None if name == "bpy" else found(name))
    with pytest.raises(UserError, match=r"needs Blender to be read.*`pip install --no-deps bpy`.*or export glTF"):
        load_scene(file)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"none\.blend: cannot be read \(no such file\)"):
        load_scene(tmp_path / "none.blend")


def test_blender_on_path_exports_beside_the_file(file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "my room.lambent" / "scene.toml"
    target.parent.mkdir()
    text = (Path(blender.__file__).parents[2] / "scenes/builtin/box.toml").read_text("utf-8")
    target.write_text(text)
    answer = json.dumps({"scene": str(target), "notes": ["a volume is left out"]})
    asked = blender_that(f"print('noise'); print('lambent: ' + {answer!r})", tmp_path, monkeypatch)
    scene = load_scene(file)
    assert scene.origin == str(target) and scene.warnings[0] == "a volume is left out"
    *options, script, end, blend, folder = json.loads(asked.read_text())
    assert options == ["--background", "--factory-startup", "--disable-autoexec", "--python"] and end == "--"
    assert Path(script).is_file() and (blend, folder) == (str(file), str(target.parent))


@pytest.mark.parametrize(
    ("does", "said"),
    [
        ('print(\'lambent: {"error": "scene Scene has nothing to export"}\')', r"room\.blend: scene Scene has nothing"),
        (
            "print('Error: not a blend file', file=sys.stderr); sys.exit(11)",
            r"Blender ended with code 11: Error: not a",
        ),
        ("sys.exit(0)", r"Blender ended with code 0: no message"),
    ],
)
def test_blender_that_fails_is_one_line(
    does: str, said: str, file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blender_that(does, tmp_path, monkeypatch)
    with pytest.raises(UserError, match=said) as caught:
        load_scene(file)
    assert "\n" not in str(caught.value)
