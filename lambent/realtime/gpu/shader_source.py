"""Assembles shaders from files: `#include "name.wgsl"` on a line of its own includes a file, at most once."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[2]
_INCLUDE = re.compile(r'^#include "([\w.-]+)"$', re.MULTILINE)


def assemble(*names: str, given: Mapping[str, str] | None = None) -> str:
    """WGSL of the named files after all their includes; `given` has the text of includes without a file, by name.

    Raises
    ------
    FileNotFoundError
        If no room has such a file.
    """
    done: dict[str, str] = {}
    for name in names:
        _add(name, given or {}, done)
    return "\n".join(done.values())


@cache
def shader_files() -> dict[str, Path]:
    """Shaders of all rooms by name: each lies beside the Python that binds it."""
    return {path.name: path for path in PACKAGE.rglob("*.wgsl")}


def _path(name: str) -> Path:
    if name not in shader_files():
        raise FileNotFoundError(f"shader {name} is nowhere in {PACKAGE}")
    return shader_files()[name]


def _add(name: str, given: Mapping[str, str], done: dict[str, str]) -> None:
    if name in done:
        return
    text = given.get(name)
    if text is None:
        text = _path(name).read_text(encoding="utf-8")
    for inner in _INCLUDE.findall(text):
        _add(inner, given, done)
    done[name] = _INCLUDE.sub("", text)
