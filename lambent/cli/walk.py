"""`lambent walk`: the window, on foot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from lambent.cli.console import LEAST_RECENT, Cache, Memory, parse_size

Store = Annotated[Path, typer.Argument(help="Folder of a baked store.")]
Size = Annotated[str, typer.Option(help="WIDTHxHEIGHT of the window.")]
Replace = Annotated[
    list[str] | None,
    typer.Option(help="OBJECT=FILE[,MATERIAL]: show another mesh in place of an object, as in `render`."),
]
Fresh = Annotated[
    bool, typer.Option("--fresh", help="Begin as baked; the store's session is set aside at the first edit.")
]
Turn = Annotated[float, typer.Option(help="Rotation of the sky about the vertical, degrees; see `render`.")]
SIZE = "1680x1050"


def command(
    store: Store, size: Size = SIZE, light_field_mb: Memory = None, light_field_cache: Cache = LEAST_RECENT,
    sky_turn: Turn = 0.0, replace: Replace = None, fresh: Fresh = False,
) -> None:  # fmt: skip
    """Walk through a baked scene: WASD and the mouse; at rest it converges to the exact answer for the baked light.

    Example: lambent walk room.store
    """
    show(store, "walk", size, light_field_mb, light_field_cache, sky_turn, replace, fresh)


def show(
    store: Path, mode: Literal["walk", "view"], size: str, light_field_mb: float | None, policy: str,
    sky_turn_deg: float, replace: list[str] | None, fresh: bool,
) -> None:  # fmt: skip
    """Open the window on a store."""
    pixels = parse_size(size)
    from lambent.api.windows import window

    window(
        store, mode, size=pixels, light_field_mb=light_field_mb, policy=policy, sky_turn_deg=sky_turn_deg,
        replaced=tuple(replace or ()), fresh=fresh,
    )  # fmt: skip
