"""`lambent walk`: the window, on foot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import parse_size

Store = Annotated[Path, typer.Argument(help="Folder of a baked store.")]
Size = Annotated[str, typer.Option(help="WIDTHxHEIGHT of the window.")]
SIZE = "1680x1050"


def command(store: Store, size: Size = SIZE) -> None:
    """Walk through a baked scene: WASD and the mouse; standing still converges to the exact answer for the baked light.

    Example: lambent walk room.store
    """
    show(store, "walk", size)


def show(store: Path, mode: str, size: str) -> None:
    """Open the window on a store."""
    pixels = parse_size(size)
    from lambent.viewer import app

    app.run(store, mode, size=pixels)
