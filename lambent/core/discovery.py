"""Discovery of the modules of a package: a new format, bench, artefact or mode is a new file; no list is edited.

A plug-in may add folders to a package (`package.__path__.append`); their modules are found too.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType

from lambent.core.errors import UserError, did_you_mean


def names_in(package: ModuleType) -> list[str]:
    """Sorted names of the modules and folders of a package; imports nothing."""
    return sorted(info.name for info in pkgutil.iter_modules(package.__path__))


def modules_in(package: ModuleType, having: str | None = None) -> dict[str, ModuleType]:
    """Import the modules of a package, sorted by name; only those that define `having`, if given."""
    found = {name: importlib.import_module(f"{package.__name__}.{name}") for name in names_in(package)}
    return {name: module for name, module in found.items() if having is None or hasattr(module, having)}


def known(
    what: str, name: str, names: Iterable[str], *, file: Path | str | None = None, field: str | None = None
) -> str:
    """`name` if it is one of `names`; else raise a `UserError` that lists them and suggests the nearest."""
    names = list(names)
    if name not in names:
        hint = did_you_mean(name, names)
        raise UserError(f"unknown {what}", file=file, field=field, got=name, expected=", ".join(names), hint=hint)
    return name
