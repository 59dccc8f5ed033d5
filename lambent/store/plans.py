"""Floor plans of reflectors in a store: signed bytes, compressed into the text of the scene record."""

from __future__ import annotations

import base64
import binascii
import zlib

import numpy as np

from lambent.core.errors import UserError
from lambent.core.plain import triple
from lambent.scenes.floor_plan import FloorPlan
from lambent.store.contract import PlanRecord


def plan_record(plan: FloorPlan) -> PlanRecord:
    rows, columns = plan.distance.shape
    corner, across, along = map(triple, (plan.corner, plan.across, plan.along))
    packed = base64.b64encode(zlib.compress(plan.distance.tobytes(), 9)).decode("ascii")
    return PlanRecord(
        corner=corner, across=across, along=along, cell_m=plan.cell_m, rows=rows, columns=columns, packed=packed
    )


def plan_of(record: PlanRecord) -> FloorPlan:
    """The plan of a record; `UserError` if its bytes do not match its size."""
    size = record.rows * record.columns
    try:
        unpacker = zlib.decompressobj()
        cells = unpacker.decompress(base64.b64decode(record.packed, validate=True), size + 1)  # bounded output
    except (binascii.Error, zlib.error) as error:
        raise UserError("broken store", field="reflectors: plan", got=str(error), expected="packed bytes") from error
    if len(cells) != size:
        raise UserError("broken store", field="reflectors: plan", got=f"{len(cells)} bytes", expected=f"{size} bytes")
    corner, across, along = (np.array(vector) for vector in (record.corner, record.across, record.along))
    distance = np.frombuffer(cells, np.int8).reshape(record.rows, record.columns)
    return FloorPlan(corner, across, along, record.cell_m, distance)
