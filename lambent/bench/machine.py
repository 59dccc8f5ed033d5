"""What a measurement was taken on, and which files went in: the frame of every bench's JSON."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from lambent.core.errors import UserError
from lambent.core.files import sha256_of


def machine(device: Any = None) -> dict[str, Any]:
    """cpu, cores, adapter, adapter_type, driver, variant of this machine.

    Parameters
    ----------
    device : wgpu.GPUDevice, optional
        The one that was measured; without one, the adapter that would be chosen, or none.
    """
    name, kind, driver = _adapter(device)
    return {
        "cpu": _cpu(),
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "adapter": name,
        "adapter_type": kind,
        "driver": driver,
        "variant": _variant(),
    }


def inputs_of(paths: Iterable[Path]) -> list[dict[str, str]]:
    """[{"path": name, "sha256": ...}] of the files that a bench read; of a store, its manifest's hash."""
    hashed = ((path, path / "manifest.json" if path.is_dir() else path) for path in paths)
    return [{"path": path.name, "sha256": sha256_of(file)} for path, file in hashed]


def _cpu() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def _adapter(device: Any) -> tuple[str | None, str | None, str | None]:
    from lambent.realtime.device import adapter_info, choose_adapter

    try:
        info = adapter_info(device if device is not None else choose_adapter())
    except UserError:
        return None, None, None
    return info.name, info.type, f"{info.backend} {info.driver}".strip()


def _variant() -> str | None:
    """The path tracer's variant, where a bench has started it."""
    import sys

    mitsuba = sys.modules.get("mitsuba")
    return mitsuba.variant() if mitsuba is not None else None
