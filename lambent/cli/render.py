"""`lambent render`: stills, films and image sequences of a store, without a window."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from lambent.cli.console import LEAST_RECENT, Cache, Force, Json, Memory, note, parse_size, progress_bar, show
from lambent.core.errors import UserError

if TYPE_CHECKING:
    from lambent.core.light.false_colour import Range
    from lambent.render import Settings

OF_FILMS = "applies to films only", "write to .mp4, or add --path NAME"  # a fault and its hint
OF_TRACER, NO_VARIANTS = "applies to the path tracer only", "excludes --variants"
SHEET_SIZE = "640x360"  # of each picture in a sheet
MEASURED = {"luminance": "full", "illuminance": "light-map"}  # quantity -> value of --show
SHOWN_BY = ("store", "output", "edit", "surfaces", "exposure", "ev100", "view", "false_range", "linear", "force",
            "json")  # options of edited views  # fmt: skip


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
            help="traced (against the baked light), path (whole paths), or drawn as in motion: lamps, rings, "
            "lobe-4.24, lobe-4.25, fis, split-sum, qmc, diffuse."
        ),
    ] = "traced",
    samples: Annotated[
        int | None, typer.Option(min=1, help="Samples per pixel (traced, path, qmc) or per lobe.")
    ] = None,
    noise: Annotated[
        float | None,
        typer.Option(
            help="Traced pictures: relative error at which they end. [default: .02 or 48 samples; films 8; path 64]"
        ),
    ] = None,
    denoise: Annotated[
        bool | None,
        typer.Option("--denoise/--no-denoise", help="Denoise traced pictures. [default: traced yes, path no]"),
    ] = None,
    exposure: Annotated[
        str | None,
        typer.Option(
            help="Exposure in EV (stops on radiance). [default: the scene's, else metered] With --variants also: light "
            "(meter once per mix of light) [default], each (meter every picture), one (the first picture's for all). "
            "Captions show EV100 where it differs."
        ),
    ] = None,
    ev100: Annotated[
        float | None, typer.Option("--ev100", help="Exposure as EV100: 15 in the sun, 8 in a room by night.")
    ] = None,
    view: Annotated[
        str, typer.Option(help="View transform of PNG and MP4: filmic, neutral, linear, or false-colour (cd/m2).")
    ] = "filmic",
    false_range: Annotated[
        str | None,
        typer.Option("--range", help="LOW:HIGH of false colours, cd/m2 or lx. [default: fitted to the first image]"),
    ] = None,
    linear: Annotated[bool, typer.Option("--linear", help="Linear false colours. [default: logarithmic]")] = False,
    part: Annotated[
        str,
        typer.Option(
            "--show",
            help="full, diffuse, specular, light-map (irradiance) or noise (of the light map, standard error in %); "
            "in false colours luminance (cd/m2) or illuminance of surfaces (lx).",
        ),
    ] = "full",
    planar: Annotated[
        str,
        typer.Option(
            help="How planar reflectors are drawn: auto (from a mirrored picture) or off (from their probes)."
        ),
    ] = "auto",
    lookup: Annotated[
        str,
        typer.Option(
            help="Look-up of reflected light: auto; in probes: planes, distance, plain; in light fields: light_field, "
            "light_field-choice (shows which point is used)."
        ),
    ] = "auto",
    light_field_mb: Memory = None,
    light: Annotated[
        list[str] | None,
        typer.Option(
            help="NAME=VALUE of a light group: an intensity, off, 2700K, #rrggbb, or several joined by commas; "
            "@SECONDS makes it a keyframe of a film. Repeatable. [default: as saved with the view, else as baked]"
        ),
    ] = None,
    light_field_cache: Cache = LEAST_RECENT,
    sky_turn: Annotated[
        float,
        typer.Option(
            help="Rotation of sky and sun about the vertical, degrees; changes what is seen and mirrored of them, "
            "not the baked light on surfaces."
        ),
    ] = 0.0,
    projection: Annotated[
        Literal["perspective", "fisheye", "hemispherical", "cylinder"],
        typer.Option(help="Projection of the picture; fisheyes are square."),
    ] = "perspective",
    field: Annotated[
        float | None, typer.Option(help="Field of view of a fisheye or a cylinder, degrees. [default: 180, 360]")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="For path: seed of the noise.")] = 0,
    scene: Annotated[
        str | None, typer.Option(help="For path: trace this scene file, with its own materials and lights.")
    ] = None,
    edit: Annotated[
        Path | None,
        typer.Option(help="Session of edits (.edits.json): draw its view as edited, from the store's transport."),
    ] = None,
    surfaces: Annotated[
        str | None,
        typer.Option(
            help="MOST or LEAST:MOST surfaces on the light paths that --edit shows; 1 is direct light. [default: all]"
        ),
    ] = None,
    recolour: Annotated[
        list[str] | None,
        typer.Option(
            help="MATERIAL=#rrggbb: another diffuse colour; indirect light follows. * and ? match names. Repeatable."
        ),
    ] = None,
    texture: Annotated[
        list[str] | None,
        typer.Option(
            help="MATERIAL=FILE[,REPEAT], MATERIAL=MATERIAL or MATERIAL=none: show an image, another material's "
            "textures, or none; their mean becomes its colour, and indirect light follows. Repeatable."
        ),
    ] = None,
    variant: Annotated[
        str,
        typer.Option(help="Variant of the scene, or a state stored in the window (saved: the last session)."),
    ] = "",
    session: Annotated[
        bool,
        typer.Option(
            "--session",
            help="As the window on the store shows it: edits, lamps, light, camera, size, exposure and look, except "
            "for what other options say.",
        ),
    ] = False,
    variants: Annotated[
        bool,
        typer.Option("--variants", help="Draw all variants into one contact sheet, each at --size. [640x360]"),
    ] = False,
    keyframes: Annotated[
        Path | None, typer.Option(help="Films: file of materials and light over time (.toml).")
    ] = None,
    replace: Annotated[
        list[str] | None,
        typer.Option(
            help="OBJECT=FILE or OBJECT=FILE,MATERIAL: show another mesh in place of an object that has a light field "
            "of a volume. Repeatable."
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

    Example: lambent render room.store --texture wall_paint=bricks.jpg,3 -o bricks.png

    Example: lambent render house.store --variant walnut -o walnut.png

    Example: lambent render house.store --variants --camera entrance -o sheet.png

    Example: lambent render house.store --path tour --keyframes evening.toml -o evening.mp4

    Example: lambent render room.store --replace teapot=vase.obj -o vase.png

    Example: lambent render room.store --session -o as-left.png

    Example: lambent render tray.store --edit tray.edits.json -o tray.png
    """
    from lambent import render
    from lambent.core.light.light_mix import parse_light
    from lambent.core.outputs import check_output
    from lambent.core.pictures.film import FILM, SEQUENCES, check_pictures
    from lambent.core.pictures.images import WRITABLE
    from lambent.core.views.projections import Projection
    from lambent.materials.recolour import parse_recolours
    from lambent.scenes.looks.retexturing import parse_textures
    from lambent.scenes.replacement import parse_replacements

    exposure_ev, exposures = parse_exposure(exposure, variants=variants)
    if ev100 is not None:
        exposure_ev = _exposure_of(ev100, exposure)
    if part in MEASURED:
        if view not in ("filmic", "false-colour"):
            raise UserError("needs false colours", field="--show", got=part, hint="leave out --view")
        part, view = MEASURED[part], "false-colour"
    scale = parse_range(false_range, log=not linear) if false_range is not None else None
    if variants and not _is_said(context, "size"):
        size = SHEET_SIZE
    settings = render.Settings(
        *parse_size(size), integrator, samples, noise, denoise, exposure_ev, view, scale, log=not linear,
        show=part, planar=planar, lookup=lookup, projection=Projection(projection),
        field_deg=field, light_field_mb=light_field_mb, seed=seed,
        light=parse_light(light) if light else None, sky_turn_deg=sky_turn, light_field_cache=light_field_cache,
        recolour=parse_recolours(recolour or ()), textures=parse_textures(texture or ()),
        replacements=parse_replacements(replace or ()), variant=variant,
    )  # fmt: skip
    if edit is not None:
        _check_edit(context, edit)
    left = None
    if session:
        for option, is_wrong in (
            ("--variant", bool(variant)),
            ("--variants", variants),
            ("--scene", scene is not None),
        ):
            if is_wrong:
                raise UserError("excludes --session", field=option, hint="leave out one")
        settings, left = render.as_left(store, settings, _said_settings(context))
    settings.check()
    plain = not settings.is_false_coloured
    for option, is_wrong in (("--range", false_range is not None and plain), ("--linear", linear and plain)):
        if is_wrong:
            raise UserError("applies to false colours only", field=option, hint="add --view false-colour")
    if edit is not None:
        check_output(output, WRITABLE, force=force)
        done = render.edited_still(store, edit, output, settings, parse_surfaces(surfaces or "1:99"))
        show(asdict(done), f"{output}: {done.width}x{done.height}, edited, {done.seconds:.1f} s", json)
        return
    suffix = output.suffix.lower()
    moves = not variants and (suffix == FILM or (path is not None and suffix in SEQUENCES))
    for option, is_wrong, fault, hint in (
        ("--surfaces", surfaces is not None, "applies to edited views only", "add --edit SESSION"),
        ("--scene", scene is not None and integrator != "path", OF_TRACER, "add --integrator path"),
        ("--variant", variants and bool(variant), NO_VARIANTS, "leave out one"),
        ("--replace", variants and bool(replace), NO_VARIANTS, "leave out one"),
        ("--path", variants and path is not None, NO_VARIANTS, "a sheet shows one view: name it with --camera"),
        ("--keyframes", keyframes is not None and not moves, *OF_FILMS),
        ("--fps", _is_said(context, "fps") and not moves, *OF_FILMS),
        ("--camera", camera is not None and moves, "applies to stills only", "a film follows a path: --path NAME"),
    ):
        if is_wrong:
            raise UserError(fault, field=option, hint=hint)
    check_output(output, (".png",) if variants else (*WRITABLE, FILM), force=force or moves)
    if path is not None and not moves:
        raise UserError("applies to films only", field="--path", got=suffix, expected=".mp4, .png or .exr")
    if moves:
        check_pictures(output, force=force)
    else:
        _check_light(settings)
    with progress_bar() as progress:
        common: dict[str, Any] = {"scene": scene, "note": note, "progress": progress}
        if moves:
            done = render.film(store, output, path, settings, fps=fps, keyframes=keyframes, **common)
        elif variants:
            done = render.sheet(store, output, camera, settings, exposures=exposures, **common)
        else:
            done = render.still(store, output, camera or left, settings, **common)
    exposed = "" if done.ev100 is None else f"EV100 {done.ev100:.1f}, "
    how = done.integrator if done.samples is None else f"{done.integrator}, {done.samples} samples"
    how += "" if done.noise is None else f", noise {100 * done.noise:.1f} %"
    text = f"{output}: {done.width}x{done.height}, {done.frames} frame(s), {how}, {exposed}{done.seconds:.1f} s"
    show(asdict(done), text, json)


def _check_light(settings: Settings) -> None:
    """Raise `UserError` for keyframes of light, which apply to films only."""
    for name, keys in settings.light.groups.items() if settings.light is not None else ():
        if len(keys) > 1 or keys[0][0] > 0:
            got = f"{name} at {keys[-1][0]:g} s"
            raise UserError(
                "keyframes apply to films only", field="--light", got=got, hint="leave out @SECONDS, or write to .mp4"
            )


def parse_exposure(text: str | None, *, variants: bool) -> tuple[float | None, str]:
    """Parse --exposure: EV or None, and how the pictures of a contact sheet share an exposure."""
    from lambent.render.sheet import BY_LIGHT, EXPOSURES

    if text is None:
        return None, BY_LIGHT
    if text in EXPOSURES:
        if not variants:
            raise UserError(
                "applies to contact sheets only", field="--exposure", got=text, expected="EV", hint="or add --variants"
            )
        return None, text
    try:
        return float(text), BY_LIGHT
    except ValueError:
        expected = "EV, such as -1.5" + (f", or {', '.join(EXPOSURES)}" if variants else "")
        raise UserError("cannot be read as an exposure", field="--exposure", got=text, expected=expected) from None


def _exposure_of(ev100: float, exposure: str | None) -> float:
    """Convert an EV100 to stops on radiance."""
    from lambent.core.light.exposure import ev100_of, exposure_of
    from lambent.render.images import MOST_EV

    if exposure is not None:
        raise UserError("excludes --exposure", field="--ev100", hint="leave out one")
    found = exposure_of(ev100)
    if not -MOST_EV <= found <= MOST_EV:
        expected = f"{ev100_of(MOST_EV):.0f} to {ev100_of(-MOST_EV):.0f}"
        raise UserError("is out of range", field="--ev100", got=ev100, expected=expected)
    return found


def parse_range(text: str, *, log: bool) -> Range:
    """Parse a range such as "10:500"; `log`: a logarithmic scale."""
    from lambent.core.light.false_colour import Range

    low, _, high = text.partition(":")
    try:
        return Range(float(low), float(high), log)
    except ValueError:
        raise UserError(
            "cannot be read as a range", field="--range", got=text, expected="LOW:HIGH, as in 10:500"
        ) from None


def parse_surfaces(text: str) -> tuple[int, int]:
    """Parse "3" or "2:3" to least and most surfaces."""
    least, _, most = text.rpartition(":")
    try:
        found = int(least or 1), int(most)
    except ValueError:
        found = (0, 0)
    if not 1 <= found[0] <= found[1]:
        raise UserError(
            "cannot be read as a range of surfaces", field="--surfaces", got=text, expected="MOST or LEAST:MOST, from 1"
        )
    return found


def _is_said(context: typer.Context, name: str) -> bool:
    """Whether an option was given on the command line."""
    source = context.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"


def _said_settings(context: typer.Context) -> set[str]:
    """Names of the settings that options give."""
    of_options = {
        "size": ("width", "height"), "integrator": ("integrator", "samples", "rebaked"), "samples": ("samples",),
        "view": ("view",), "exposure": ("exposure_ev",), "ev100": ("exposure_ev",), "false_range": ("scale",),
        "part": ("show", "view"),
        "planar": ("planar",), "lookup": ("lookup", "lookups"), "light": ("light",), "recolour": ("rebaked",),
        "texture": ("rebaked",), "sky_turn": ("rebaked",), "replace": ("rebaked",),
    }  # fmt: skip
    return {name for option, names in of_options.items() if _is_said(context, option) for name in names}


def _check_edit(context: typer.Context, session: Path) -> None:
    """Raise `UserError` for options that the session fixes."""
    for parameter in context.command.params:
        if parameter.name not in SHOWN_BY and _is_said(context, parameter.name or ""):
            raise UserError("excludes --edit", field=parameter.opts[0], hint=f"{session} fixes camera, size and light")
