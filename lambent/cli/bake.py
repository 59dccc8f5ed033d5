"""`lambent bake`: a scene becomes a store."""

from __future__ import annotations

import os
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lambent.cli.console import Json, progress_bar, show, table

if TYPE_CHECKING:
    from lambent.scenes.scene import Scene
    from lambent.store.store import Store

SOURCE = "source"  # document: where the scene is, "builtin:NAME" or a path relative to the store's folder


class Quality(StrEnum):
    preview = "preview"
    normal = "normal"
    final = "final"


class Integrator(StrEnum):
    paths = "paths"
    photons = "photons"


class Probes(StrEnum):
    cached = "cached"
    traced = "traced"


class Kind(StrEnum):
    geometry = "geometry"
    light_map = "light_map"
    environment = "environment"
    probe = "probe"


def command(
    scene: Annotated[str, typer.Argument(help="scene.toml, glTF, OBJ, Mitsuba XML, or builtin:room.")],
    output: Annotated[Path, typer.Option("-o", help="Folder of the store.")],
    only: Annotated[list[Kind] | None, typer.Option(help="Bake this kind and what it needs. Repeatable.")] = None,
    quality: Annotated[Quality, typer.Option(help="How much work to put in.")] = Quality.preview,
    resume: Annotated[bool, typer.Option("--resume/--anew", help="Keep what is up to date, or bake it all.")] = True,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same store.")] = 0,
    light_map: Annotated[
        Integrator | None, typer.Option(help="What integrates the light map. [default: as in the store, else paths]")
    ] = None,
    probes: Annotated[
        Probes | None,
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
            what, output, quality=quality.value, only=only, resume=resume, seed=seed, progress=progress,
            light_map=light_map and light_map.value, probes=probes and probes.value,
        )  # fmt: skip
    store.set_document(SOURCE, _place(scene, output))
    arrays = {artefact.name: artefact.state for artefact in store.artefacts()}
    seconds = store.documents.get("timings", {})
    facts = {"store": output, "arrays": arrays, "seconds": seconds, "warnings": what.warnings}
    rows = [(name, f"{value:.1f} s") for name, value in seconds.items()]
    show(facts, table([("store", str(output)), ("arrays", str(len(arrays))), *rows]), json)


def scene_of(store: Store, given: str | None) -> Scene:
    """The scene a store was baked from: as given, else where it was when it was baked."""
    from lambent.core.errors import UserError
    from lambent.scenes import load_scene

    place = given or store.documents.get(SOURCE)
    if not isinstance(place, str):
        raise UserError("store does not say where its scene is", file=store.folder, hint="name it with --scene")
    return load_scene(place if given or place.startswith("builtin:") else store.folder / place)


def _place(scene: str, store: Path) -> str:
    return scene if scene.startswith("builtin:") else Path(os.path.relpath(scene, store)).as_posix()
