"""Find the writer of a format by its name, or by a file's ending."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache
from pathlib import Path
from typing import cast

import lambent.materials.export as package
from lambent.core.errors import UserError, did_you_mean
from lambent.materials.export.contract import Writer


@cache
def writers() -> dict[str, Writer]:
    """Every writer by the name of its module, in alphabetical order."""
    modules = {
        m.name: importlib.import_module(f"{package.__name__}.{m.name}") for m in pkgutil.iter_modules(package.__path__)
    }
    return {name: cast(Writer, module) for name, module in modules.items() if hasattr(module, "write")}


def writer_for(path: Path, name: str | None = None) -> Writer:
    """The writer called `name`, or the only one that writes files with this ending.

    Raises
    ------
    UserError
        Where the name is unknown, or the ending belongs to no format or to several.
    """
    known = writers()
    if name is not None:
        if name not in known:
            raise UserError("unknown format", got=name, expected=", ".join(known), hint=did_you_mean(name, known))
        return known[name]
    fitting = [key for key, writer in known.items() if path.suffix.lower() in writer.ENDINGS]
    if len(fitting) == 1:
        return known[fitting[0]]
    if fitting:
        raise UserError(
            "several formats have this ending", file=path, hint=f"say which: --as {' or --as '.join(fitting)}"
        )
    endings = sorted({ending for writer in known.values() for ending in writer.ENDINGS})
    raise UserError("unknown ending", file=path, got=path.suffix or "none", expected=", ".join(endings))
