"""`lambent illuminance`: illuminance and uniformity on calculation grids."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import Force, Json, note, progress_bar, show, table, words
from lambent.core.errors import UserError, invalid


def command(
    store: Annotated[Path, typer.Argument(help="Folder of a baked store.")],
    output: Annotated[list[Path] | None, typer.Option("-o", help="Points (.csv), pages (.pdf). Repeatable.")] = None,
    grid: Annotated[list[str] | None, typer.Option(help="Grid by name. Repeatable. [default: all]")] = None,
    over: Annotated[str | None, typer.Option("--object", help="Instead: over an object or a room's floor.")] = None,
    height: Annotated[float | None, typer.Option(help="Above the object, m. [default: .75]")] = None,
    spacing: Annotated[float | None, typer.Option(min=1e-3, help="Of points, m. [default: as in EN 12464-1]")] = None,
    margin: Annotated[float | None, typer.Option(min=0, help="Band left out, m. [default: .5; narrow: 15 %]")] = None,
    light: Annotated[list[str] | None, typer.Option(help="NAME=VALUE, as of `lambent render`. Repeatable.")] = None,
    variant: Annotated[list[str] | None, typer.Option(help="Variant, or state of the window. Repeatable.")] = None,
    error: Annotated[float, typer.Option(min=0.01, help="Most standard error of a point, %.")] = 0.5,
    maintenance: Annotated[float, typer.Option(min=0, max=1, help="Maintenance factor on all results.")] = 1.0,
    force: Force = False,
    json: Json = False,
) -> None:
    """Trace the illuminance on calculation grids: mean, extremes, uniformities U0 = min/mean and Ud = min/max.

    Example: lambent illuminance room.store --object floor --light sun=off -o desks.pdf
    """
    from pydantic import ValidationError

    from lambent.core.light.light_mix import parse_light
    from lambent.core.outputs import check_output
    from lambent.render import Settings
    from lambent.render.illuminance import illuminated, write_pages, write_points
    from lambent.scenes.loaders.scene_toml.grids import GridSection
    from lambent.store.store import Store

    for path in output or ():
        check_output(path, (".csv", ".pdf"), force=force)
    wanted: GridSection | list[str] = grid or []
    if over is not None:
        try:
            wanted = GridSection(name=over, object=over, height_m=height, spacing_m=spacing, margin_m=margin)
        except ValidationError as fault:
            raise invalid(fault, "--object") from fault
        if grid:
            raise UserError("excludes --object", field="--grid", hint="leave out one")
    elif (height, spacing, margin) != (None, None, None):
        raise UserError("apply to --object only", field="--height, --spacing, --margin", hint="name it with --object")
    opened, results = Store.open(store), []
    with progress_bar() as progress:
        for name in variant or [""]:
            settings = Settings(light=parse_light(light) if light else None, variant=name)
            state = ", ".join([name] * bool(name) + (light or [])) or "as baked"
            results += illuminated(opened, settings, wanted, state, error / 100, maintenance, note, progress)
    for path in output or ():
        if path.suffix.lower() == ".csv":
            write_points(path, results)
        else:
            write_pages(path, results, opened, f"maintenance factor {maintenance:g}")
    facts = [one.facts() for one in results]
    rows = [list(facts[0]), *([words(value) for value in one.values()] for one in facts)]
    show({"maintenance": maintenance, "results": facts, "written": output or []}, table(rows), json)
