"""`lambent relight`: a view under a turned or another environment, in the window or as a still."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import Force, Json, parse_size, show
from lambent.cli.walk import SIZE, Size
from lambent.core.errors import UserError
from lambent.core.surroundings import Axis, Layout


def command(
    store: Annotated[Path, typer.Argument(help="Folder of a store; for -o, with a view baked for relighting.")],
    output: Annotated[
        Path | None, typer.Option("-o", help="Image to write (.exr, .hdr, .png). [default: open the window]")
    ] = None,
    camera: Annotated[str | None, typer.Option(help="Camera by name. [default: the first]")] = None,
    environment: Annotated[
        Path | None, typer.Option(help="Picture that lights the scene. [default: the scene's own environment]")
    ] = None,
    layout: Annotated[Layout | None, typer.Option(help="Layout of the picture. [default: recognised]")] = None,
    up: Annotated[Axis, typer.Option(help="World axis of the picture's up direction.")] = "+y",
    scale: Annotated[float, typer.Option(min=0.0, help="Factor on the picture's radiance.")] = 1.0,
    turn: Annotated[
        float | None, typer.Option(help="Rotation of the environment about +y, degrees. [default: 0, or the session's]")
    ] = None,
    exposure: Annotated[float | None, typer.Option(help="Exposure of a PNG, in EV. [default: metered]")] = None,
    force: Force = False,
    json: Json = False,
    size: Size = SIZE,
) -> None:
    """Show a view under a turned or another environment: direct light with shadows.

    In the window, materials are as edited in the room; with -o, as baked.

    Example: lambent relight room.store --environment grace.hdr --turn 90 -o grace.png
    """
    if turn is not None and not math.isfinite(turn):
        raise UserError("is no angle", field="--turn", got=turn, expected="degrees")
    if output is None:
        for name, given in (("exposure", exposure is not None), ("force", force), ("json", json)):
            if given:
                raise UserError("is for a picture", field=f"--{name}", hint="name it with -o")
        pixels = parse_size(size)
        from lambent.api.windows import window

        sky = None if environment is None else {"path": environment, "layout": layout, "up": up, "scale": scale}
        window(store, "relight", size=pixels, camera=camera, environment=sky, turn_deg=turn)
        return
    from dataclasses import replace

    from lambent.api.stores import Store
    from lambent.core.outputs import check_output
    from lambent.core.pictures.images import WRITABLE

    check_output(output, WRITABLE, force=force)
    picture = Store(store).relight(
        camera, environment=environment, layout=layout, up=up, scale=scale, turn_deg=turn or 0.0
    )
    (picture if exposure is None else replace(picture, exposure_ev=exposure)).save(output)
    height, width = picture.radiance.shape[:2]
    name, left_out = picture.details["camera"], picture.details["left_out"]
    text = f"{output}: {width}x{height}, camera {name}, left out {100 * left_out:.2g} %"
    show({"written": output, "camera": name, "size": [width, height], "left_out": left_out}, text, json)
