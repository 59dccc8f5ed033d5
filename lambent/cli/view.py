"""`lambent view`: the window, turning about what a camera looks at."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import parse_size


def command(
    store: Annotated[Path, typer.Argument(help="Folder of a baked store.")],
    size: Annotated[str, typer.Option(help="WIDTHxHEIGHT of the window.")] = "1680x1050",
) -> None:
    """Turn about an object of a baked scene: drag to orbit, wheel to come nearer; the same window as `walk`.

    Example: lambent view room.store
    """
    window = parse_size(size)
    from lambent.viewer import app

    app.run(store, mode="view", size=window)
