"""`lambent export`: a baked store as a web site."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import Json, note, show, table
from lambent.cli.walk import Store


def command(
    store: Store,
    output: Annotated[Path, typer.Option("-o", help="Folder of the site: new, empty, or a site to replace.")],
    json: Json = False,
) -> None:
    """Write a room as a static web site: a browser with WebGPU walks in it, from any host.

    Example: lambent export room.store -o site
    """
    from lambent.api.sites import export

    made = export(store, output, note=note, progress=True)
    rows = [("site", str(output)), ("to transfer", f"{made['bytes'] / 1e6:.1f} MB in {made['files']} files")]
    show(made, f"{table(rows)}\n\nto look at it: lambent serve {output}", json)
