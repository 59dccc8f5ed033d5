"""`lambent edit` says what is wrong in one line before it opens a window."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from lambent.core.errors import UserError
from lambent.materials.document import Material
from lambent.viewer.modes.material.mode import MaterialState
from lambent.viewer.screen import Screen
from tests.viewer.editor.measured_specimens import BRASS, write_measurement

ROOT = Path(__file__).parents[3]


def opened(folder, file, material=None, environments=()):
    """State of the material mode."""
    return MaterialState.of(file, material, environments, Screen(folder))


@pytest.mark.long
def test_without_a_display(tmp_path):
    Material(name="plain", kd=0.5).save(tmp_path / "plain.json")
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-m", "lambent.cli.main", "edit", str(tmp_path / "plain.json")]
    done = subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        "lambent: error: no display; the editor needs a display; without one, use `lambent fit --plot`"
    ]


@pytest.mark.parametrize(
    ("file", "says"),
    [
        ("missing.bsdf", "cannot be read"),
        ("light.hdr", "is a picture"),
        ("junk.txt", "unknown format of measured material"),
        ("bad.json", "kd"),
    ],
)
def test_what_cannot_be_shown(tmp_path, file, says):
    (tmp_path / "junk.txt").write_text("hello")
    (tmp_path / "bad.json").write_text('{"kd": -1}')
    with pytest.raises(UserError, match=says):
        opened(tmp_path, tmp_path / file)


def test_the_order_does_not_matter(tmp_path):
    BRASS.save(tmp_path / "brass.json")
    file = write_measurement(tmp_path / "brass.txt", BRASS)
    for pair in ((file, tmp_path / "brass.json"), (tmp_path / "brass.json", file)):
        editor = opened(tmp_path, *pair).editor
        assert editor.measurement.path == file and editor.subject.material == BRASS


def test_environments_are_named_and_found(tmp_path):
    from lambent.core.pictures.images import write_image
    from lambent.scenes.sky.environments import dusk

    Material(name="a", kd=0.5).save(tmp_path / "a.json")
    write_image(tmp_path / "beside.hdr", dusk(4)[0])
    other = tmp_path / "elsewhere" / "beside.exr"
    other.parent.mkdir()
    write_image(other, dusk(4)[0])
    preview = opened(tmp_path, tmp_path / "a.json", None, [other]).preview
    assert preview.environments[-2:] == ("beside", "beside'") and preview.environment == "beside'"
    with pytest.raises(UserError, match="the picture is square"):
        preview.light("beside")
    with pytest.raises(UserError, match="file does not exist"):
        opened(tmp_path, tmp_path / "a.json", None, [tmp_path / "none.hdr"])
