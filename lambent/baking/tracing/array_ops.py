"""The path tracer's array functions, for code shared with numpy."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.materials.lobes import ArrayOps


def array_ops() -> ArrayOps:
    """Functions of the current variant; numpy tables are uploaded at the first look-up, and cached with this object."""
    uploaded: dict[int, tuple[Any, Any]] = {}  # includes the table itself, so that its id is not reused

    def gather(table: Any, index: Any) -> Any:
        if isinstance(table, np.ndarray):
            if id(table) not in uploaded:
                uploaded[id(table)] = table, mi.Float(np.asarray(table, np.float32))
            table = uploaded[id(table)][1]
        return dr.gather(mi.Float, table, mi.UInt32(index))

    return ArrayOps(
        dr.exp, dr.log, dr.sqrt, dr.sin, dr.cos, dr.power, dr.abs, dr.maximum, dr.minimum, dr.select, dr.cbrt, dr.atan2,
        dr.floor, gather, mi.Int32,
    )  # fmt: skip
