"""`lambent bake`: a scene becomes a store."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lambent.bake import artefacts
from lambent.bake.methods import LightMapMethod, ProbeMethod
from lambent.bake.quality import QualityName
from lambent.cli.console import Json, progress_bar, show, table
from lambent.core.discovery import names_in

if TYPE_CHECKING:
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
    json: Json = False,
) -> None:
    """Bake light maps, environment and probes of a scene. Ctrl-C keeps what is finished; run it again to go on.

    Example: lambent bake builtin:room -o room.store --quality preview
    """
    from lambent.bake.bake import bake
    from lambent.scenes import load_scene

    what = load_scene(scene)
    with progress_bar() as progress:
        store = bake(
            what, output, quality=quality, only=only, resume=resume, seed=seed, progress=progress,
            light_map=light_map, probes=probes,
        )  # fmt: skip
    arrays = {artefact.name: artefact.state for artefact in store.artefacts()}
    seconds = store.documents.get("timings", {})
    facts = {"store": output, "arrays": arrays, "seconds": seconds, "warnings": what.warnings}
    rows = [(name, f"{value:.1f} s") for name, value in seconds.items()]
    show(facts, table([("store", str(output)), ("arrays", str(len(arrays))), *rows]), json)
