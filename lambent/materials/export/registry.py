"""Find the writer of a format by name or by file suffix."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import cast

import lambent.materials.export as package
from lambent.core.discovery import known, modules_in
from lambent.core.errors import UserError
from lambent.materials.export.contract import Writer


@cache
def writers() -> dict[str, Writer]:
    """All writers by module name, in alphabetical order."""
    return {name: cast(Writer, module) for name, module in modules_in(package, having="write").items()}


def writer_for(path: Path, name: str | None = None) -> Writer:
    """The writer called `name`, or the only one for this file suffix.

    Raises
    ------
    UserError
        If the name is unknown, or no format or several use the suffix.
    """
    found = writers()
    if name is not None:
        return found[known("format", name, found)]
    fitting = [key for key, writer in found.items() if path.suffix.lower() in writer.ENDINGS]
    if len(fitting) == 1:
        return found[fitting[0]]
    if fitting:
        hint = f"choose one: --as {' or --as '.join(fitting)}"
        raise UserError("several formats have this ending", file=path, hint=hint)
    endings = sorted({ending for writer in found.values() for ending in writer.ENDINGS})
    raise UserError("unknown ending", file=path, got=path.suffix or "none", expected=", ".join(endings))
