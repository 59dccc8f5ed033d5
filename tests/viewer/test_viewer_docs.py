"""docs/window.md says what the window does."""

import re
from pathlib import Path

import pytest

from lambent.viewer import input as viewer_input
from lambent.viewer import pacing
from lambent.viewer.cameras import cameras
from lambent.viewer.editor import measurement
from lambent.viewer.modes.edit import baking, painter
from lambent.viewer.modes.edit import mode as edit
from lambent.viewer.modes.material import mode as material
from lambent.viewer.modes.walk import input as walk
from lambent.viewer.modes.walk.views import walls

TEXT = (Path(__file__).parents[2] / "docs" / "window.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("shortcut", (*walk.SHORTCUTS, *material.SHORTCUTS, *edit.SHORTCUTS), ids=lambda s: s[0])
def test_every_shortcut_is_documented(shortcut):
    assert f"| {shortcut[0]} | {shortcut[1]} |" in TEXT


def test_the_numbers_are_those_of_the_code():
    assert f"{cameras.WALK_M_S} m/s" in TEXT
    assert f"{cameras.EYE_HEIGHT_M} m above" in TEXT
    assert f"{measurement.FEW:,} tuples" in TEXT
    assert f"{1 / pacing.BUDGET_S:.0f} frames a second" in TEXT
    assert f"{100 * walls.STEP_M:.0f} cm" in TEXT
    sentences = " ".join(TEXT.split())
    assert "Edits begin with {} lights; when {} are there".format(*baking.LIGHTS) in sentences
    assert painter.FADE_S == 0.5 and "in half a second" in sentences


def test_every_documented_key_is_one_of_the_window():
    """The tables of mouse and keys hold nothing that the window does not do."""
    tables = [part.split("\n\n")[0] for part in TEXT.split("| | |\n|---|---|\n")[1:]]
    rows = {tuple(cell.strip() for cell in row.strip("|").split("|")) for table in tables for row in table.splitlines()}
    assert rows == {*walk.SHORTCUTS, *material.SHORTCUTS, *edit.SHORTCUTS}


@pytest.mark.parametrize("module", [viewer_input, walk, material, edit], ids=lambda module: module.__name__)
def test_every_key_that_is_answered_is_named(module):
    keys = set(re.findall(r'key == "(\w+)"', Path(module.__file__).read_text()))
    named = {*walk.SHORTCUTS, *(() if module is walk else (*material.SHORTCUTS, *edit.SHORTCUTS))}
    words = {word for name, _ in named for word in re.split(r"[ ,/]+|Ctrl\+|Shift\+", name)}
    assert {key.upper() if len(key) == 1 else {"Escape": "Esc"}.get(key, key) for key in keys} <= words
