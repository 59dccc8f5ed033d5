"""Facts of scenes and stores in words."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from lambent.core.errors import UserError
from lambent.scenes.scene import Variant
from lambent.store.contract import SCENE, scene_record
from lambent.store.kept.states import variants_of
from lambent.store.light_groups import light_groups
from lambent.store.store import Store


def variants_in_words(variants: Iterable[Variant]) -> dict[str, str]:
    """Changes of each variant: materials and light groups."""
    found = {}
    for one in variants:
        changed = [", ".join(one.looks)] * bool(one.looks)
        changed += [f"light of {', '.join(one.light.groups)}"] * bool(one.light.groups)
        found[one.name] = "; ".join(changed) or "as baked"
    return found


def facts_of_store(store: Store) -> dict[str, Any]:
    """Arrays, complete or not, whether every chunk on disk is sound, and what the scene offers, by name."""
    has_scene, groups = SCENE in store.documents, light_groups(store)
    return {
        "is": "store",
        "arrays": {a.name: f"{'x'.join(map(str, a.shape))} {a.dtype}, {_health(store, a)}" for a in store.artefacts()},
        "documents": sorted(store.documents),
        "light_groups": {g.name: f"{g.share:.1%} of the light: {', '.join(g.members)}" for g in groups},
        "variants": variants_in_words(variants_of(store) if has_scene else ()),
        "reflectors": _reflectors(store) if has_scene else [],
        "inputs": store.inputs,
    }


def _health(store: Store, artefact: Any) -> str:
    if not artefact.complete:
        return str(artefact.state)
    try:
        store.read(artefact.name)
    except UserError as error:
        return error.message
    return "complete"


def _reflectors(store: Store) -> list[str]:
    """Planar reflectors in words: area, objects, plane."""
    words = []
    for r in scene_record(store).reflectors:
        *n, d = (round(x, 3) + 0.0 for x in r.plane)
        area = sum(part.area_m2 for part in r.parts)
        words.append(f"{area:.2f} m2 of {', '.join(part.object for part in r.parts)}: n {n}, d {d}")
    return words
