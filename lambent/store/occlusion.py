"""How far the light map scales a probe's light: the notes of its radiance.

r is the light map's share of `seen_irradiance` (`store.contract`), times `occlusion_gain`, at most 1. The probe's
light is scaled by r; with `even_niches` by r^2, and (1 - r) E/pi is added from all directions, where the light map
has the irradiance E.
"""

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


def has_even_niches(store: Store, object_name: str) -> bool:
    """Whether niches show the light map's light from all directions where they hide the probe's."""
    name = probe_name(object_name, "radiance")
    said = store.artefact(name).meta.get("even_niches", False)
    if not isinstance(said, bool):
        expected = "true or false"
        raise UserError("broken store", file=store.folder, field=f"{name}: even_niches", got=said, expected=expected)
    return said
