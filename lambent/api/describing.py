"""Words on what scenes and stores have in common."""

from __future__ import annotations

from collections.abc import Iterable

from lambent.scenes.scene import Variant


def variants_in_words(variants: Iterable[Variant]) -> dict[str, str]:
    """Changes of each variant: materials and light groups."""
    found = {}
    for one in variants:
        changed = [", ".join(one.looks)] * bool(one.looks)
        changed += [f"light of {', '.join(one.light.groups)}"] * bool(one.light.groups)
        found[one.name] = "; ".join(changed) or "as baked"
    return found
