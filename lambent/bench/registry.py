"""Benches: found by discovery, run in one form.

A bench is a module of this package with `NAME` and `run(quick, inputs, progress)`, which returns {"rows": [...],
"summary": {...}}, and "machine" and "inputs" (see machine.py) where it knows them better than this module. Names, rows
and fields are those of docs/performance.md; times are medians of at least five runs taken alternately, their spread
beside them.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from lambent import bench
from lambent.bench.machine import inputs_of, machine
from lambent.core.errors import UserError, did_you_mean
from lambent.core.progress import Progress, silent


def benches() -> dict[str, str]:
    """Name -> module of every bench; imports all of them."""
    modules = (
        importlib.import_module(f"{bench.__name__}.{info.name}") for info in pkgutil.iter_modules(bench.__path__)
    )
    return {module.NAME: module.__name__ for module in modules if hasattr(module, "NAME")}


def run_bench(
    name: str,
    *,
    quick: bool = False,
    inputs: Sequence[Path] = (),
    against: Sequence[Path] = (),
    progress: Progress = silent,
) -> dict[str, Any]:
    """Run one bench; the report holds bench, machine, inputs, rows and summary, ready for JSON.

    Raises
    ------
    UserError
        Where there is no such bench or an input cannot be read.
    """
    for path in [*inputs, *against]:
        if not path.exists():
            raise UserError("input does not exist", file=path)
    module = _module(name)
    options = {}
    if against:
        if "against" not in inspect.signature(module.run).parameters:
            raise UserError("this bench compares with nothing published", field="--against", got=name)
        options["against"] = list(against)
    measured: Mapping[str, Any] = module.run(quick, list(inputs), progress, **options)
    return {
        "bench": name,
        "machine": measured.get("machine") or machine(),
        "inputs": measured.get("inputs") or inputs_of([*inputs, *against]),
        "rows": list(measured["rows"]),
        "summary": dict(measured["summary"]),
    }


def _module(name: str) -> ModuleType:
    found = benches()
    if name not in found:
        raise UserError("unknown bench", got=name, expected=", ".join(sorted(found)), hint=did_you_mean(name, found))
    return importlib.import_module(found[name])
