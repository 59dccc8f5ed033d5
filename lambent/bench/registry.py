"""Benches: found by discovery, run in one form.

A bench is a module of this package with `NAME` and `run(quick, inputs, progress)`, which returns {"rows": [...],
"summary": {...}} and, where it read files of its own choice, {"inputs": [paths]}. Names, rows and fields are those of
docs/performance.md; times are medians of at least five runs taken alternately, their spread beside them.
"""

from __future__ import annotations

import importlib
import os
import pkgutil
import platform
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from lambent import bench
from lambent.core.errors import UserError, did_you_mean
from lambent.core.files import sha256_of
from lambent.core.progress import Progress, silent


def benches() -> dict[str, str]:
    """Name -> module of every bench; imports all of them."""
    modules = (
        importlib.import_module(f"{bench.__name__}.{info.name}") for info in pkgutil.iter_modules(bench.__path__)
    )
    return {module.NAME: module.__name__ for module in modules if hasattr(module, "NAME")}


def run_bench(
    name: str, *, quick: bool = False, inputs: Sequence[Path] = (), progress: Progress = silent
) -> dict[str, Any]:
    """Run one bench; the report holds bench, machine, inputs, rows and summary, ready for JSON.

    Raises
    ------
    UserError
        Where there is no such bench or an input cannot be read.
    """
    for path in inputs:
        if not path.exists():
            raise UserError("input does not exist", file=path)
    measured: Mapping[str, Any] = _module(name).run(quick, list(inputs), progress)
    return {
        "bench": name,
        "machine": machine(),
        "inputs": [_input(Path(path)) for path in [*inputs, *measured.get("inputs", [])]],
        "rows": list(measured["rows"]),
        "summary": dict(measured["summary"]),
    }


def machine() -> dict[str, Any]:
    """What the figures were measured on."""
    from lambent.bake.engine import probe_engine
    from lambent.realtime.device import adapter_info, choose_adapter

    engine = probe_engine().engine
    facts: dict[str, Any] = {"cpu": cpu_name(), "cores": os.cpu_count(), "variant": engine.variant if engine else None}
    try:
        adapter = adapter_info(choose_adapter())
    except UserError:
        return facts | {"adapter": None, "adapter_type": None, "driver": None}
    return facts | {"adapter": adapter.name, "adapter_type": adapter.type, "driver": adapter.driver}


def cpu_name() -> str:
    """The processor as its maker calls it, else its architecture."""
    path = Path("/proc/cpuinfo")
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines() if path.exists() else []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, "") or platform.processor() or platform.machine()


def _module(name: str) -> ModuleType:
    found = benches()
    if name not in found:
        raise UserError("unknown bench", got=name, expected=", ".join(sorted(found)), hint=did_you_mean(name, found))
    return importlib.import_module(found[name])


def _input(path: Path) -> dict[str, Any]:
    return {"path": path.name, "sha256": sha256_of(path if path.is_file() else path / "manifest.json")}
