"""`lambent edit`: a material against its measurement, or the materials of a scene in place, in a window."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import CreaseAngle, parse_size
from lambent.cli.walk import SIZE, Size


def command(
    what: Annotated[
        Path,
        typer.Argument(
            help="Measured table in any known format, or a material document; or a scene, a store or a session "
            "(.edits.json), whose materials are edited in place."
        ),
    ],
    material: Annotated[
        Path | None, typer.Argument(help="Material document to start from; with two documents, the one to compare.")
    ] = None,
    environment: Annotated[
        list[Path] | None,
        typer.Option(
            help="Lat-long .hdr or .exr to light the preview with. Repeatable. Of a scene: its only light far away."
        ),
    ] = None,
    camera: Annotated[
        str | None, typer.Option(help="Of a scene: camera or saved view by name. [default: the first]")
    ] = None,
    picture: Annotated[
        str | None, typer.Option(help="Of a scene: WIDTHxHEIGHT of the picture. [default: 512x512]")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Of a scene: folder of the store that keeps its transport.")
    ] = None,
    crease_angle: CreaseAngle = None,
    size: Size = SIZE,
) -> None:
    """Edit a material beside its measurement; or pull the curves of a scene's materials, and the picture follows.

    Example: lambent edit brushed.bsdf brushed.json --environment studio.hdr
    """
    pixels, resolution = parse_size(size), parse_size(picture, "--picture") if picture else None
    from lambent.viewer import edit

    edit.run(
        what, material, environment or (), camera=camera, picture=resolution, store=output, crease_deg=crease_angle,
        size=pixels,
    )  # fmt: skip
