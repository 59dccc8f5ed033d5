"""The walk mode: a baked store on foot ("walk") or in orbit about the camera's target ("view")."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lambent.baked.light_fields.map_cache import LEAST_RECENT
from lambent.store.store import Store
from lambent.viewer.mode import Mode
from lambent.viewer.screen import Screen

STARTS = ("walk", "view")
NO_DISPLAY = "use `lambent render` or `lambent demo --headless`"


def check(path: Path, **_: object) -> None:
    """Raise `UserError` if there is no store at `path`; called before a window is opened."""
    Store.open(path).close()


def start(
    path: Path, name: str, screen: Screen, light_field_mb: float | None = None, policy: str = LEAST_RECENT,
    sky_turn_deg: float = 0.0, replaced: tuple[str, ...] = (), fresh: bool = False,
    device: Any = None,
) -> Mode:  # fmt: skip
    """Start the mode on a store; parameters as in `mode.open_store`."""
    from lambent.viewer.modes.walk.mode import open_store

    how = light_field_mb, policy, sky_turn_deg, replaced, fresh, device
    return open_store(path, "walk" if name == "walk" else "orbit", screen, *how)
