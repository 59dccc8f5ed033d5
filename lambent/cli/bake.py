"""`lambent bake`: a scene becomes a store."""

from __future__ import annotations

import time
from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from lambent.baking import artefacts
from lambent.baking.methods import LightGroupMethod, LightMapMethod, ProbeMethod
from lambent.baking.quality import QualityName
from lambent.cli.console import CreaseAngle, Json, say, show, table
from lambent.core.discovery import names_in
from lambent.core.errors import UserError

if TYPE_CHECKING:
    Kind = str
else:
    Kind = StrEnum("Kind", {name: name for name in names_in(artefacts)})

MOST_WARNINGS = 12  # lines on stderr; --json and `lambent inspect` have all


def command(
    scene: Annotated[str, typer.Argument(help="scene.toml, glTF, OBJ, Mitsuba XML, .blend, or builtin:room.")],
    output: Annotated[Path | None, typer.Option("-o", help="Folder of the store to write.")] = None,
    only: Annotated[list[Kind] | None, typer.Option(help="Bake this kind and the kinds it needs. Repeatable.")] = None,
    quality: Annotated[QualityName, typer.Option(help="Resolution and sample counts.")] = QualityName.preview,
    resume: Annotated[
        bool, typer.Option("--resume/--anew", help="Keep what is up to date, or bake everything again.")
    ] = True,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same store.")] = 0,
    light_map: Annotated[
        LightMapMethod | None,
        typer.Option(help="Method for the light map. [default: as in the store, else paths]"),
    ] = None,
    probes: Annotated[
        ProbeMethod | None,
        typer.Option(
            help="Light in probes: read from the light map, or path traced. [default: as in the store, else cached]"
        ),
    ] = None,
    light_groups: Annotated[
        LightGroupMethod | None,
        typer.Option(
            help="Store the light of each light group, to dim it later. [default: as in the store, else none]"
        ),
    ] = None,
    light_fields: Annotated[
        str | None,
        typer.Option(
            help="Objects that get a light field: NAME,... (with * and ?), scene (as its file says), auto or none. "
            "[default: as in the store, else scene]"
        ),
    ] = None,
    light_field_mb: Annotated[
        float | None,
        typer.Option(min=1, help="Memory budget of auto, in MB. [default: as in the store, else 256]"),
    ] = None,
    view: Annotated[
        list[str] | None,
        typer.Option(
            help="CAMERA[:WIDTHxHEIGHT]: a view whose materials you will edit, 512x512 by default. Repeatable."
        ),
    ] = None,
    edit: Annotated[
        Path | None,
        typer.Option(help="Session of edits (.edits.json): bake its view, with its materials and its environment."),
    ] = None,
    series: Annotated[
        str, typer.Option(help="Interreflections: bands per curve at the first surface, the second, ...")
    ] = "64,1,1,1",
    samples: Annotated[
        int, typer.Option(min=1, help="Interreflections: paths per pixel; paths in the store count.")
    ] = 1024,
    fixed: Annotated[
        list[str] | None,
        typer.Option(help="Interreflections: a material that you will not edit. Repeatable."),
    ] = None,
    diffuse_seen: Annotated[
        bool, typer.Option("--diffuse-seen", help="Interreflections: treat surfaces seen in others as diffuse.")
    ] = False,
    editable: Annotated[
        list[str] | None,
        typer.Option(help="Interreflections: a material that you will edit, proposed or not. Repeatable."),
    ] = None,
    merge: Annotated[
        bool, typer.Option("--merge", help="Interreflections: merge materials that look the same, to save memory.")
    ] = False,
    propose_: Annotated[
        bool,
        typer.Option(
            "--propose",
            help="Print the materials that interreflections would cover, with time and memory; bake nothing.",
        ),
    ] = False,
    on: Annotated[
        str | None,
        typer.Option(help="Trace on N processes of this machine, or on a Dask cluster: tcp://HOST:PORT."),
    ] = None,
    crease_angle: CreaseAngle = None,
    json: Json = False,
) -> None:
    """Bake the light map, environment and probes of a scene. Ctrl-C keeps finished work; the same command continues.

    Example: lambent bake builtin:room -o room.store --quality preview

    Example: lambent bake builtin:teatray -o tray.store --only transport --view front:512x512

    Example: lambent bake builtin:cornell -o box.store --only transport --only interreflection --view front:450x450

    Example: lambent bake builtin:cornell --view front:450x450 --samples 4096 --propose
    """
    from lambent.api.bakes import Interreflection, bake, propose, scene_of_session
    from lambent.baking.light_fields.request import light_fields_of
    from lambent.scenes.scene import SunSky
    from lambent.scenes.sky.clear_sky import daylight_in_words
    from lambent.store.contract import LAST_RUN, TIMINGS

    if output is None and not propose_:
        raise UserError("no output folder", field="-o", hint="add -o STORE, or --propose to see what a bake takes")
    start = time.perf_counter()
    found = scene_of_session(scene, edit, crease_angle)
    what, loading = found.contents, time.perf_counter() - start
    _say_warnings(what.warnings)
    wanted = Interreflection(series, samples, fixed or (), editable or (), merge, diffuse_seen)
    if propose_:
        said = propose(found, views=view or (), session=edit, interreflection=wanted, store=output, progress=True)
        show({"proposals": [one.said() for one in said]}, "\n\n".join("\n".join(one.lines()) for one in said), json)
        return
    store = bake(
        found, cast(Path, output), quality=quality, only=only, resume=resume, seed=seed, light_map=light_map,
        probes=probes, light_groups=light_groups, light_fields=light_fields, light_field_mb=light_field_mb,
        views=view or (), session=edit, interreflection=wanted,
        on=int(on) if on is not None and on.isdecimal() else on, note=say, progress=True,
    ).arrays  # fmt: skip
    arrays = {artefact.name: artefact.state for artefact in store.artefacts()}
    daylight = [("daylight", daylight_in_words(what.environment))] if isinstance(what.environment, SunSky) else []
    seconds, run = store.documents.get(TIMINGS, {}), {"loading": loading, **store.documents.get(LAST_RUN, {})}
    run["other"] = time.perf_counter() - start - sum(value for step, value in run.items() if step != "other")
    facts = {"store": output, "arrays": arrays, "seconds": seconds, "this_run": run, "warnings": what.warnings}
    rows = [*daylight, *((name, f"{value:.1f} s") for name, value in {**seconds, **run}.items())]
    rows.append(("this run", f"{sum(run.values()):.1f} s"))
    facts |= dict(daylight)
    text = table([("store", str(output)), ("arrays", str(len(arrays))), *rows])
    if fields := light_fields_of(store):
        facts["light_fields"] = fields
        text += f"\n\n{_light_fields_in_words(fields)}"
    show(facts, text, json)


def _light_fields_in_words(fields: list[dict[str, Any]]) -> str:
    rows = [
        (
            one["object"], str(one["points"]), f"{one['megabytes']:.1f}", f"{one['seconds']:.1f}",
            *(f"{one[name]:.3f}" if name in one else "" for name in ("probe_error", "error")),
        )
        for one in fields
    ]  # fmt: skip
    return table([("light field of", "points", "MB", "seconds", "error with probe", "with light field"), *rows])


def _say_warnings(warnings: Sequence[str]) -> None:
    """Print what the scene's loader left out or changed, before the long bake."""
    for text in warnings[:MOST_WARNINGS]:
        say(f"warning: {text}")
    if (more := len(warnings) - MOST_WARNINGS) > 0:
        say(f"and {more} more warnings; `lambent inspect` lists all")
