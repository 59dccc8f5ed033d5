"""`lambent walk`: the window, on foot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import parse_size


def command(
    store: Annotated[Path, typer.Argument(help="Folder of a baked store.")],
    size: Annotated[str, typer.Option(help="WIDTHxHEIGHT of the window.")] = "1680x1050",
) -> None:
    """Walk through a baked scene: WASD and the mouse; standing still converges to the exact picture.

    Example: lambent walk room.store
    """
    window = parse_size(size)
    from lambent.viewer import app

    app.run(store, mode="walk", size=window)
