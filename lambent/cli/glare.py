"""`lambent glare`: discomfort glare of a view, from a Radiance picture or a baked store."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import Force, Json, note, show, table
from lambent.core.errors import UserError


def command(
    what: Annotated[Path, typer.Argument(help="Radiance fisheye picture (.hdr), or folder of a baked store.")],
    output: Annotated[
        Path | None, typer.Option("-o", help="Write a picture with the glare sources marked (.png).")
    ] = None,
    camera: Annotated[
        str | None, typer.Option(help="Stores: camera or saved view by name. [default: the first]")
    ] = None,
    integrator: Annotated[str, typer.Option(help="Stores: integrator, as of `lambent render`.")] = "traced",
    threshold: Annotated[float, typer.Option(min=1, help="Least luminance of a glare source, cd/m2.")] = 2000.0,
    force: Force = False,
    json: Json = False,
) -> None:
    """Rate the glare of a view: daylight glare probability (DGP), unified glare rating (UGR), and every source.

    Example: lambent glare room.store --camera entrance -o glare.png
    """
    from lambent.api.glare import glare
    from lambent.core.outputs import check_output
    from lambent.core.pictures.images import write_shown

    if output is not None:
        check_output(output, (".png",), force=force, inputs=[what])
    if not what.is_dir() and camera is not None:
        raise UserError("applies to stores only", field="--camera", got=camera, hint="a picture has its own view")
    settings = {"integrator": integrator} if what.is_dir() else {}
    found = glare(what, camera, threshold_cd_m2=threshold, note=note, progress=True, **settings)
    if output is not None:
        write_shown(output, found.marked())
    facts = {key: getattr(found, key) for key in ("dgp", "ugr", "comfort", "illuminance_lx", "background")}
    facts |= {"sources": [asdict(source) for source in found.sources], "written": output}
    lines = [
        ("DGP", f"{found.dgp:.3f}, {found.comfort}"),
        ("UGR", f"{found.ugr:.1f}"),
        ("at the eye", f"{found.illuminance_lx:.0f} lx"),
        ("background", f"{found.background:.0f} cd/m2"),
    ]
    columns = ("cd/m2", "sr", "position index", "right, deg", "up, deg")
    rows = [tuple(f"{value:.4g}" for value in asdict(source).values()) for source in found.sources]
    show(facts, "\n\n".join([table(lines), table([columns, *rows]) if rows else "no glare sources"]), json)
