"""`lambent bake`: a scene becomes a store."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lambent.bake import artefacts
from lambent.bake.bounces import Bounces
from lambent.bake.methods import LightMapMethod, ProbeMethod
from lambent.bake.quality import QualityName
from lambent.cli.console import Json, progress_bar, show, table
from lambent.core.discovery import known, modules_in, names_in
from lambent.core.errors import UserError

if TYPE_CHECKING:
    from lambent.bake.workers import Workers
    from lambent.scenes.scene import Scene

    Kind = str
else:
    Kind = StrEnum("Kind", {name: name for name in names_in(artefacts)})


def command(
    scene: Annotated[str, typer.Argument(help="scene.toml, glTF, OBJ, Mitsuba XML, or builtin:room.")],
    output: Annotated[Path, typer.Option("-o", help="Folder of the store.")],
    only: Annotated[list[Kind] | None, typer.Option(help="Bake this kind and what it needs. Repeatable.")] = None,
    quality: Annotated[QualityName, typer.Option(help="How much work to put in.")] = QualityName.preview,
    resume: Annotated[bool, typer.Option("--resume/--anew", help="Keep what is up to date, or bake it all.")] = True,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same store.")] = 0,
    light_map: Annotated[
        LightMapMethod | None,
        typer.Option(help="What integrates the light map. [default: as in the store, else paths]"),
    ] = None,
    probes: Annotated[
        ProbeMethod | None,
        typer.Option(help="Probes from the light map, or path traced. [default: as in the store, else cached]"),
    ] = None,
    view: Annotated[
        list[str] | None,
        typer.Option(help="CAMERA[:WIDTHxHEIGHT] whose materials are to be edited, 512x512 by default. Repeatable."),
    ] = None,
    edit: Annotated[
        Path | None, typer.Option(help="Session of edits: its view, with its materials and its environment.")
    ] = None,
    series: Annotated[
        str, typer.Option(help="Of interreflections: bands of sharp curves at the first surface, the second, ...")
    ] = "64,1,1,1",
    samples: Annotated[
        int, typer.Option(min=1, help="Of interreflections: paths per pixel, added to those there.")
    ] = 1024,
    fixed: Annotated[
        list[str] | None, typer.Option(help="Of interreflections: a material that is not edited. Repeatable.")
    ] = None,
    diffuse_seen: Annotated[
        bool, typer.Option("--diffuse-seen", help="Of interreflections: surfaces seen in others are diffuse.")
    ] = False,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Of interreflections: processes of this machine that share the work.")
    ] = None,
    cluster: Annotated[str | None, typer.Option(help="Of interreflections: address of a Dask scheduler.")] = None,
    json: Json = False,
) -> None:
    """Bake light maps, environment and probes of a scene. Ctrl-C keeps what is finished; run it again to go on.

    Example: lambent bake builtin:room -o room.store --quality preview
    Example: lambent bake builtin:teatray -o tray.store --only transport --view front:512x512
    Example: lambent bake builtin:cornell -o box.store --only transport --only interreflection --view front:450x450
    """
    from lambent.bake.bake import bake
    from lambent.scenes import load_scene

    what = load_scene(scene)
    edited = _edited(what, output, view or [], edit)
    if edited["views"] and only is not None and not set(only) & set(modules_in(artefacts, having="OF_VIEWS")):
        raise UserError("views are baked for editing", field="--only", got=", ".join(only), expected="transport")
    for name in fixed or ():
        known("material", name, what.materials, field="--fixed")
    bounces = Bounces(Bounces.of_text(series), samples, frozenset(fixed or ()), diffuse_seen)
    with progress_bar() as progress, _workers(workers, cluster) as shared:
        store = bake(
            what, output, quality=quality, only=only, resume=resume, seed=seed, progress=progress,
            light_map=light_map, probes=probes, bounces=bounces, workers=shared, **edited,
        )  # fmt: skip
    arrays = {artefact.name: artefact.state for artefact in store.artefacts()}
    seconds = store.documents.get("timings", {})
    facts = {"store": output, "arrays": arrays, "seconds": seconds, "warnings": what.warnings}
    rows = [(name, f"{value:.1f} s") for name, value in seconds.items()]
    show(facts, table([("store", str(output)), ("arrays", str(len(arrays))), *rows]), json)


def _workers(count: int | None, address: str | None) -> AbstractContextManager[Workers | None]:
    """Who does the work of interreflections; None: this process."""
    if count is None and address is None:
        return nullcontext()
    from lambent.bake.cluster import opened

    if count is not None and address is not None:
        raise UserError("workers are counted or have an address", field="--cluster", hint="leave out --workers")
    return opened(count, address)


def _edited(scene: Scene, store: Path, names: list[str], session: Path | None) -> dict[str, Any]:
    """What `bake` gets for the views of these names, cameras or saved views, and for that of a session."""
    from lambent.bake.view import View, view_named
    from lambent.editing.session import Session
    from lambent.store.views import read_views

    views = [view_named(name, (*read_views(store).cameras, *scene.cameras)) for name in names]
    if session is None:
        return {"views": views}
    opened = Session.open(session)
    document = opened.document
    for name in document.materials:
        known("material", name, scene.materials, file=session, field="materials")
    return {
        "views": [*views, View(document.camera, *document.size)],
        "editables": {name: opened.original(name) for name in document.materials},
        "environment": opened.environment,
    }
