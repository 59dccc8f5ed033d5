"""Analytic models, one file each, found by discovery: a new file here is available everywhere.

See docs/adding-a-model.md.
"""

from __future__ import annotations

import inspect
import sys

from lambent.core.discovery import known, modules_in
from lambent.materials.models.model import Model


def models() -> dict[str, type[Model]]:
    """All models by name, in alphabetical order."""
    found: dict[str, type[Model]] = {}
    for module in modules_in(sys.modules[__name__]).values():
        for _, kind in inspect.getmembers(module, inspect.isclass):
            if issubclass(kind, Model) and not inspect.isabstract(kind) and kind.__module__ == module.__name__:
                assert kind.name not in found, f"two models are called {kind.name!r}"
                found[kind.name] = kind
    return dict(sorted(found.items()))


def model_named(name: str) -> type[Model]:
    """The model of that name; raises `UserError` that suggests the nearest known one."""
    found = models()
    return found[known("model", name, found)]
