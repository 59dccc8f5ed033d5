"""Planted defects: what is a defect, and whether the tests of a room notice it."""

from __future__ import annotations

import importlib.util
import shutil
import sys
from pathlib import Path

import pytest

FILE = Path(__file__).parents[2] / "tools" / "plant.py"


@pytest.fixture(scope="module")
def plant():
    spec = importlib.util.spec_from_file_location("plant", FILE)
    module = sys.modules["plant"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    yield module
    del sys.modules["plant"]


PYTHON = '''
"""Text: 1 + 1."""
__all__ = ["area"]
TIMEOUT_S = 3
def area(w: "list[1]", h, names=("é", 2)):
    if w < 0 or h <= w:
        raise ValueError(f"{-w} by {h + 1}")
    return -w * max(h, w) + of(w, h)
'''


def test_defects_of_python_change_what_it_does(plant):
    found = {(d.line, d.old, d.new) for d in plant.defects_of("a.py", PYTHON)}
    assert found == {
        (5, "2", "3"),
        (6, "w < 0", "(w <= 0)"),
        (6, "0", "1"),
        (6, "h <= w", "(h >= w)"),
        (8, "-w * max(h, w) + of(w, h)", "(-w * max(h, w) - of(w, h))"),
        (8, "-w * max(h, w)", "(-w / max(h, w))"),
        (8, "-w", "w"),
        (8, "max", "min"),
        (8, "of(w, h)", "of(h, w)"),
    }


SHADER = """
@group(0) @binding(2) var<uniform> sun: Sun; // 1 + 1
override N: u32 = 4;
fn f(a: array<vec2f, 2>) -> f32 { return mix(-a[0].x, 0.5, 1.0 / min(p, q)); }
"""


def test_defects_of_shaders(plant):
    found = {(d.line, d.old, d.new) for d in plant.defects_of("a.wgsl", SHADER)}
    tokens = [("-", ""), ("0", "1"), ("x", "y"), ("0.5", "1.0"), ("1.0", "2.0"), ("/", "*"), ("min", "max")]
    assert found == {(4, old, new) for old, new in tokens}


AREA = """def area(w, h):
    return w * h

def unused():
    return 1
"""


@pytest.mark.long
def test_tests_of_its_room_catch_a_defect_or_do_not(plant, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")  # so that pytest starts sooner
    root = tmp_path / "root"
    for folder in ("lambent/rooms", "tests/rooms", "tests/others"):
        (root / folder).mkdir(parents=True)
    (root / "lambent" / "rooms" / "area.py").write_text(AREA)
    (root / "tests" / "rooms" / "test_first.py").write_text("def test_nothing():\n    pass\n")
    test = "from lambent.rooms.area import {0}\n\ndef test_{0}():\n    assert {0}({1}) == {2}\n"
    (root / "tests" / "rooms" / "test_sizes.py").write_text(test.format("area", "2, 3", 6))
    (root / "tests" / "others" / "test_unused.py").write_text(test.format("unused", "", 1))
    assert plant.tests_of("lambent/rooms/area.py", root) == ["tests/rooms/test_sizes.py", "tests/rooms/test_first.py"]
    product, one = plant.defects_of("lambent/rooms/area.py", AREA)
    assert {product, one} >= set(plant.drawn(["lambent/rooms/area.py"], root, 9, 1))
    field = plant.Field(root, tmp_path, limit=60)
    assert field.judged(product) == ("caught", "tests/rooms/test_sizes.py::test_area")
    assert field.judged(one) == ("survived", "")
    shutil.rmtree(tmp_path / "copy" / "tests" / "rooms")
    assert field.judged(product) == ("survived", ""), "a room without tests is not that of all tests"
