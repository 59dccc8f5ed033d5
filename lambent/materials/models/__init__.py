"""Analytic models, one file each, found by discovery: put a file here and it is known everywhere.

See docs/adding-a-model.md.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil

from lambent.core.errors import UserError, did_you_mean
from lambent.materials.models.model import Model


def models() -> dict[str, type[Model]]:
    """Every model by its name, in alphabetical order."""
    found: dict[str, type[Model]] = {}
    for module in pkgutil.iter_modules(__path__, f"{__name__}."):
        for _, kind in inspect.getmembers(importlib.import_module(module.name), inspect.isclass):
            if issubclass(kind, Model) and not inspect.isabstract(kind) and kind.__module__ == module.name:
                assert kind.name not in found, f"two models are called {kind.name!r}"
                found[kind.name] = kind
    return dict(sorted(found.items()))


def model_named(name: str) -> type[Model]:
    """The model of that name, or a `UserError` that names the nearest one."""
    known = models()
    if name not in known:
        raise UserError("unknown model", got=name, expected=", ".join(known), hint=did_you_mean(name, known))
    return known[name]
