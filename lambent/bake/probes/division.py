"""Objects that one probe cannot stand for, cut into parts that have a probe each.

The surface of an object sees points that are hidden from its probe. Where their share is above HIDDEN, the object is
halved across the axis that leaves the least hidden, and so are its parts, if that lowers the share to WORTH of it. A
face belongs to the half that its middle lies in, and is drawn with the probe of that part. Where viewers see the
object, a cut is made only if it pays (`worth`): most that one probe misses is not seen, or blurred.

Flat objects are left whole: planar reflectors show them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lambent.bake.artefacts.geometry import REVISION
from lambent.bake.engine import engine
from lambent.bake.keys import geometry_inputs, key_of
from lambent.bake.timing import Timed, untimed
from lambent.core.arrays import Floats, Indices
from lambent.core.geometry import triangle_areas
from lambent.core.progress import Progress, silent
from lambent.scenes.scene import Mesh, Scene, SceneObject
from lambent.store.contract import needs_probe
from lambent.store.store import Store

if TYPE_CHECKING:
    from lambent.bake.tracing.scene_builder import SceneBuilder
    from lambent.bake.tracing.solids import SolidTest

PARTS = "parts"  # document: the cuts, and the key of everything they depend on
HIDDEN = 0.2  # share above which one probe does not do
WORTH = 0.85  # times the share: a cut that leaves more is not made
DEPTH = 2  # cuts of cuts: at most four parts
FACES = 24  # an object of fewer is left whole


def divided(scene: Scene, store: Store, progress: Progress, timed: Timed = untimed) -> Scene:
    """The scene with its objects in parts; the cuts are found again only where geometry has changed."""
    centres = sorted(scene.probe_centres.items())
    shiny = sorted(name for name, material in scene.materials.items() if needs_probe(material))
    clear = sorted(n for n, m in scene.materials.items() if m.transmits or n in scene.textures)
    worn = [o.material for o in scene.objects]
    key = key_of("geometry", REVISION, "parts that pay", *geometry_inputs(scene), centres, shiny, clear, worn)
    found = store.documents.get(PARTS)
    if not isinstance(found, dict) or found.get("key") != key:
        with timed(PARTS):
            found = {"key": key, "cuts": cuts_of(scene, progress)}
        store.set_document(PARTS, found)
    return split(scene, found["cuts"]) if found["cuts"] else scene


def cuts_of(scene: Scene, progress: Progress = silent) -> dict[str, str]:
    """By name of the objects to be cut, the digits of the parts of their faces. Deterministic."""
    shiny = [o for o in scene.objects if needs_probe(scene.materials[o.material]) and o.name not in scene.probe_centres]
    shiny = [o for o in shiny if len(o.mesh.faces) >= FACES]
    if not shiny:
        return {}
    engine()  # before Mitsuba is imported
    from lambent.bake.probes.centre import flat_axis
    from lambent.bake.tracing.scene_builder import SceneBuilder
    from lambent.bake.tracing.solids import SolidTest
    from lambent.bake.tracing.visibility import viewing_places

    curved = [o for o in shiny if flat_axis(o.mesh) is None]
    if not curved:
        return {}
    builder = SceneBuilder(scene)
    solids = SolidTest(builder, None)
    whole = builder.build()
    places, cuts = viewing_places(scene, whole), {}
    for i, o in enumerate(curved):
        progress(i, len(curved), "what probes see")
        pieces = _pieces_of(builder, o, solids, whole, places)
        if len(pieces) > 1:
            part = np.zeros(len(o.mesh.faces), int)
            for number, faces in enumerate(pieces):
                part[faces] = number
            cuts[o.name] = "".join(map(str, part))
    return cuts


def _pieces_of(builder: SceneBuilder, o: SceneObject, anywhere: SolidTest, whole: Any, places: Floats) -> list[Indices]:
    """Faces of the object's parts; one where it stays whole. Viewers are at `places`, if there are any."""
    from lambent.bake.probes.centre import centre_of
    from lambent.bake.probes.hidden import hidden_share, seen_from, spread
    from lambent.bake.probes.worth import POINTS, pays, seen_in, small_probe

    without = builder.build(leave_out={o.name})
    solids, middle = anywhere.within(without), np.mean(builder.scene.bounds, axis=0)

    def centre(part: Mesh) -> Floats:
        return centre_of(part, middle, solids, without)

    def share(faces: Indices) -> float:
        part = sub_mesh(o.mesh, faces)
        return hidden_share(seen_from(part, without), centre(part), without)

    everything = np.arange(len(o.mesh.faces))
    pieces = _cut(o.mesh, everything, share, DEPTH)[0]
    if len(pieces) < 2 or not len(places):
        return pieces
    meshes = [sub_mesh(o.mesh, faces) for faces in pieces]
    areas = np.array([triangle_areas(mesh.corners).sum() for mesh in meshes])
    counts = np.ceil(POINTS * areas / areas.sum()).astype(int)
    material = builder.scene.materials[o.material]
    seen = [seen_in(*spread(m, n), places, material, whole) for m, n in zip(meshes, counts, strict=True)]
    known = [(s, c) for s, c in ((s, centre(m)) for s, m in zip(seen, meshes, strict=True)) if s is not None]
    if not known:
        return [everything]
    trials = [(small_probe(without, whole, c), c) for c in [centre(o.mesh), *(c for _, c in known)]]
    return pieces if pays([s for s, _ in known], trials[1:], trials[0]) else [everything]


def _cut(mesh: Mesh, faces: Indices, share: Callable[[Indices], float], depth: int) -> tuple[list[Indices], float]:
    """Faces in pieces, by the cuts that leave least hidden from their probes, and how much that is."""
    whole = share(faces)
    if depth == 0 or whole <= HIDDEN or len(faces) < FACES:
        return [faces], whole
    middles = mesh.positions[mesh.faces[faces]].mean(axis=1)
    best, least = [faces], WORTH * whole
    for axis in range(3):
        lower = middles[:, axis] < (middles[:, axis].min() + middles[:, axis].max()) / 2
        if lower.all() or not lower.any():
            continue
        halves = [_cut(mesh, half, share, depth - 1) for half in (faces[lower], faces[~lower])]
        left = float(np.average([hidden for _, hidden in halves], weights=[lower.sum(), (~lower).sum()]))
        if left < least:
            best, least = [piece for pieces, _ in halves for piece in pieces], left
    return best, least if len(best) > 1 else whole


def split(scene: Scene, cuts: Mapping[str, str]) -> Scene:
    """The scene with objects in the parts of `cuts_of`; `Scene.parts` maps each to its whole."""
    cut = {o.name: _parts_of(o, cuts[o.name]) for o in scene.objects if o.name in cuts}
    if not cut:
        return scene
    objects = tuple(part for o in scene.objects for part in cut.get(o.name, (o,)))
    owners = {part.name: name for name, parts in cut.items() for part in parts}
    planes = {part: scene.probe_planes[owner] for part, owner in owners.items() if owner in scene.probe_planes}
    rules = (rule for r in scene.reflector_rules for rule in (r, replace(r, objects=f"{r.objects}.part*")))
    planes = {**scene.probe_planes, **planes}
    return replace(scene, objects=objects, parts=owners, probe_planes=planes, reflector_rules=tuple(rules))


def _parts_of(o: SceneObject, digits: str) -> tuple[SceneObject, ...]:
    part = np.array(list(digits), int)
    meshes = (sub_mesh(o.mesh, np.flatnonzero(part == number)) for number in range(part.max() + 1))
    return tuple(replace(o, name=f"{o.name}.part{i}", mesh=mesh) for i, mesh in enumerate(meshes, 1))


def family(parts: Mapping[str, str], name: str) -> set[str]:
    """The object and all other parts of its whole: a probe leaves them all out."""
    owner = parts.get(name)
    return {name} if owner is None else {part for part, other in parts.items() if other == owner}


def sub_mesh(mesh: Mesh, faces: Indices) -> Mesh:
    """The mesh of some faces alone."""
    vertices, renumbered = np.unique(mesh.faces[faces], return_inverse=True)
    positions, normals, tangents, uv = (a[vertices] for a in (mesh.positions, mesh.normals, mesh.tangents, mesh.uv))
    return Mesh(positions, normals, tangents, uv, renumbered.reshape(-1, 3).astype(np.uint32))
