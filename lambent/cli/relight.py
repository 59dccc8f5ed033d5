"""`lambent relight`: a view under a turned or another environment, in the window or as a still."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lambent.cli.console import Force, Json, parse_size, show
from lambent.cli.walk import SIZE, Size
from lambent.core.errors import UserError
from lambent.core.surroundings import Axis, Layout

if TYPE_CHECKING:
    from lambent.store.contract import ViewRecord
    from lambent.store.store import Store


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
        from lambent.viewer import app

        sky = None if environment is None else {"path": environment, "layout": layout, "up": up, "scale": scale}
        app.run(store, "relight", size=pixels, camera=camera, environment=sky, turn_deg=turn)
        return
    from lambent.core.light.colour import shown
    from lambent.core.light.exposure import metered
    from lambent.core.outputs import check_output
    from lambent.core.pictures.images import WRITABLE, to_bytes, write_image, write_shown
    from lambent.editing.relit_view import RelitView
    from lambent.scenes.scene import ImageEnvironment
    from lambent.store.store import Store

    check_output(output, WRITABLE, force=force)
    opened = Store.open(store)
    record = _chosen(opened, camera)
    view = RelitView(opened, record.camera, record.width, record.height)
    if environment is not None:
        view.light(ImageEnvironment(environment, scale, 0.0, layout, up))
    view.turn(turn or 0.0)
    view.draw()
    image = view.image()
    if output.suffix.lower() == ".png":
        exposure_ev = exposure if exposure is not None else metered(image) or 0.0
        write_shown(output, to_bytes(shown(image, "filmic", exposure_ev)))
    else:
        write_image(output, image)
    facts = {"written": output, "camera": record.camera.name, "size": [record.width, record.height]}
    text = f"{output}: {record.width}x{record.height}, camera {record.camera.name}, left out {100 * view.error:.2g} %"
    show({**facts, "left_out": view.error}, text, json)


def _chosen(store: Store, camera: str | None) -> ViewRecord:
    from lambent.core.discovery import known
    from lambent.editing.relit_view import views_for_relighting

    views = views_for_relighting(store)
    if not views:
        raise UserError("has no view baked for relighting", file=store.folder, hint="see docs/editing.md, Relighting")
    return views[known("camera", camera, views, field="--camera") if camera is not None else next(iter(views))]
