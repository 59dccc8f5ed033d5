"""`lambent view`: the window, orbiting a camera's target."""

from __future__ import annotations

from lambent.cli.console import LEAST_RECENT, Cache, Memory
from lambent.cli.walk import SIZE, Fresh, Replace, Size, Store, Turn, show


def command(
    store: Store, size: Size = SIZE, light_field_mb: Memory = None, light_field_cache: Cache = LEAST_RECENT,
    sky_turn: Turn = 0.0, replace: Replace = None, fresh: Fresh = False,
) -> None:  # fmt: skip
    """Orbit an object of a baked scene: drag to turn, scroll to come nearer; the same window as `walk`.

    Example: lambent view room.store
    """
    show(store, "view", size, light_field_mb, light_field_cache, sky_turn, replace, fresh)
