"""Windows on stores, scenes and materials."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from lambent.api.materials import Material
from lambent.api.scenes import Scene
from lambent.api.stores import Store
from lambent.api.tables import Table
from lambent.core.errors import UserError
from lambent.core.extras import needing_extras


def window(
    what: Store | str | Path,
    mode: Literal["walk", "view", "edit", "relight"] = "walk",
    *,
    size: tuple[int, int] = (1680, 1050),
    **options: Any,
) -> None:
    """Open a window, as `lambent walk`, `view`, `edit` and `relight` do; returns when it is closed.

    Parameters
    ----------
    what : Store, str or Path
        A store or its folder; to edit, also the file of a measured table, a material, a scene or a session.
    mode : {"walk", "view", "edit", "relight"}
        On foot; about the target of a camera; editing materials; under a turned sky.
    size : (width, height)
        Of the window, logical pixels.
    **options
        Of walk and view: `light_field_mb`, `sky_turn_deg`, `replaced`, `fresh`. Of edit: `material`, `environments`,
        `camera`, `picture`, `store`, `crease_deg`. Of relight: `camera`, `environment`, `turn_deg`.

    Raises
    ------
    UserError
        If there is no display or graphics adapter, or `what` cannot be shown in this mode.
    """
    if isinstance(what, Material | Scene | Table):
        raise UserError("is shown from its file", got=repr(what), expected="a path, or a store")
    path = what.folder if isinstance(what, Store) else Path(what)
    with needing_extras():
        if mode == "edit":
            from lambent.viewer import edit

            edit.run(path, size=size, **options)
        else:
            from lambent.viewer import app

            app.run(path, mode, size=size, **options)
