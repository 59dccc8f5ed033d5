"""How far the light map scales a probe's light: `seen_irradiance` and `occlusion_gain` in the notes of its radiance."""

from __future__ import annotations

from lambent.core.errors import UserError
from lambent.store.contract import probe_name
from lambent.store.store import Store

MOST_GAIN = 8.0


def occlusion_gain(store: Store, object_name: str) -> float:
    """Factor on the light map's share of `probe_irradiance` of `store.contract`."""
    name = probe_name(object_name, "radiance")
    gain = store.artefact(name).meta.get("occlusion_gain", 1.0)
    if not (isinstance(gain, int | float) and 1 <= gain <= MOST_GAIN):
        expected = f"a number from 1 to {MOST_GAIN:g}"
        raise UserError("broken store", file=store.folder, field=f"{name}: occlusion_gain", got=gain, expected=expected)
    return float(gain)
