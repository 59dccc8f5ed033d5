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
            help="Measured table in any known format, or material document; or a scene, store or session (.edits.json) "
            "whose materials are edited in place."
        ),
    ],
    material: Annotated[
        Path | None,
        typer.Argument(help="Material document to start from; beside another document, the one to compare with."),
    ] = None,
    environment: Annotated[
        list[Path] | None,
        typer.Option(
            help="Lat-long .hdr or .exr that lights the preview. Repeatable. Scenes: replaces the environment."
        ),
    ] = None,
    camera: Annotated[
        str | None, typer.Option(help="Scenes: camera or saved view by name. [default: the first]")
    ] = None,
    picture: Annotated[str | None, typer.Option(help="Scenes: WIDTHxHEIGHT of the picture. [default: 512x512]")] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Scenes: folder of the store that keeps the baked transport.")
    ] = None,
    crease_angle: CreaseAngle = None,
    size: Size = SIZE,
) -> None:
    """Edit a material beside its measurement, or pull the curves of a scene's materials while the picture follows.

    Example: lambent edit brushed.bsdf brushed.json --environment studio.hdr
    """
    pixels, resolution = parse_size(size), parse_size(picture, "--picture") if picture else None
    from lambent.api.windows import window

    window(
        what, "edit", material=material, environments=environment or (), camera=camera, picture=resolution,
        store=output, crease_deg=crease_angle, size=pixels,
    )  # fmt: skip
