"""The scene of a store: its location, and the scene as baked."""

from __future__ import annotations

import logging
import os
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.errors import UserError
from lambent.core.inputs import sha256_of
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import ImageEnvironment, Scene
from lambent.store.contract import CUTS, SCENE, ObjectRecord, SceneRecord, scene_record
from lambent.store.kept.session import Surroundings
from lambent.store.store import Store
from lambent.store.textures import read_textures

SOURCE = "source"  # document: "builtin:NAME", or a path relative to the store's folder
CREASE_ANGLE = "crease_angle"  # document: degrees, or null to use the normals of the scene's files
SURROUNDINGS = "surroundings"  # document: the image that lights views instead of the scene's environment, if any
SAME_M = 1e-4  # tolerance for equal bounds: metres, and share of the largest coordinate
log = logging.getLogger(__name__)


def inputs_of(scene: Scene) -> dict[str, str]:
    """SHA-256 of each file of a scene, by file name."""
    return {path.name: sha256_of(path) for path in (*scene.sources, *scene.measured.values())}


def environment_note(image: ImageEnvironment | None) -> dict[str, Any] | None:
    """Meta of an array lit by an image instead of its scene's environment; None without an image."""
    if image is None:
        return None
    return {**asdict(image), "file": sha256_of(image.file)}


def environment_image(store: Store) -> ImageEnvironment | None:
    """The image that lights a store's views instead of its scene's environment, if any."""
    said = store.documents.get(SURROUNDINGS)
    return Surroundings.model_validate(said).image(store.folder) if said else None


def changed_inputs(store: Store, scene: Scene) -> list[str]:
    """Names of the scene's files that changed since the bake."""
    now = inputs_of(scene)
    return sorted(name for name in now.keys() | store.inputs.keys() if now.get(name) != store.inputs.get(name))


def write_source(store: Store, scene: Scene) -> None:
    """Record the location of the scene; nothing for a scene made in memory."""
    place = scene.origin
    if place is not None and not place.startswith("builtin:"):
        place = Path(os.path.relpath(place, store.folder)).as_posix()
    store.set_document(SOURCE, place)
    store.set_document(CREASE_ANGLE, scene.crease_deg)


def scene_of(store: Store, file: str | None = None) -> Scene:
    """The scene of a store, with the materials, textures and emission of the bake; or `file`, entirely as it is.

    Without `file`, the scene is loaded from its location at the bake. Logs a warning if its geometry does not fit
    the store.

    Raises
    ------
    UserError
        If the location is unknown and `file` is None, or the scene cannot be loaded.
    """
    place = file or store.documents.get(SOURCE)
    if not isinstance(place, str):
        raise UserError("store has no path of its scene file", file=store.folder, hint="name it with --scene")
    crease_deg = store.documents.get(CREASE_ANGLE)
    scene = load_scene(place if file or place.startswith("builtin:") else store.folder / place, crease_deg)
    if file or SCENE not in store.documents:  # without the document: baked for edited views alone
        return scene
    record = scene_record(store)
    if not record.objects:  # a store of edited views alone
        names = materials_in_views(store)
        objects = (replace(o, material=names.get(o.name, o.material)) for o in scene.objects)
        return replace(scene, objects=tuple(objects), materials={**scene.materials, **record.materials})
    cuts = set(store.documents.get(CUTS, {}).get("objects", ()))
    known = _parts_by_object(record)
    baked = {o.name: known.get(o.name, []) for o in scene.objects}
    if {part.name for parts in baked.values() for part in parts} != {o.name for o in record.objects} or not all(
        _fits(parts, o.mesh.bounds, len(o.mesh.faces), cuts)
        for parts, o in zip(baked.values(), scene.objects, strict=True)
    ):
        log.warning("%s: the geometry of its scene %s has changed since the bake", store.folder, place)
    objects = (
        replace(o, material=parts[0].material, emission=parts[0].emission) if (parts := baked[o.name]) else o
        for o in scene.objects
    )
    materials = {**scene.materials, **record.materials}
    return replace(scene, objects=tuple(objects), materials=materials, textures=read_textures(store, record))


def materials_in_views(store: Store) -> dict[str, str]:
    """Material name by object, as used by baked edited views; materials may have been merged since."""
    found = (a for a in store.artefacts("view_points") if "objects" in a.meta)
    return {str(name): str(material) for artefact in found for name, material in artefact.meta["objects"]}


def _parts_by_object(record: SceneRecord) -> dict[str, list[ObjectRecord]]:
    """The store's records by object: the object itself, or the parts it was cut into for probes."""
    found: dict[str, list[ObjectRecord]] = {}
    for o in record.objects:
        found.setdefault(o.part_of or o.name, []).append(o)
    return found


def _fits(parts: list[ObjectRecord], bounds: tuple[object, object], faces: int, cuts: set[str]) -> bool:
    """Whether the parts have `faces` faces, or more if the bake cut them, and these bounds.

    The bake cuts faces when it divides an object and along the edges of light (`cuts`).
    """
    baked, was_cut = sum(part.face_count for part in parts), len(parts) > 1 or any(part.name in cuts for part in parts)
    if not parts or baked < faces or (baked > faces and not was_cut):
        return False
    lows, highs = zip(*(part.bounds for part in parts), strict=True)
    both = np.array([np.min(lows, axis=0), np.max(highs, axis=0)])
    return bool(np.allclose(both, np.array(bounds, float), rtol=SAME_M, atol=SAME_M))
