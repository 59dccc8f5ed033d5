"""`lambent serve`: a site, or a store, to a browser."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import note, say


def command(
    site: Annotated[Path, typer.Argument(help="Folder of a site, or of a baked store.")],
    host: Annotated[
        str, typer.Option(help="Address to serve at; others than this machine's let other machines look in.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 takes any free one.")] = 8000,
) -> None:
    """Serve a site to browsers, until Ctrl-C; a store is exported first, into a temporary folder.

    Example: lambent serve site
    """
    from lambent.site.replacing import is_unfinished
    from lambent.site.serving import SiteServer

    with ExitStack() as stack:
        if (site / "manifest.json").is_file() and not (site / "index.html").is_file() and not is_unfinished(site):
            from lambent.api.sites import export

            store, site = site, Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="lambent-site-")))
            export(store, site, note=note, progress=True)
        server = stack.enter_context(SiteServer(site, host, port))
        say(f"{server.address} (Ctrl-C ends it)")
        server.serve_forever()
