"""The text of a user's TOML document, before its keys are checked."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from lambent.core.ceilings import SCENE_TOML_BYTES, TOML_LEVELS
from lambent.core.errors import UserError
from lambent.core.inputs import read_bytes

_DEEP_KEY = re.compile(rb"""(?<![\w"'.-])(?:[\w"'-]++[ \t]*+\.[ \t]*+){9,}""")


def toml_of(path: Path) -> dict[str, Any]:
    """The keys of a TOML document; `UserError` if it is invalid."""
    content = read_bytes(path, SCENE_TOML_BYTES)
    deepest = max((key[0].count(b".") for key in _DEEP_KEY.finditer(content)), default=0)
    TOML_LEVELS.check(deepest, file=path)  # parsing time is quadratic in the number of levels
    try:
        return tomllib.loads(content.decode("utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise UserError(f"not a TOML document ({error})", file=path) from error
