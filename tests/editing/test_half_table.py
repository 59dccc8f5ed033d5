"""Tables of the display transform by half floats."""

from __future__ import annotations

import numpy as np

from lambent.editing.curves.half_table import looked_up


def test_tables_are_looked_up_by_the_nearest_half_float() -> None:
    """-0 and values below 0 are 0, values above the largest half float are that."""
    values = np.array([0.0, -0.0, -3.0, 1.0, 0.1, 1e9], np.float32)
    bits = np.clip(values, 0, 65504).astype(np.float16).view(np.uint16) & 0x7FFF
    table = (np.arange(1 << 15) % 251).astype(np.uint8)
    found = looked_up(values.reshape(1, 2, 3), table)
    assert np.array_equal(found[..., :3].ravel(), table[bits]) and (found[..., 3] == 255).all()
