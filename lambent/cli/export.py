"""`lambent export`: a baked store as a web site."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from lambent.cli.console import Json, note, parse_size, show, table
from lambent.cli.walk import Store


def command(
    store: Store,
    output: Annotated[Path, typer.Option("-o", help="Folder to write: new, empty, or an earlier export to replace.")],
    as_: Annotated[
        Literal["site", "html"],
        typer.Option(
            "--as", help="site: to walk in; html: a page of stills, each view in each state, for any browser."
        ),
    ] = "site",
    size: Annotated[str | None, typer.Option(help="WIDTHxHEIGHT of a still. [default: 1280x720]")] = None,
    view: Annotated[
        list[str] | None, typer.Option(help="Stills: a camera or saved view. Repeatable. [default: all]")
    ] = None,
    json: Json = False,
) -> None:
    """Write a room as a static web site: a browser with WebGPU walks in it, or any browser shows its stills.

    Example: lambent export room.store -o site

    Example: lambent export room.store -o stills --as html --view entrance
    """
    from lambent.api.sites import export

    wanted = None if size is None else parse_size(size)
    made = export(store, output, as_=as_, size=wanted, views=view or (), note=note, progress=True)
    rows = [(as_, str(output)), ("to transfer", f"{made['bytes'] / 1e6:.1f} MB")]
    if as_ == "site":
        rows.append(("folder", f"{made['folder_bytes'] / 1e6:.1f} MB in {made['files']} files of data"))
        memory = f"{made['graphics_bytes'] / 1e6:.0f} MB of graphics, {made['script_bytes'] / 1e6:.0f} MB of JavaScript"
        rows.append(("memory", memory))
        of_groups = [f"{name} {size / 1e6:.1f} MB" for name, size in made["by_light_group"].items()]
        rows += [("more, by slider", ", ".join(of_groups))] if of_groups else []
    show(made, f"{table(rows)}\n\nto look at it: lambent serve {output}", json)
