"""`lambent render`: stills, films and picture sequences of a store, without a window."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lambent.cli.console import Json, parse_size, progress_bar, say, show
from lambent.core.errors import UserError, did_you_mean

if TYPE_CHECKING:
    from lambent.core.camera import Camera
    from lambent.core.false_colour import Range
    from lambent.core.progress import Progress
    from lambent.store.contract import SceneRecord
    from lambent.store.store import Store

PATH_TRACER = "path"
DEFAULT_SPP = {PATH_TRACER: 64, "qmc": 256}
FALSE_COLOUR, NOISE = "false-colour", "noise"
VIEWS = ("filmic", "neutral", "linear", FALSE_COLOUR)
FILM_SUPERSAMPLES = 4  # of the radiance in a picture sequence
Picture = Callable[["Camera", "Progress"], Any]


def command(
    store: Annotated[Path, typer.Argument(help="Folder of a baked store.")],
    output: Annotated[
        Path,
        typer.Option(
            "-o", help="Picture (.png, .exr, .hdr), film (.mp4), or with --path pictures (tour-####.png, .exr)."
        ),
    ],
    camera: Annotated[str | None, typer.Option(help="Camera or saved view by name. [default: the first]")] = None,
    path: Annotated[
        str | None, typer.Option(help="Camera path or recorded walk by name, for films. [default: the first]")
    ] = None,
    size: Annotated[str, typer.Option(help="WIDTHxHEIGHT in pixels.")] = "1280x720",
    integrator: Annotated[
        str, typer.Option(help="rings, lobe-4.24, lobe-4.25, fis, split-sum, qmc, diffuse, or path: the path tracer.")
    ] = "rings",
    samples: Annotated[int | None, typer.Option(min=1, help="Per pixel (path, qmc) or per lobe.")] = None,
    exposure: Annotated[float | None, typer.Option(help="In EV. [default: the scene's]")] = None,
    view: Annotated[
        str, typer.Option(help="How PNG and MP4 show light: filmic, neutral, linear, or false-colour (cd/m2).")
    ] = "filmic",
    false_range: Annotated[
        str | None, typer.Option("--range", help="LOW:HIGH of false-colour, in cd/m2. [default: by the first picture]")
    ] = None,
    linear: Annotated[bool, typer.Option("--linear", help="False colours at even steps, not decades.")] = False,
    part: Annotated[
        str,
        typer.Option(
            "--show", help="full, diffuse, specular, light-map: irradiance, in lx, or noise: its standard error, %."
        ),
    ] = "full",
    planar: Annotated[
        str,
        typer.Option(
            help="How flat mirrors and floors are drawn: auto, off (from their probes), or as the integrator knows: "
            "interleaved, marched or fixed (rings), thesis (lobe-4.24, lobe-4.25), fis."
        ),
    ] = "auto",
    scene: Annotated[str | None, typer.Option(help="For path: the scene, where the store's is not found.")] = None,
    fps: Annotated[int, typer.Option(min=1, max=240, help="Frames per second of a film.")] = 30,
    json: Json = False,
) -> None:
    """Render a still or a film: EXR and HDR keep radiance, PNG and MP4 show it through a view transform.

    Example: lambent render room.store --camera entrance -o entrance.png
    """
    from lambent.core.film import FILM, SEQUENCES, even_size, sequence_file
    from lambent.core.images import WRITABLE, check_writable, write_image, write_shown
    from lambent.store.contract import scene_record
    from lambent.store.store import Store
    from lambent.store.views import read_views, with_views

    check_writable(output, (*WRITABLE, FILM))
    false = view == FALSE_COLOUR or part == NOISE
    scale = parse_range(false_range, log=not linear) if false or false_range else None
    if view not in VIEWS:
        hint = did_you_mean(view, VIEWS)
        raise UserError("unknown view transform", field="--view", got=view, expected=", ".join(VIEWS), hint=hint)
    width, height = parse_size(size)
    opened = Store.open(store)
    record = with_views(scene_record(opened), read_views(store))
    exposure_ev = record.exposure_ev if exposure is None else exposure
    if not -64 <= exposure_ev <= 64:  # also refuses nan
        raise UserError("exposure is out of range", field="--exposure", got=exposure_ev, expected="-64 to 64 EV")
    film = output.suffix.lower() == FILM
    row = path is not None and output.suffix.lower() in SEQUENCES
    if row:
        sequence_file(output, 1)
    if film:
        width, height = even_size(width, height)
    began = time.perf_counter()
    views = _views(record, camera, path, fps if film or row else None)
    how = Look(exposure_ev, view, scale, part, planar)
    radiance, shown = pictures(opened, width, height, integrator, samples, how, scene, film=film or row)
    with progress_bar() as progress:
        if film or row:
            _write_film(output, views, (radiance, shown), (width, height, fps), progress)
        elif output.suffix.lower() == ".png":
            write_shown(output, shown(views[0], progress))
        else:
            write_image(output, radiance(views[0], progress))
    seconds = time.perf_counter() - began
    facts = {
        "file": output,
        "width": width,
        "height": height,
        "integrator": integrator,
        "frames": len(views),
        "seconds": seconds,
    }
    show(facts, f"{output}: {width}x{height}, {len(views)} frame(s), {integrator}, {seconds:.1f} s", json)


def pictures(
    store: Store,
    width: int,
    height: int,
    integrator: str,
    samples: int | None,
    look: Look,
    scene: str | None = None,
    *,
    film: bool = False,
) -> tuple[Picture, Picture]:
    """Two functions of (camera, progress): radiance (height, width, 3) float32, and the shown uint8 picture.

    Of a film the latter is as the window shows it in motion; a still is averaged from many frames.
    """
    if integrator == PATH_TRACER:
        if look.part != "full":
            raise UserError("the path tracer shows all light", field="--show", got=look.part, expected="full")
        if look.planar != "auto":
            raise UserError("the path tracer traces reflectors", field="--planar", got=look.planar, expected="auto")
        radiance = _path_traced(store, width, height, samples or DEFAULT_SPP[PATH_TRACER], scene)
    else:
        from lambent.realtime.device import open_device
        from lambent.realtime.frame import FrameState, Renderer
        from lambent.realtime.integrators import integrator as named
        from lambent.realtime.mirror_integrators import check_planar
        from lambent.store.contract import SIDES, noise_name

        if look.part == NOISE and noise_name(SIDES[0]) not in store:
            hint = "`lambent bake` of the same scene adds it from the samples that the store keeps"
            raise UserError("the store does not say how exact its light map is", field="--show", got=NOISE, hint=hint)
        progressive = named(integrator).progressive  # an unknown one is said before the device is opened
        check_planar(integrator, look.planar)
        renderer = Renderer(open_device(), store)
        for text in renderer.missing:
            say(f"note: {text}")

        def state(camera: Camera) -> FrameState:
            n = None if progressive else samples
            return FrameState(
                camera, width, height, integrator=integrator, n=n, exposure_ev=look.exposure_ev,
                view_transform="filmic" if look.view == FALSE_COLOUR else look.view, show=look.part,
                planar=look.planar,
            )  # fmt: skip

        def radiance(camera: Camera, progress: Progress) -> Any:
            if progressive:
                return renderer.converged(state(camera), samples or DEFAULT_SPP["qmc"], progress)
            return renderer.still_radiance(state(camera), *((FILM_SUPERSAMPLES,) if film else ()))

        if look.plain and not progressive:
            show_frame = renderer.display_image if film else renderer.still
            return radiance, lambda camera, progress: show_frame(state(camera))

    return radiance, lambda camera, progress: look.shown(radiance(camera, progress))


def parse_range(text: str | None, *, log: bool) -> Range:
    """The range of "10:500"; one still to be found, with no extent, where there is no text."""
    from lambent.core.false_colour import Range

    if text is None:
        return Range(0.0, 0.0, log)
    low, _, high = text.partition(":")
    try:
        scale = Range(float(low), float(high), log)
    except ValueError:
        raise UserError("not a range", field="--range", got=text, expected="LOW:HIGH, as in 10:500") from None
    scale.check()
    return scale


@dataclass
class Look:
    """How radiance becomes a picture; a `scale` without extent is fitted to the first one."""

    exposure_ev: float = 0.0
    view: str = "filmic"
    scale: Range | None = None
    part: str = "full"
    planar: str = "auto"

    @property
    def plain(self) -> bool:
        """Whether colours are those of light, not false ones."""
        return self.view != FALSE_COLOUR and self.part != NOISE

    def shown(self, radiance: Any) -> Any:
        """uint8 (H, W, 3), encoded."""
        from lambent.core.colour import shown
        from lambent.core.false_colour import Range, false_colour, fitting_range, with_scale
        from lambent.core.images import to_bytes
        from lambent.core.photometry import photometric

        if self.plain:
            return to_bytes(shown(radiance, self.view, self.exposure_ev))
        from lambent.realtime.frame import quantity_of

        quantity = quantity_of(self.part)
        values = photometric(radiance, quantity)
        scale = self.scale or Range(0.0, 0.0)
        if scale.low == scale.high:
            scale = self.scale = fitting_range(values, log=scale.log)
        return with_scale(to_bytes(false_colour(values, scale)), scale, quantity.unit)


def _path_traced(store: Store, width: int, height: int, spp: int, place: str | None) -> Picture:
    from lambent.bake.bake import changed_inputs
    from lambent.bake.engine import engine
    from lambent.cli.bake import scene_of

    scene = scene_of(store, place)
    for name in changed_inputs(store, scene):
        say(f"note: {name} has changed since the store was baked")
    engine()
    from lambent.bake.reference import render_reference

    return lambda camera, progress: render_reference(scene, camera, width, height, spp, progress=progress)[0]


def _write_film(
    output: Path,
    views: list[Camera],
    pictures: tuple[Picture, Picture],
    form: tuple[int, int, int],
    progress: Progress,
) -> None:
    from lambent.core.film import pictures_writer, radiance_wanted
    from lambent.core.progress import silent

    wanted = pictures[0] if radiance_wanted(output) else pictures[1]
    with pictures_writer(output, *form) as write:
        for index, view in enumerate(views):
            write(wanted(view, silent))
            progress(index + 1, len(views), "frames")


def _views(record: SceneRecord, camera: str | None, path: str | None, fps: int | None) -> list[Camera]:
    """One camera, or, with `fps`, those along a path."""
    if fps is None:
        if path is not None:
            raise UserError("a path makes a film", field="--path", hint="write to .mp4, .png or .exr")
        return [_named("camera", record.cameras, camera)]
    if camera is not None:
        raise UserError("a film needs a path", field="--camera", hint="name a path with --path")
    from lambent.scenes.camera_paths import camera_at

    way = _named("path", record.paths, path)
    return [camera_at(way, index / fps) for index in range(max(2, round(way.seconds * fps)))]


def _named(kind: str, choices: Iterable[Any], name: str | None) -> Any:
    found = {choice.name: choice for choice in choices}
    if not found:
        raise UserError(f"scene has no {kind}", hint=f"add one to the scene, [[{kind}s]]")
    if name is None:
        return next(iter(found.values()))
    if name not in found:
        hint = did_you_mean(name, found)
        raise UserError(f"no {kind} of this name", field=f"--{kind}", got=name, expected=", ".join(found), hint=hint)
    return found[name]
