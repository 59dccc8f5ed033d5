"""`lambent edit`: a material against its measurement, in a window."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import parse_size
from lambent.cli.walk import SIZE, Size


def command(
    file: Annotated[Path, typer.Argument(help="Measured table in any known format, or a material document.")],
    material: Annotated[
        Path | None, typer.Argument(help="Material document to start from; with two documents, the one to compare.")
    ] = None,
    environment: Annotated[
        list[Path] | None, typer.Option(help="Lat-long .hdr or .exr to light the preview with. Repeatable.")
    ] = None,
    size: Size = SIZE,
) -> None:
    """Edit a material beside its measurement: disks, curves, error and preview follow every drag; fit, undo, save.

    Example: lambent edit brushed.bsdf brushed.json --environment studio.hdr
    """
    pixels = parse_size(size)
    from lambent.viewer import edit

    edit.run(file, material, environment or (), size=pixels)
