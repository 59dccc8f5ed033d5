"""Assembles shaders from files: `#include "name.wgsl"` on a line of its own includes a file, at most once."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

FOLDERS = (Path(__file__).parent / "shaders", Path(__file__).parents[1] / "materials")
_INCLUDE = re.compile(r'^#include "([\w.-]+)"$', re.MULTILINE)


def assemble(*names: str, given: Mapping[str, str] | None = None) -> str:
    """WGSL of the named files after all their includes; `given` has the text of includes without a file, by name.

    Raises
    ------
    FileNotFoundError
        If a file is in none of `FOLDERS`.
    """
    done: dict[str, str] = {}
    for name in names:
        _add(name, given or {}, done)
    return "\n".join(done.values())


def _add(name: str, given: Mapping[str, str], done: dict[str, str]) -> None:
    if name in done:
        return
    text = given.get(name)
    if text is None:
        path = next((folder / name for folder in FOLDERS if (folder / name).is_file()), None)
        if path is None:
            raise FileNotFoundError(f"shader {name} is in none of {[str(folder) for folder in FOLDERS]}")
        text = path.read_text(encoding="utf-8")
    for inner in _INCLUDE.findall(text):
        _add(inner, given, done)
    done[name] = _INCLUDE.sub("", text)
