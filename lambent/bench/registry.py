"""Benches, found by discovery, with a common interface.

A bench is a module of this package, or of `pictures`, with `NAME`, its efforts `FULL` and `QUICK` (instances of its own
frozen dataclass), and `run(effort, progress=silent)`, which returns {"rows": [...], "summary": {...}}. If it reads
files, `run` also takes `inputs`; if it compares with published figures, `against`; with finished pictures, `reference`;
if it draws random settings, `settings`; if it writes rows to a file as they come, `output`. docs/performance.md defines
names, rows and fields; times are medians of at least five alternating runs, reported with their spread.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from lambent import bench
from lambent.bench import pictures
from lambent.core.discovery import known, modules_in
from lambent.core.errors import UserError
from lambent.core.inputs import sha256_of
from lambent.core.machine import core_count, cpu_name
from lambent.core.progress import Progress, silent


def benches() -> dict[str, ModuleType]:
    """Module of every bench by its name, sorted; imports all of them."""
    modules = [*modules_in(bench, having="NAME").values(), *modules_in(pictures, having="NAME").values()]
    return dict(sorted((module.NAME, module) for module in modules))


def run_bench(
    name: str,
    effort: object = "full",
    *,
    inputs: Sequence[Path] = (),
    against: Sequence[Path] = (),
    reference: Sequence[Path] = (),
    settings: int | None = None,
    output: Path | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Run one bench; the report has bench, machine, inputs, rows and summary, ready for JSON.

    Parameters
    ----------
    name : str
        `NAME` of the bench.
    effort : {'full', 'quick'} or object
        Sizes and sample counts: one of the bench's efforts by name, or an instance of its `Effort`.
    inputs, against, reference : sequence of Path
        Files for a bench that takes them; see the head of this module.
    settings : int, optional
        Number of random settings, for a bench that draws them.
    output : Path, optional
        File of a bench that writes one.

    Raises
    ------
    UserError
        If there is no such bench, an input cannot be read, or the bench does not take an option.
    """
    files = [*inputs, *against, *reference]
    for path in files:
        if not path.exists():
            raise UserError("input does not exist", file=path)
    found = benches()
    module = found[known("bench", name, found)]
    read = {"inputs": inputs, "against": against, "reference": reference}
    options: dict[str, Any] = {key: list(paths) for key, paths in read.items() if paths}
    options |= {"settings": settings} if settings is not None else {}
    options |= {"output": output} if output is not None else {}
    refused = options.keys() - inspect.signature(module.run).parameters.keys()
    if "inputs" in refused:
        raise UserError("this bench takes no inputs", got=inputs[0])
    if "reference" in refused:
        raise UserError("this bench takes no reference", field="--reference", got=name)
    if "settings" in refused:
        raise UserError("this bench has no random settings", field="--settings", got=name)
    if "output" in refused:
        raise UserError("this bench writes no file", field="-o", got=output, hint="--json prints its rows")
    if refused:
        raise UserError("this bench takes no published fits", field="--against", got=name)
    if isinstance(effort, str):
        effort = {"full": module.FULL, "quick": module.QUICK}[effort]
    measured = module.run(effort, progress=progress, **options)
    # The hash of a store's manifest stands for the whole store.
    hashed = [{"path": p.name, "sha256": sha256_of(p / "manifest.json" if p.is_dir() else p)} for p in files]
    figures = {key: measured[key] for key in ("rows", "summary")}
    return {"bench": name, "machine": machine(), "inputs": hashed, **figures}


def machine() -> dict[str, Any]:
    """cpu, cores; adapter, adapter_type and driver, or None without one; the path tracer's variant if it runs."""
    from lambent.realtime.gpu.device import adapter_info, choose_adapter

    try:
        info = adapter_info(choose_adapter())
    except UserError:
        info = None
    mitsuba = sys.modules.get("mitsuba")
    return {
        "cpu": cpu_name(),
        "cores": core_count(),
        "adapter": info and info.name,
        "adapter_type": info and info.type,
        "driver": info and f"{info.backend} {info.driver}".strip(),
        "variant": mitsuba and mitsuba.variant(),
    }
