"""Change the colour of materials' diffuse reflection; lobes and transmission stay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.light.colour import hex_colour
from lambent.core.plain import Triple
from lambent.materials.document import Material

FIELD = "--recolour"


def parse_recolours(texts: Sequence[str]) -> dict[str, Triple]:
    """Linear RGB by material from texts MATERIAL=#rrggbb; `UserError` for any other form."""
    found: dict[str, Triple] = {}
    for text in texts:
        name, _, written = text.rpartition("=")
        colour = hex_colour(written.strip())
        if not name.strip() or colour is None:
            raise UserError(
                "cannot be read as a recoloured material", field=FIELD, got=text, expected="MATERIAL=#rrggbb"
            )
        if name.strip() in found:
            raise UserError("names a material twice", field=FIELD, got=name.strip())
        found[name.strip()] = colour
    return found


def recoloured(materials: Mapping[str, Material], colours: Mapping[str, Triple]) -> dict[str, Material]:
    """Materials with diffuse reflection replaced by `colours` (linear RGB), which textures multiply; only changed ones.

    A key with * or ? stands for all materials that match it; if two keys match a material, the last one wins.

    Raises
    ------
    UserError
        If a name or pattern matches no material.
    """
    found: dict[str, Material] = {}
    for name, colour in colours.items():
        alike = [one for one in materials if fnmatchcase(one, name)] or [
            known("material", name, materials, field=FIELD)
        ]
        found |= {one: materials[one].model_copy(update={"kd": colour}) for one in alike}
    return found
