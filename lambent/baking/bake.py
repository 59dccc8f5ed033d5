"""Scene in, store out: geometry, light map, environment, probes and all other kinds in `artefacts/`.

    store = bake(load_scene("builtin:room"), Path("room.store"), quality="preview")

Every array carries a key, the hash of its inputs; arrays with unchanged inputs are not baked again. An interrupted
bake, even by kill -9, resumes where it was and ends with bitwise identical arrays.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import cast

from lambent.baking import artefacts
from lambent.baking.context import Artefact, BakeContext
from lambent.baking.engine import engine
from lambent.baking.interreflection.settings import Bounces
from lambent.baking.light_fields import request
from lambent.baking.methods import METHODS, check_groups, chosen
from lambent.baking.probes.division import divided
from lambent.baking.quality import Quality, quality_named
from lambent.baking.running.timing import Stopwatch
from lambent.baking.running.watch import Watch
from lambent.baking.running.workers import InProcess, Workers
from lambent.baking.surfaces.backs import find_backs
from lambent.baking.surfaces.cuts import cut_for_viewers
from lambent.baking.surfaces.visible_triangles import TriangleVisibility
from lambent.baking.transport.view import View
from lambent.core.discovery import known, modules_in
from lambent.core.errors import UserError
from lambent.core.machine import memory_bytes
from lambent.core.progress import Progress, silent
from lambent.materials.factored.terms import Editable
from lambent.scenes.looks.textures import prepared
from lambent.scenes.scene import ImageEnvironment, Scene, SceneObject
from lambent.store.source import changed_inputs, inputs_of, write_source
from lambent.store.store import Store

BYTES_PER_TRIANGLE = 650  # peak while baking geometry: 610 with 2000 objects of 352, 580 with one of a million
log = logging.getLogger(__name__)


def bake(
    scene: Scene,
    store_path: Path,
    *,
    quality: str | Quality = "preview",
    only: Collection[str] | None = None,
    resume: bool = True,
    progress: Progress = silent,
    seed: int = 0,
    light_map: str | None = None,
    probes: str | None = None,
    light_groups: str | None = None,
    light_fields: str | None = None,
    light_field_mb: float | None = None,
    views: Sequence[View] = (),
    editables: Mapping[str, Editable] | None = None,
    bounces: Bounces | None = None,
    environment: ImageEnvironment | None = None,
    workers: Workers | None = None,
    watch: Watch | None = None,
) -> Store:
    """Bake a scene into a store, or bring a store up to date.

    Parameters
    ----------
    scene : Scene
    store_path : Path
        Folder of the store, created if needed.
    quality : {'preview', 'normal', 'final'} or Quality
    only : collection of str, optional
        Kinds of artefacts to bake, modules of `artefacts/`; their needs are baked too. By default all kinds except
        those baked only on request.
    resume : bool
        False bakes everything again, even arrays that are up to date.
    progress : Progress
        May raise `Cancelled` or KeyboardInterrupt; a later bake resumes.
    seed : int
        The same seed gives the same arrays.
    light_map : {'paths', 'photons'}, optional
        The light map's integrator: path tracing and final gathering, or photons. By default as in the store.
    probes : {'cached', 'traced'}, optional
        Whether surfaces seen by probes show the light map, or all paths are traced. By default as in the store.
    light_groups : {'none', 'scene'}, optional
        Whether light map and probes are also stored by group of emitters (`scenes.light_groups`), so that a renderer
        can dim and colour each. Only path traced light maps support groups. By default as in the store.
    light_fields : str, optional
        Objects that get a light field: "scene", those that the scene names; "none"; "auto", also those that the bake
        chooses, within `light_field_mb` of memory; or names and patterns, separated by commas. By default as in the
        store.
    light_field_mb : float, optional
        Memory limit in MB for the light fields that "auto" chooses.
    views : sequence of View, optional
        Views for editing materials: their points, visibility and transport are baked. To bake these alone, without
        light map and probes, pass {"transport"} as `only`.
    editables : mapping, optional
        By material name, terms and curves to edit instead of those of its document.
    bounces : Bounces, optional
        Settings of "interreflection": its series of bands, samples, and uneditable materials.
    environment : ImageEnvironment, optional
        Lights the views instead of the scene's own environment.
    workers : Workers, optional
        Trace light maps, probes and interreflections: see `lambent.baking.running.cluster.opened`. By default this
        process.
    watch : Watch, optional
        Notified of finished artefacts, and of regions of the light map before that.

    Returns
    -------
    Store
        Changed inputs are logged and stored in the document "changes".

    Raises
    ------
    UserError
        If an option is unknown, the scene has no objects or is too large, or no path tracing engine works.
    """
    start = time.perf_counter()
    kinds, quality = found(), quality_named(quality)
    for kind in quality.changes:
        known("kind of artefact", kind, kinds)
    usual = [name for name, kind in kinds.items() if not getattr(kind, "ON_REQUEST", False)]
    order = in_order(kinds, usual if only is None else only)
    of_views = [kind for kind in only or () if getattr(kinds[kind], "OF_VIEWS", False)]
    if of_views and not views:
        raise UserError("is baked for views only", field=of_views[0], hint="name them with --view CAMERA")
    if not scene.objects:
        raise UserError("scene has no objects", field=scene.name)
    check_memory(scene)
    scene = replace(scene, textures=prepared(scene.textures))
    existing = Store.open(store_path) if (Path(store_path) / "manifest.json").exists() else None
    changes = changed_inputs(existing, scene) if existing else []
    if changes:
        log.warning("changed since the last bake: %s; what depends on it is baked again", ", ".join(changes))
    before = existing.documents.get(METHODS, {}) if existing else {}
    methods = chosen(before, light_map=light_map, probes=probes, light_groups=light_groups)
    check_groups(methods)
    methods |= request.noted(before, light_fields, light_field_mb)
    scene = request.as_asked(scene, methods[request.FIELDS])
    with Store.create(store_path, inputs_of(scene)) as store:
        store.set_document(METHODS, methods)
        timed = Stopwatch(store)
        undivided, sight = scene, TriangleVisibility(scene)
        if "geometry" in order:
            sight = cut_for_viewers(divided(sight, store, progress, timed), store, timed)
            find_backs(sight, store, timed, progress, anew=not resume)
            scene = sight.scene
        store.set_document("changes", changes)
        write_source(store, scene)
        if not resume:
            store.forget_all()
        context = BakeContext(
            scene, store, kinds, quality, methods, seed, progress, undivided, tuple(views), editables or {},
            environment, bounces or Bounces(), workers or InProcess(), timed,
            watch or Watch(), sight,
        )  # fmt: skip
        for kind in order:
            if context.stale(kind):
                with timed(kind, continued=bool(context.begun(kind))):
                    engine()  # before an artefact imports Mitsuba
                    kinds[kind].bake(context)
            context.watch.arrived(kind, context.keys(kind).keys())
            if describe := getattr(kinds[kind], "describe", None):
                describe(context)
        timed.finish(start)
    return store


def found() -> dict[str, Artefact]:
    """All kinds of artefacts, by name."""
    modules = modules_in(artefacts)
    assert all(name == module.KIND for name, module in modules.items()), "the file's name is that of the kind"
    return cast(dict[str, Artefact], modules)


def in_order(kinds: Mapping[str, Artefact], wanted: Collection[str]) -> list[str]:
    """The wanted kinds and everything they need, each after its needs.

    Raises
    ------
    UserError
        If a kind needs one that does not exist, or the needs are circular.
    """
    needs: dict[str, tuple[str, ...]] = {}
    left = [known("kind of artefact", kind, kinds) for kind in wanted]
    for kind in left:  # grows during the loop
        needs[kind] = kinds[kind].NEEDS
        left += [known("artefact", need, kinds, field=f"NEEDS of {kind}") for need in needs[kind] if need not in needs]
    try:
        return list(TopologicalSorter(dict(sorted(needs.items()))).static_order())
    except CycleError as error:
        raise UserError("artefacts need each other in a circle", got=" -> ".join(error.args[1])) from error


def check_memory(scene: Scene) -> None:
    """Raise `UserError` if the triangles of a scene do not fit into this machine's memory.

    Instances share arrays in files and loaders, but not in a bake: each has its own light, and so its own vertices.
    """
    triangles = sum(len(o.mesh.faces) for o in scene.objects)
    needed, there = triangles * BYTES_PER_TRIANGLE, memory_bytes()
    if needed > there:
        raise UserError(
            "scene is too large to be baked here", field=scene.name,
            got=f"{triangles} triangles, {needed / 1e9:.0f} GB", expected=f"at most {there / 1e9:.0f} GB of memory",
            hint=_copies(scene.objects),
        )  # fmt: skip


def _copies(objects: tuple[SceneObject, ...]) -> str:
    """A remedy that names the mesh with the most copies."""
    shared: dict[int, list[SceneObject]] = {}
    for o in objects:
        shared.setdefault(id(o.mesh.faces), []).append(o)
    most = max(shared.values(), key=lambda copies: len(copies) * len(copies[0].mesh.faces))
    if len(most) == 1:
        return f"{most[0].name} is the largest of its objects: simplify it"
    return (
        f"{most[0].name} and {len(most) - 1} more objects are copies of {len(most[0].mesh.faces)} triangles, each with "
        "light of its own: leave some out, or simplify them"
    )
