"""Worker process that bakes a session's view for editing, or a room's for relighting, and reports progress on stdout.

python -m lambent.viewer.modes.edit.worker SESSION STORE LIGHTS...
python -m lambent.viewer.modes.edit.worker SESSION STORE --bounces JSON
python -m lambent.viewer.modes.edit.worker SESSION STORE --bounces JSON KEPT  (proposes materials to edit beside KEPT)
python -m lambent.viewer.modes.edit.worker STORE --relight  (stdin: [a `RoomState`, a `ViewRecord`] as JSON)

Every line is a JSON object: "what", "done" and "total" of a step; "lights", a number of lights with complete transport;
"samples", the present samples of all interreflections; "proposal"; or "error", a line for the user.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

from lambent.baking.interreflection.settings import Bounces
from lambent.core.errors import UserError
from lambent.core.files import place_from
from lambent.editing.interreflection.noise import PASS, PassNoise
from lambent.editing.session.session import Session
from lambent.scenes.scene import Scene
from lambent.store.contract import ViewRecord
from lambent.store.kept.session import RoomState
from lambent.store.source import SURROUNDINGS
from lambent.store.store import Store
from lambent.viewer.modes.edit.baking import BOUNCES, RELIGHT
from lambent.viewer.modes.edit.subject import scene_for

NICENESS = 10  # the window has priority


def main(session: Path, folder: Path, lights: Sequence[int]) -> None:
    """Bake for each number of lights in turn."""
    from lambent.baking.bake import bake
    from lambent.baking.quality import quality_named
    from lambent.baking.transport.view import View

    opened = Session.open(session)
    document, scene = opened.document, scene_for(opened)
    view = View(document.camera, *document.size)
    editables = {name: opened.original(name) for name in document.materials}
    for end in range(len(lights)):
        quality = quality_named("normal").changed(visibility={"lights": tuple(lights[: end + 1])})
        with bake(
            scene,
            folder,
            quality=quality,
            only={"transport"},
            views=[view],
            editables=editables,
            progress=_progress,
            environment=opened.environment,
        ) as store:
            _note_environment(store, opened)
        _say(lights=lights[end])


def bounce(session: Path, folder: Path, bounces: Bounces, kept: Collection[str] | None) -> None:
    """Bake interreflections, or, given materials to keep, propose further materials to edit."""
    from lambent.baking.bake import bake
    from lambent.baking.interreflection.proposal import propose, same_materials
    from lambent.baking.transport.view import View

    opened = Session.open(session)
    document, scene, light = opened.document, scene_for(opened), opened.environment
    editables = {name: opened.original(name) for name in document.materials}
    view = View(document.camera, *document.size)
    if kept is not None:
        lit = scene if light is None else replace(scene, environment=light)
        found = propose(lit, view, bounces, editables=editables, kept=kept, progress=_progress)
        alike = same_materials(scene, keep=_own(opened, scene))
        _say(proposal=replace(found, alike=alike).said())
        return
    watch = PassNoise(folder, [(document.camera, document.size)], editables, bounces.samples, _progress)
    with bake(
        scene, folder, quality="normal", only={"interreflection"}, progress=watch.progress, bounces=bounces,
        views=[view], editables=editables, environment=light,
    ) as store:  # fmt: skip
        watch.note(store)


def relight(folder: Path, room: object, view: object) -> None:
    """Bake a view of a store's room for relighting."""
    from lambent.baking.running.relit import Relit
    from lambent.baking.transport.view import View

    of = ViewRecord.model_validate(view)
    Relit(folder, RoomState.model_validate(room), View(of.camera, of.width, of.height)).bake(_progress)


def _own(session: Session, scene: Scene) -> set[str]:
    """Materials that differ from the scene's."""
    materials = session.document.materials.items()
    return {name for name, one in materials if one.now != scene.materials[name]}


def _note_environment(store: Store, session: Session) -> None:
    """Note in the store the image that lights it, so that the store can be opened without it."""
    said = session.document.environment
    if said is not None:
        said = said.model_copy(update={"file": place_from(store.folder, session.path(said.file))})
    store.set_document(SURROUNDINGS, said.model_dump(mode="json") if said else None)


def _progress(done: float, total: float, what: str) -> None:
    _say(what=what, done=done, total=total)
    finished = PASS.fullmatch(what)
    if finished and done == total:
        _say(samples=int(finished[1]))


def _say(**words: object) -> None:
    sys.stdout.write(json.dumps(words) + "\n")
    sys.stdout.flush()  # BrokenPipeError ends this process when the window is gone


if __name__ == "__main__":
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    try:
        if sys.argv[2:] == [RELIGHT]:
            relight(Path(sys.argv[1]), *json.loads(sys.stdin.readline()))
        elif sys.argv[3:4] == [BOUNCES]:
            bounces, *kept = map(json.loads, sys.argv[4:])
            bounce(Path(sys.argv[1]), Path(sys.argv[2]), Bounces.of(bounces), kept[0] if kept else None)
        else:
            main(Path(sys.argv[1]), Path(sys.argv[2]), [int(word) for word in sys.argv[3:]])
    except UserError as error:
        _say(error=str(error))
