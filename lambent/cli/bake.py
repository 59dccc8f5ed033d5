"""`lambent bake`: a scene becomes a store."""

from __future__ import annotations

import time
from contextlib import AbstractContextManager, nullcontext
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lambent.baking import artefacts
from lambent.baking.interreflection.settings import Bounces
from lambent.baking.methods import LightGroupMethod, LightMapMethod, ProbeMethod
from lambent.baking.quality import QualityName
from lambent.cli.console import CreaseAngle, Json, progress_bar, say, show, table
from lambent.core.discovery import known, modules_in, names_in
from lambent.core.errors import UserError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lambent.baking.interreflection.proposal import Proposal
    from lambent.baking.running.workers import Workers
    from lambent.core.progress import Progress
    from lambent.editing.interreflection.noise import PassNoise
    from lambent.editing.session.document import SessionDocument
    from lambent.editing.session.session import Session
    from lambent.scenes.scene import Scene

    Kind = str
else:
    Kind = StrEnum("Kind", {name: name for name in names_in(artefacts)})

INTERREFLECTION = "interreflection"
MOST_WARNINGS = 12  # lines on stderr; --json and `lambent inspect` have all


def command(
    scene: Annotated[str, typer.Argument(help="scene.toml, glTF, OBJ, Mitsuba XML, or builtin:room.")],
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
    propose: Annotated[
        bool,
        typer.Option(
            "--propose",
            help="Print the materials that interreflections would cover, with time and memory; bake nothing.",
        ),
    ] = False,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Interreflections: number of processes on this machine.")
    ] = None,
    cluster: Annotated[str | None, typer.Option(help="Interreflections: address of a Dask scheduler.")] = None,
    crease_angle: CreaseAngle = None,
    json: Json = False,
) -> None:
    """Bake the light map, environment and probes of a scene. Ctrl-C keeps finished work; the same command continues.

    Example: lambent bake builtin:room -o room.store --quality preview

    Example: lambent bake builtin:teatray -o tray.store --only transport --view front:512x512

    Example: lambent bake builtin:cornell -o box.store --only transport --only interreflection --view front:450x450

    Example: lambent bake builtin:cornell --view front:450x450 --samples 4096 --propose
    """
    from lambent.baking.bake import bake
    from lambent.baking.light_fields.request import light_fields_of
    from lambent.editing.session.session import Session
    from lambent.scenes.loaders.load import load_scene
    from lambent.scenes.scene import SunSky
    from lambent.scenes.sky.clear_sky import daylight_in_words
    from lambent.store.contract import LAST_RUN, TIMINGS

    if output is None and not propose:
        raise UserError("no output folder", field="-o", hint="add -o STORE, or --propose to see what a bake takes")
    start = time.perf_counter()
    session = Session.open(edit) if edit is not None else None
    if session is not None and crease_angle is None:
        crease_angle = session.document.crease_deg
    what = load_scene(scene, crease_angle)
    loading = time.perf_counter() - start
    _check_lit(what)
    _say_warnings(what.warnings)
    edited, changed = _edited(what, output, view or [], session)
    if session is not None:
        _check_session(session.document, what, edit)
        what = what.merged(session.document.merged)
    if edited["views"] and only is not None and not set(only) & set(modules_in(artefacts, having="OF_VIEWS")):
        raise UserError("no kind uses the given view", field="--only", got=", ".join(only), expected="transport")
    bounced = propose or INTERREFLECTION in (only or ())
    _check_choice(what, fixed or [], editable or [], merge, bounced)
    bounces = Bounces(Bounces.of_text(series), samples, frozenset(fixed or ()), diffuse_seen)
    with progress_bar() as progress, _workers(workers, cluster, unused=propose) as shared:
        if bounced:
            what, bounces, said = _proposed(
                what, None if propose else output, bounces, changed, editable or [], merge, edited, progress
            )
        if propose or output is None:
            facts: dict[str, Any] = {"proposals": [one.said() for one in said]}
            show(facts, "\n\n".join("\n".join(one.lines()) for one in said), json)
            return
        watch = _watch(what, output, bounces, edited, progress) if bounced else None
        store = bake(
            what, output, quality=quality, only=only, resume=resume, seed=seed,
            progress=watch.progress if watch is not None else progress,
            light_map=light_map, probes=probes, light_groups=light_groups,
            light_fields=light_fields, light_field_mb=light_field_mb,
            bounces=bounces, workers=shared, **edited,
        )  # fmt: skip
        if watch is not None:
            watch.note(store)
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


def _check_lit(scene: Scene) -> None:
    """Raise `UserError` before the bake if every picture of the scene would be black or impossible."""
    shines = scene.environment is not None or scene.lights or any(any(o.emission) for o in scene.objects)
    if not shines or not scene.cameras:
        lacks, section = ("has no light", "[environment]") if not shines else ("has no camera", "[[cameras]]")
        raise UserError(lacks, field=scene.name, hint=f"add {section} to its scene.toml")


def _say_warnings(warnings: Sequence[str]) -> None:
    """Print what the scene's loader left out or changed, before the long bake."""
    for text in warnings[:MOST_WARNINGS]:
        say(f"warning: {text}")
    if (more := len(warnings) - MOST_WARNINGS) > 0:
        say(f"and {more} more warnings; `lambent inspect` lists all")


def _check_session(document: SessionDocument, scene: Scene, file: Path | None) -> None:
    merged = [*document.merged, *document.merged.values()]
    for field, names in (("materials", document.materials), ("merged", merged)):
        for name in names:
            known("material", name, scene.materials, file=file, field=field)


def _check_choice(scene: Scene, fixed: list[str], editable: list[str], merge: bool, bounced: bool) -> None:
    options = {"--fixed": fixed, "--editable": editable, "--merge": merge}
    if not bounced and (given := [option for option, value in options.items() if value]):
        raise UserError("applies to interreflections only", field=given[0], hint="add --only interreflection")
    for option, names in (("--fixed", fixed), ("--editable", editable)):
        for name in names:
            known("material", name, scene.materials, field=option)
    if both := sorted({*fixed} & {*editable}):
        raise UserError(
            "material is both --fixed and --editable", field="--editable", got=both[0], hint="leave out one"
        )


def _proposed(
    scene: Scene,
    store: Path | None,
    bounces: Bounces,
    changed: frozenset[str],
    editable: list[str],
    merge: bool,
    edited: dict[str, Any],
    progress: Progress,
) -> tuple[Scene, Bounces, list[Proposal]]:
    """Scene and bounces from the store, or as proposed; a proposal is printed on stderr before the bake."""
    from dataclasses import replace

    from lambent.baking.interreflection.proposal import held_by, propose_all
    from lambent.baking.interreflection.series import used_materials

    views, light = edited["views"], edited.get("environment")
    if not views:
        raise UserError("is missing", field="--view", hint="name a camera, or a session with --edit")
    chosen = bool(bounces.fixed or editable or merge)
    if store is not None and not chosen:
        held = [held_by(store, scene, view, bounces.series) for view in views]
        if (first := held[0]) is not None and all(one == first for one in held):
            say(f"continuing with the materials that the store has: {', '.join(sorted(first.edited))}")
            scene = first.merged(scene)
            return scene, replace(bounces, fixed=frozenset(used_materials(scene)) - first.edited), []
    found = propose_all(
        scene if light is None else replace(scene, environment=light), views, bounces, merging=merge,
        kept=changed.union(editable) - bounces.fixed, editables=edited.get("editables"), progress=progress,
    )  # fmt: skip
    if store is not None:
        for one in found:
            say("\n".join(one.lines()))
    return found[0].merged(scene), found[0].bounces, found


def _watch(scene: Scene, store: Path, bounces: Bounces, edited: dict[str, Any], progress: Progress) -> PassNoise:
    """The recorder of the noise of interreflections in the store."""
    from lambent.baking.interreflection.series import used_materials
    from lambent.editing.interreflection.noise import PassNoise
    from lambent.materials.factored.of_lobes import of_material

    given = edited.get("editables", {})
    materials = {name: given.get(name) or of_material(scene.materials[name]) for name in used_materials(scene)}
    shots = [(view.camera, (view.width, view.height)) for view in edited["views"]]
    return PassNoise(store, shots, materials, bounces.samples, progress)


def _workers(count: int | None, address: str | None, unused: bool) -> AbstractContextManager[Workers | None]:
    """The workers that trace interreflections; None: this process."""
    if count is not None and address is not None:
        raise UserError("--workers and --cluster exclude each other", field="--cluster", hint="leave out one")
    if unused or (count is None and address is None):
        return nullcontext()
    from lambent.baking.running.cluster import opened

    return opened(count, address)


def _edited(
    scene: Scene, store: Path | None, names: list[str], session: Session | None
) -> tuple[dict[str, Any], frozenset[str]]:
    """Arguments of `bake` for the named views or a session's view, and the names of the edited materials."""
    from lambent.baking.transport.view import View, view_named
    from lambent.store.kept.views import read_views

    saved = read_views(store).cameras if store is not None else ()
    views = [view_named(name, (*saved, *scene.cameras)) for name in names]
    if session is None:
        return {"views": views}, frozenset()
    document = session.document
    changed = frozenset(name for name, one in document.materials.items() if one.now != one.start)
    return {
        "views": [*views, View(document.camera, *document.size)],
        "editables": {name: session.original(name) for name in document.materials},
        "environment": session.environment,
    }, changed
