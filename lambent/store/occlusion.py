"""The share of a probe's light that reaches the surfaces showing it.

`light_map/probe_share` gives it by direction: at a texel, the share of the probe's light along unit w is a + b.w,
clamped to [0, MOST_SHARE]. It applies to the objects in its meta.

All other objects use the meta of the probe's radiance. r is the light map's share of `seen_irradiance`
(`store.contract`), times `occlusion_gain`, at most 1. The probe's light is scaled by r. With `even_niches`, it is
scaled by r^2, and (1 - r) E/pi of the light map's irradiance E is added from all directions.
"""

from __future__ import annotations

from lambent.core.arrays import Floats
from lambent.store.contract import probe_name
from lambent.store.store import Store

PROBE_SHARE = "light_map/probe_share"
MOST_SHARE = 2.0
MOST_GAIN = 8.0


def occlusion_gain(store: Store, object_name: str) -> float:
    """Factor, 1 to MOST_GAIN, on the light map's share of `store.contract.probe_irradiance`; `UserError` if invalid."""
    name = probe_name(object_name, "radiance")
    gain = store.artefact(name).meta.get("occlusion_gain", 1.0)
    if not (isinstance(gain, int | float) and 1 <= gain <= MOST_GAIN):
        expected = f"a number from 1 to {MOST_GAIN:g}"
        raise store.broken(f"{name}: occlusion_gain", got=gain, expected=expected)
    return float(gain)


def probe_shares(store: Store) -> tuple[Floats | None, frozenset[str]]:
    """Coefficients (H, W, 4) of the texels, and the objects that use them; None and empty if absent.

    Raises
    ------
    UserError
        If the objects' names are invalid, or the size differs from the light map's.
    """
    if PROBE_SHARE not in store:
        return None, frozenset()
    names = store.artefact(PROBE_SHARE).meta.get("objects")
    if not (isinstance(names, list) and all(isinstance(name, str) for name in names)):
        raise store.broken(f"{PROBE_SHARE}: objects", got=names, expected="a list of names")
    of_light = store.artefact("light_map/irradiance").shape[:2] if "light_map/irradiance" in store else None
    if (shape := store.artefact(PROBE_SHARE).shape[:2]) != of_light:
        raise store.broken(PROBE_SHARE, got=shape, expected=f"{of_light}, as the light map")
    return store.read(PROBE_SHARE), frozenset(names)


def has_even_niches(store: Store, object_name: str) -> bool:
    """Whether niches show the light map's light from all directions where they occlude the probe's.

    Raises
    ------
    UserError
        If the note is not a boolean.
    """
    name = probe_name(object_name, "radiance")
    said = store.artefact(name).meta.get("even_niches", False)
    if not isinstance(said, bool):
        raise store.broken(f"{name}: even_niches", got=said, expected="true or false")
    return said
