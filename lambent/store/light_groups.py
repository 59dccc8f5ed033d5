"""The light groups of a store, and the names of its light maps per group (see `store.contract`)."""

from __future__ import annotations

from pydantic import Field, ValidationError

from lambent.core.errors import invalid
from lambent.core.strict import Strict
from lambent.store.contract import SIDES
from lambent.store.store import MANIFEST, Store


class LightGroupRecord(Strict):
    """Emitters that are dimmed together: see scenes.light_groups.

    `share` is the fraction of luminous irradiance on surfaces that viewers see, the direct light of the sun included.
    """

    name: str = Field(min_length=1)
    members: tuple[str, ...]
    share: float = Field(ge=0, le=1, allow_inf_nan=False)


def group_name(side: str, *, direct: bool = False) -> str:
    """Name of a light map side's array by light group; `direct` selects direct light alone."""
    return f"light_map/{side.replace('irradiance', 'direct' if direct else 'groups')}"


def light_groups(store: Store) -> tuple[LightGroupRecord, ...]:
    """Light groups of a store, in the order of its arrays by group; empty without groups. `UserError` if invalid."""
    name = group_name(SIDES[0])
    if name not in store:
        return ()
    said = store.artefact(name).meta.get("groups")
    try:
        found = tuple(map(LightGroupRecord.model_validate, said if isinstance(said, list) else ()))
    except ValidationError as error:
        raise invalid(error, store.folder / MANIFEST) from error
    count = store.artefact(name).shape[0]
    if len(found) != count or len({group.name for group in found}) != count:
        raise store.broken(f"{name}: groups", got=said, expected=f"{count} groups with names of their own")
    return found
