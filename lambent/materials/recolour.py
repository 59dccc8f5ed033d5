"""Other colours for materials: their diffuse reflection alone; lobes and transmission stay."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lambent.core.colour import srgb_decode
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.plain import Triple, triple
from lambent.materials.document import Material

FIELD = "--recolour"


def parse_recolours(texts: Sequence[str]) -> dict[str, Triple]:
    """Linear RGB by material from texts MATERIAL=#rrggbb; `UserError` where one is not of this form."""
    found: dict[str, Triple] = {}
    for text in texts:
        name, _, colour = text.rpartition("=")
        digits = colour.strip().removeprefix("#")
        try:
            encoded = np.frombuffer(bytes.fromhex(digits), np.uint8) / 255
        except ValueError:
            encoded = np.zeros(0)
        if not name.strip() or len(encoded) != 3 or not colour.strip().startswith("#"):
            raise UserError("not a colour of a material", field=FIELD, got=text, expected="MATERIAL=#rrggbb")
        if name.strip() in found:
            raise UserError("names a material twice", field=FIELD, got=name.strip())
        found[name.strip()] = triple(srgb_decode(encoded))
    return found


def recoloured(materials: Mapping[str, Material], colours: Mapping[str, Triple]) -> dict[str, Material]:
    """The materials that get other colours: diffuse reflection `colours` (linear RGB), which textures multiply.

    Raises
    ------
    UserError
        Where there is no material of a name.
    """
    for name in colours:
        known("material", name, materials, field=FIELD)
    return {name: materials[name].model_copy(update={"kd": colour}) for name, colour in colours.items()}
