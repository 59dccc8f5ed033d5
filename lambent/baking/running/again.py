"""Rebake a store's light for other materials into a copy: same geometry, same settings, same seed.

The copy has the geometry, the light map and the probes. Each texel and each probe can replace the store's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from lambent.baking.bake import bake
from lambent.baking.quality import Quality
from lambent.baking.running.watch import Watch
from lambent.core.errors import UserError
from lambent.core.progress import Progress, silent
from lambent.materials.document import Material
from lambent.scenes.lamp_edits import LampEdit, with_lamp_edits
from lambent.scenes.looks.variants import textures_in_looks
from lambent.scenes.scene import ImageTexture, Look, Scene
from lambent.store.contract import LAST_RUN, SIDES, TIMINGS, needs_probe, probe_name, scene_record, shared_probes
from lambent.store.source import SOURCE, scene_of
from lambent.store.store import MANIFEST, Store

COPY_OF = "copy_of"  # document: name of the store that was copied
KINDS = ("light_map", "probe")
LIGHT, BACK = (f"light_map/{side}" for side in SIDES)


def rebaked_copy(folder: Path) -> Path:
    """Path of a store's copy: ROOM.rebake.store beside ROOM.store."""
    folder = folder.resolve()
    return folder.with_name(f"{folder.name.removesuffix('.store')}.rebake.store")


def bake_again(
    folder: Path,
    copy: Path,
    materials: Mapping[str, Material],
    progress: Progress = silent,
    *,
    textures: Mapping[str, str | ImageTexture] | None = None,
    lamps: Mapping[int, LampEdit] = MappingProxyType({}),
    quality: Quality | None = None,
    watch: Watch | None = None,
) -> Store:
    """Bake light map and probes of the store in `folder` into `copy`, with some of its materials replaced.

    An existing copy is brought up to date; an interrupted bake is resumed. The store itself is only read.

    Parameters
    ----------
    textures : mapping, optional
        By material, the name of the material whose textures it uses, "" for none, or an image.
    lamps : mapping, optional
        Edits of lamps, by their place among the scene's lights.
    quality : Quality, optional
        By default the store's preset.
    watch : Watch, optional
        Notified as light arrives in the copy.

    Raises
    ------
    UserError
        If the store's scene is unknown or its bake used custom settings; if `copy` is something else; if the new
        materials need other geometry, probes or sides of the light map.
    """
    store = Store.open(folder)
    if not isinstance(store.documents.get(SOURCE), str):
        raise UserError("store has no path of its scene file", file=folder, hint="bake the scene again from its file")
    if LIGHT not in store:
        raise UserError("store has no light map", file=folder, field=LIGHT)
    made_with = store.artefact(LIGHT).meta
    scene = edited_scene(store, materials, textures or {}, lamps)
    _check_parts(store, scene, materials)
    _prepare(store, copy)
    effort, seed = quality or str(made_with.get("quality")), int(made_with.get("seed", 0))
    with bake(scene, copy, only={"geometry"}, quality=effort, seed=seed, progress=progress) as copied:
        if not _same_geometry(store, copied):
            what = "these materials need probes or parts that the store lacks, or its geometry is of an older version"
            raise UserError(what, file=folder, hint="bake the scene again, with these materials")
    return bake(
        scene,
        copy,
        only={*KINDS, *(("lamps",) if lamps else ())},
        quality=effort,
        seed=seed,
        progress=progress,
        watch=watch,
    )


def edited_scene(
    store: Store, materials: Mapping[str, Material], textures: Mapping[str, str | ImageTexture],
    lamps: Mapping[int, LampEdit],
) -> Scene:  # fmt: skip
    """The scene of a store with edits as of `bake_again`; raises `UserError` if the store does not know its scene."""
    scene = with_lamp_edits(scene_of(store), lamps)
    exchanged = {name: Look(scene.materials[name], of) for name, of in textures.items()}
    return replace(
        scene,
        materials={**scene.materials, **materials},
        textures=textures_in_looks(scene.textures, exchanged),
        measured={name: file for name, file in scene.measured.items() if name not in materials},
    )


def check_copy(store: Store, folder: Path) -> None:
    """Raise `UserError` if a store in `folder` was not made as a copy of this one."""
    if (folder / MANIFEST).exists() and Store.open(folder).documents.get(COPY_OF) != store.folder.name:
        raise UserError("is another store", file=folder, hint="move it: edited materials are baked into this folder")


def _check_parts(store: Store, scene: Scene, materials: Mapping[str, Material]) -> None:
    """Raise `UserError` if a material needs a probe, or a light map of its far side, that the store lacks.

    The renderer would substitute the nearest probe, and no light, which a complete bake would not show.
    """
    record, shared = scene_record(store), shared_probes(store)
    for name in sorted(materials):
        baked, wanted = record.materials.get(name), materials[name]
        textures_in_look = [o.name for o in record.objects if o.material == name]
        if baked is None or not textures_in_look:
            continue
        lacks = ""
        owners = [shared.get(one, one) for one in textures_in_look]
        if needs_probe(wanted) and not needs_probe(baked):
            lacks = "" if all(probe_name(one, "radiance") in store for one in owners) else "a probe"
        if wanted.transmits and not baked.transmits and BACK not in store:
            lacks = "a light map of its far side"
        if lacks:
            hint = f"add a [[variants]] with this {name} to the scene, and bake it"
            hint = hint if lacks == "a probe" else f"bake the scene with this {name}"
            raise UserError(f"needs {lacks}, which the store lacks", field=name, hint=hint)


def _prepare(store: Store, folder: Path) -> None:
    """Create the copy with the geometry and notes of the store, if it does not exist yet."""
    check_copy(store, folder)
    with Store.create(folder, store.inputs) as copy:
        for name, document in store.documents.items():
            if name not in (TIMINGS, LAST_RUN):
                copy.set_document(name, document)
        copy.set_document(COPY_OF, store.folder.name)
        for artefact in store.artefacts("geometry"):
            if artefact.name not in copy or copy.artefact(artefact.name).key != artefact.key:
                copy.put(artefact.name, "geometry", store.read(artefact.name), key=artefact.key, meta=artefact.meta)


def _same_geometry(store: Store, copy: Store) -> bool:
    """Whether all geometry arrays equal the store's."""
    keys = {artefact.name: artefact.key for artefact in store.artefacts("geometry")}
    return keys == {artefact.name: artefact.key for artefact in copy.artefacts("geometry")}
