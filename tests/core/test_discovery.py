"""Modules of a package are found, those of folders that it gains later, too."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest

from lambent.core.discovery import known, modules_in, names_in
from lambent.core.errors import UserError


def test_modules_are_found_without_importing_and_with(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "toys"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "top.py").write_text("NAME = 'spinning top'\n")
    (package / "shared.py").touch()
    monkeypatch.syspath_prepend(str(tmp_path))
    toys = importlib.import_module("toys")

    assert names_in(toys) == ["shared", "top"] and "toys.top" not in sys.modules
    assert {name: m.NAME for name, m in modules_in(toys, "NAME").items()} == {"top": "spinning top"}
    more = tmp_path / "more"
    more.mkdir()
    (more / "ball.py").write_text("NAME = 'ball'\n")
    toys.__path__.append(str(more))
    assert list(modules_in(toys, "NAME")) == ["ball", "top"]


def test_an_unknown_name_is_told_with_the_nearest() -> None:
    assert known("toy", "ball", ["ball", "top"]) == "ball"
    with pytest.raises(UserError, match=r"unknown toy.*bal.*ball, top"):
        known("toy", "bal", ["ball", "top"])
    with pytest.raises(UserError, match=r"toys.txt: line 3: unknown toy"):
        known("toy", "bal", ["ball"], file="toys.txt", field="line 3")
