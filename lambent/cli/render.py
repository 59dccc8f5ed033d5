"""`lambent render`: stills, films and image sequences of a store, without a window."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from lambent.cli.console import Force, Json, parse_size, progress_bar, say, show
from lambent.core.errors import UserError

if TYPE_CHECKING:
    from lambent.core.false_colour import Range
    from lambent.render import Settings

SHEET_SIZE = "640x360"  # of each of the variants
MEASURED = {"luminance": "full", "illuminance": "light-map"}  # the part of the light that has it
SHOWN_BY = (
    "store",
    "output",
    "edit",
    "surfaces",
    "exposure",
    "ev100",
    "view",
    "false_range",
    "linear",
    "force",
    "json",
)  # edited views


def command(
    context: typer.Context,
    store: Annotated[Path, typer.Argument(help="Folder of a baked store.")],
    output: Annotated[
        Path,
        typer.Option("-o", help="Image (.png, .exr, .hdr), film (.mp4), or with --path images (tour-####.png, .exr)."),
    ],
    camera: Annotated[str | None, typer.Option(help="Camera or saved view by name. [default: the first]")] = None,
    path: Annotated[
        str | None, typer.Option(help="Camera path or recorded walk by name, for films. [default: the first]")
    ] = None,
    size: Annotated[str, typer.Option(help="WIDTHxHEIGHT in pixels.")] = "1280x720",
    integrator: Annotated[
        str,
        typer.Option(
            help="lamps, rings, lobe-4.24, lobe-4.25, fis, split-sum, qmc, oslf, oslf-points, diffuse, or path: the "
            "path tracer."
        ),
    ] = "lamps",
    samples: Annotated[int | None, typer.Option(min=1, help="Per pixel (path, qmc) or per lobe.")] = None,
    exposure: Annotated[
        str | None,
        typer.Option(
            help="In EV: stops on radiance. [default: the scene's, else metered] With --variants also light: variants "
            "in the same light share one, other light is metered [default]; each: every picture is; one: that of the "
            "first for all. Captions say EV100 where it differs."
        ),
    ] = None,
    ev100: Annotated[
        float | None, typer.Option("--ev100", help="The same as EV100, 15 in the sun, 8 in a room by night.")
    ] = None,
    view: Annotated[
        str, typer.Option(help="How PNG and MP4 show light: filmic, neutral, linear, or false-colour (cd/m2).")
    ] = "filmic",
    false_range: Annotated[
        str | None,
        typer.Option("--range", help="LOW:HIGH of false colours, cd/m2 or lx. [default: by the first image]"),
    ] = None,
    linear: Annotated[bool, typer.Option("--linear", help="False colours at even steps, not decades.")] = False,
    part: Annotated[
        str,
        typer.Option(
            "--show",
            help="full, diffuse, specular, light-map: irradiance, or noise: its standard error, %. In false colours: "
            "luminance (cd/m2) or illuminance of surfaces (lx).",
        ),
    ] = "full",
    planar: Annotated[
        str,
        typer.Option(
            help="How flat mirrors and floors are drawn: auto, off (from their probes), or as the integrator knows: "
            "interleaved, marched or fixed (lamps, rings), thesis (lobe-4.24, lobe-4.25), fis."
        ),
    ] = "auto",
    lookup: Annotated[
        str,
        typer.Option(
            help="Where reflected rays find their light: auto, planes, distance or plain (of probes), or light_field, "
            "light_field-1, -bn, -br, -average, -angle, -nearest; -surface shows the object itself from it, too; "
            "-choice, which point answers."
        ),
    ] = "auto",
    light_field_mb: Annotated[
        float | None, typer.Option(min=0, help="GPU memory for the maps of light fields. [default: all of them]")
    ] = None,
    light: Annotated[
        list[str] | None,
        typer.Option(
            help="NAME=VALUE of a light group: an intensity, off, 2700K, #rrggbb, or several with commas; in a film "
            "with @SECONDS. Repeatable. [default: as saved with the view, else as baked]"
        ),
    ] = None,
    light_field_cache: Annotated[
        str, typer.Option(help="Which maps go where not all have room: least-recent or adaptive.")
    ] = "least-recent",
    sky_turn: Annotated[
        float,
        typer.Option(
            help="Degrees by which the sky, its sun and what light fields see of both turn about the vertical; "
            "light on surfaces stays as baked."
        ),
    ] = 0.0,
    projection: Annotated[
        Literal["perspective", "fisheye", "hemispherical", "cylinder"],
        typer.Option(help="How directions lie in the picture; fisheyes are square."),
    ] = "perspective",
    field: Annotated[
        float | None, typer.Option(help="Degrees across a fisheye or a cylinder. [default: 180, 360]")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="For path: another seed has independent noise.")] = 0,
    scene: Annotated[str | None, typer.Option(help="For path: the scene, where the store's is not found.")] = None,
    edit: Annotated[
        Path | None, typer.Option(help="Session of edits: draws its view as edited, from the store's transport.")
    ] = None,
    surfaces: Annotated[
        str | None,
        typer.Option(
            help="MOST or LEAST:MOST surfaces on the paths that --edit shows; 1 is direct light. [default: all]"
        ),
    ] = None,
    recolour: Annotated[
        list[str] | None,
        typer.Option(
            help="MATERIAL=#rrggbb: another diffuse colour, which the baked light answers; path traces it. Repeatable."
        ),
    ] = None,
    variant: Annotated[
        str,
        typer.Option(
            help="Variant of the scene, or a state that was stored in the window (saved: as the window was left): its "
            "materials and its mix of the light, which answers."
        ),
    ] = "",
    variants: Annotated[
        bool,
        typer.Option("--variants", help="All variants in one picture, each of --size, with their names. [640x360]"),
    ] = False,
    keyframes: Annotated[
        Path | None, typer.Option(help="File of states of materials and light over the time of a film (.toml).")
    ] = None,
    replace: Annotated[
        list[str] | None,
        typer.Option(
            help="OBJECT=FILE or OBJECT=FILE,MATERIAL: the mesh of a file in the place of an object whose light field "
            "is of a volume; path traces it. Repeatable."
        ),
    ] = None,
    fps: Annotated[int, typer.Option(min=1, max=240, help="Frames per second of a film.")] = 30,
    force: Force = False,
    json: Json = False,
) -> None:
    """Render a still or a film: EXR and HDR keep radiance, PNG and MP4 show it through a view transform.

    Example: lambent render room.store --camera entrance -o entrance.png

    Example: lambent render room.store --light sun=off --light lamp=0.5,2700K -o evening.png

    Example: lambent render room.store --recolour wall_paint=#31457c -o blue.png

    Example: lambent render house.store --variant walnut -o walnut.png

    Example: lambent render house.store --variants --camera entrance -o sheet.png

    Example: lambent render house.store --path tour --keyframes evening.toml -o evening.mp4

    Example: lambent render room.store --replace teapot=vase.obj -o vase.png

    Example: lambent render tray.store --edit tray.edits.json -o tray.png
    """
    from lambent import render
    from lambent.core.film import FILM, SEQUENCES, check_pictures
    from lambent.core.images import WRITABLE
    from lambent.core.light_mix import parse_light
    from lambent.core.outputs import check_output
    from lambent.core.projections import Projection
    from lambent.materials.recolour import parse_recolours
    from lambent.scenes.replacement import parse_replacements

    exposure_ev, exposures = parse_exposure(exposure, variants=variants)
    if ev100 is not None:
        exposure_ev = _exposure_of(ev100, exposure)
    if part in MEASURED:
        if view not in ("filmic", "false-colour"):
            raise UserError("is shown in false colours", field="--show", got=part, hint="leave out --view")
        part, view = MEASURED[part], "false-colour"
    scale = parse_range(false_range, log=not linear) if false_range is not None else None
    if variants and not _is_said(context, "size"):
        size = SHEET_SIZE
    settings = render.Settings(
        *parse_size(size), integrator, samples, exposure_ev, view, scale, log=not linear, show=part, planar=planar,
        lookup=lookup, projection=Projection(projection), field_deg=field, light_field_mb=light_field_mb, seed=seed,
        light=parse_light(light) if light else None, sky_turn_deg=sky_turn, light_field_cache=light_field_cache,
        recolour=parse_recolours(recolour or ()), replacements=parse_replacements(replace or ()), variant=variant,
    )  # fmt: skip
    settings.check()
    for option in ("false_range", "linear"):
        if _is_said(context, option) and not settings.is_false_coloured:
            name = "--range" if option == "false_range" else "--linear"
            raise UserError("is of false colours", field=name, hint="add --view false-colour")
    if edit is not None:
        _check_edit(context, edit)
        check_output(output, WRITABLE, force=force)
        done = render.edited_still(store, edit, output, settings, parse_surfaces(surfaces or "1:99"))
        show(asdict(done), f"{output}: {done.width}x{done.height}, edited, {done.seconds:.1f} s", json)
        return
    if surfaces is not None:
        raise UserError("says what an edited view shows", field="--surfaces", hint="name a session with --edit")
    if variants and (variant or replace):
        raise UserError("says one variant and all of them", field="--variant", hint="leave out one of both")
    if variants and path is not None:
        raise UserError("a sheet is of one view", field="--path", hint="name it with --camera")
    suffix = output.suffix.lower()
    moves = not variants and (suffix == FILM or (path is not None and suffix in SEQUENCES))
    check_output(output, (".png",) if variants else (*WRITABLE, FILM), force=force or moves)
    if keyframes is not None and not moves:
        raise UserError("keyframes are of films", field="--keyframes", hint="write to .mp4, or name a --path")
    if not moves:
        _check_still(context, settings)
    if moves and camera is not None:
        raise UserError("a film needs a path", field="--camera", hint="name a path with --path")
    if path is not None and not moves:
        raise UserError("a path makes a film", field="--path", hint="write to .mp4, .png or .exr")
    if moves:
        check_pictures(output, force=force)

    def note(text: str) -> None:
        say(f"note: {text}")

    with progress_bar() as progress:
        if moves:
            done = render.film(
                store, output, path, settings, fps=fps, keyframes=keyframes, scene=scene, note=note, progress=progress
            )
        elif variants:
            done = render.sheet(
                store, output, camera, settings, exposures=exposures, scene=scene, note=note, progress=progress
            )
        else:
            done = render.still(store, output, camera, settings, scene=scene, note=note, progress=progress)
    size = f"{done.width}x{done.height}"
    exposed = "" if done.ev100 is None else f"EV100 {done.ev100:.1f}, "
    text = f"{output}: {size}, {done.frames} frame(s), {done.integrator}, {exposed}{done.seconds:.1f} s"
    show(asdict(done), text, json)


def _check_still(context: typer.Context, settings: Settings) -> None:
    """Refuse options that only a film has."""
    if _is_said(context, "fps"):
        raise UserError("is of films", field="--fps", hint="write to .mp4, or name a --path")
    for name, keys in settings.light.groups.items() if settings.light is not None else ():
        if len(keys) > 1 or keys[0][0] > 0:
            got = f"{name} at {keys[-1][0]:g} s"
            raise UserError(
                "a still has no time", field="--light", got=got, hint="leave out @SECONDS, or write to .mp4"
            )


def parse_exposure(text: str | None, *, variants: bool) -> tuple[float | None, str]:
    """Stops, if they are said, and how the pictures of a sheet of `variants` are exposed, of "-1.5" or "each"."""
    from lambent.render.sheet import BY_LIGHT, EXPOSURES

    if text is None:
        return None, BY_LIGHT
    if text in EXPOSURES:
        if not variants:
            raise UserError("is of a sheet", field="--exposure", got=text, expected="EV", hint="or add --variants")
        return None, text
    try:
        return float(text), BY_LIGHT
    except ValueError:
        expected = "EV, such as -1.5" + (f", or {', '.join(EXPOSURES)}" if variants else "")
        raise UserError("not an exposure", field="--exposure", got=text, expected=expected) from None


def _exposure_of(ev100: float, exposure: str | None) -> float:
    """Stops on radiance of an EV100."""
    from lambent.core.exposure import ev100_of, exposure_of
    from lambent.render.images import MOST_EV

    if exposure is not None:
        raise UserError("says the exposure twice", field="--ev100", hint="leave out --exposure")
    found = exposure_of(ev100)
    if not -MOST_EV <= found <= MOST_EV:
        expected = f"{ev100_of(MOST_EV):.0f} to {ev100_of(-MOST_EV):.0f}"
        raise UserError("exposure is out of range", field="--ev100", got=ev100, expected=expected)
    return found


def parse_range(text: str, *, log: bool) -> Range:
    """The range of "10:500"; `log` where its colours stand at even decades."""
    from lambent.core.false_colour import Range

    low, _, high = text.partition(":")
    try:
        return Range(float(low), float(high), log)
    except ValueError:
        raise UserError("not a range", field="--range", got=text, expected="LOW:HIGH, as in 10:500") from None


def parse_surfaces(text: str) -> tuple[int, int]:
    """The range of "3" or "2:3"."""
    least, _, most = text.rpartition(":")
    try:
        found = int(least or 1), int(most)
    except ValueError:
        found = (0, 0)
    if not 1 <= found[0] <= found[1]:
        raise UserError("not a range of surfaces", field="--surfaces", got=text, expected="MOST or LEAST:MOST, from 1")
    return found


def _is_said(context: typer.Context, name: str) -> bool:
    """Whether an option was given, and is not by default."""
    source = context.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"


def _check_edit(context: typer.Context, session: Path) -> None:
    """Refuse options of which a session leaves no choice."""
    for parameter in context.command.params:
        if parameter.name not in SHOWN_BY and _is_said(context, parameter.name or ""):
            what = "an edited view has its own camera, size and light"
            raise UserError(what, field=parameter.opts[0], hint=f"leave it out, or --edit {session}")
