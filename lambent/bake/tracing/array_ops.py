"""The path tracer's array functions, for code that is written once for numpy and for it."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.materials.lobes import ArrayOps


def array_ops() -> ArrayOps:
    """Functions of the current variant; numpy tables are uploaded when first looked up, and kept as long as these."""
    uploaded: dict[int, tuple[Any, Any]] = {}  # with the table itself, so that no other gets its number

    def gather(table: Any, index: Any) -> Any:
        if isinstance(table, np.ndarray):
            if id(table) not in uploaded:
                uploaded[id(table)] = table, mi.Float(table)
            table = uploaded[id(table)][1]
        return dr.gather(mi.Float, table, mi.UInt32(index))

    return ArrayOps(
        dr.exp, dr.log, dr.sqrt, dr.sin, dr.cos, dr.power, dr.abs, dr.maximum, dr.minimum, dr.select, dr.cbrt, dr.atan2,
        dr.floor, gather, mi.Int32,
    )  # fmt: skip
