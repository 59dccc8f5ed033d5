"""What a row of bench `card` is: a measurement in a process of its own, which yields figures one after the other."""

from __future__ import annotations

import ctypes
import statistics
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lambent.baking.engine import VARIANTS, cuda_library, engine
from lambent.core.errors import UserError
from lambent.core.machine import cpu_name

THESIS_M, THESIS_E = "thesis M, GTS 450", "thesis E, one Xeon"
CUDA, PROCESSOR = VARIANTS
NAME_BYTES = 256


@dataclass(frozen=True)
class Figure:
    """One figure of a row: its value in a unit, on a device."""

    name: str
    value: float
    unit: str
    device: str


@dataclass(frozen=True)
class Published:
    """A figure to compare with, in the unit of the row's, and where it was measured."""

    figure: str
    machine: str


@dataclass(frozen=True)
class Row:
    """A measurement.

    `measure(effort, work)` yields figures; `work` is a folder that rows share. It may take `limit_s`. Rows are taken
    by `turn`. `published` is by name of a figure; `variant` forces one of the path tracer.
    """

    measure: Callable[[Any, Path], Iterator[Figure]]
    limit_s: float
    turn: int
    published: Mapping[str, Published] = field(default_factory=dict)
    variant: str | None = None


class Absent(Exception):
    """What a row measures is absent from this machine; the message says what."""


def adapter_name() -> str:
    """The graphics adapter that draws."""
    from lambent.realtime.gpu.device import adapter_info, choose_adapter

    try:
        return adapter_info(choose_adapter()).name
    except UserError as error:
        raise Absent(error.message) from error


def engine_name() -> str:
    """The device that traces paths: the card of CUDA, or the processor."""
    return cuda_name() if engine().variant == CUDA else cpu_name()


def cuda_name() -> str:
    """Name of the first CUDA device; raises `Absent` without one."""
    cuda, device, name = cuda_library(), ctypes.c_int(), ctypes.create_string_buffer(NAME_BYTES)
    if cuda is None or cuda.cuInit(0) or cuda.cuDeviceGet(ctypes.byref(device), 0):
        raise Absent("no CUDA device")
    cuda.cuDeviceGetName(name, NAME_BYTES, device)
    return name.value.decode(errors="replace")


def median_ms(work: Callable[[int], object], count: int) -> float:
    """Median time of `work(k)` for k = 1 ... count, after an untimed k = 0."""
    times = []
    for k in range(count + 1):
        began = time.perf_counter()
        work(k)
        times.append(1e3 * (time.perf_counter() - began))
    return statistics.median(times[1:])
