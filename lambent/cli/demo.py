"""`lambent demo`: the whole flow on the built-in room."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import Json, progress_bar, say, show, table
from lambent.core.machine import has_display

NEXT = """next:
  lambent walk {out}/store
  lambent edit {out}/measured/brushed_aluminium.txt {out}/materials/brushed_aluminium.json
  lambent fit YOUR_MEASUREMENT --lobes auto -o yours.json --report yours.html"""
SITE = "\n  lambent serve {out}/site"


def command(
    out: Annotated[Path, typer.Option(help="Output folder.")] = Path("out/demo"),
    headless: Annotated[bool, typer.Option("--headless", help="Write images and a film; open no window.")] = False,
    quick: Annotated[bool, typer.Option("--quick", help="Coarser bake, smaller film.")] = False,
    json: Json = False,
) -> None:
    """Measure four materials, fit them, place them in a room, bake it and walk through it.

    Opens the window where there is a display; otherwise, or with --headless, writes stills, a film, a comparison with
    the path tracer, a web site and demo.json. After an interruption, the same command continues.

    Example: lambent demo --headless --quick
    """
    from lambent.demo.flow import FULL, QUICK, Flow

    with progress_bar() as progress:
        flow = Flow(out, QUICK if quick else FULL, progress)
        scene = flow.prepare()
        windowless = headless or not has_display()
        if windowless:
            flow.walk()
            flow.compare(scene)
            flow.share()
    report = flow.finish()
    rows = ((name, f"{seconds:.1f} s") for name, seconds in report["seconds"].items())
    ahead = (NEXT + SITE * windowless).format(out=out)
    show(report, f"{table(rows)}\n\n{out / 'demo.json'}\n\n{ahead}", json)
    if not windowless:
        from lambent.viewer.app import run

        say(f"opening the window; to open it again: lambent walk {flow.store_path}")
        run(flow.store_path, "walk")
