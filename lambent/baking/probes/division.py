"""Division of objects that one probe cannot represent into parts with their own probes.

An object's surface sees points that are hidden from its probe. If their share exceeds HIDDEN, the object is halved
across the axis that leaves the smallest share, as are its parts, provided the share falls to WORTH of its value. Faces
are cut as well. If viewers see the object, a cut must also pay off (`worth`): most of a probe's misses are out of sight
or blurred. Near a cut the renderer blends the light of both probes, by the borders of the parts.

Flat objects stay whole, because planar reflectors show them, as do objects with a light field.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lambent.baking.artefacts.geometry import REVISION
from lambent.baking.engine import engine
from lambent.baking.running.keys import geometry_inputs, key_of
from lambent.baking.running.timing import Timed, untimed
from lambent.baking.surfaces.cutting import cut_across
from lambent.baking.surfaces.visible_triangles import TriangleVisibility
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry.triangles import triangle_areas
from lambent.core.plain import quad
from lambent.core.progress import Progress, silent
from lambent.scenes.scene import Border, Mesh, Scene, SceneObject
from lambent.store.contract import needs_probe
from lambent.store.store import Store

if TYPE_CHECKING:
    from lambent.baking.tracing.scene_builder import SceneBuilder
    from lambent.baking.tracing.solids import SolidTest

Cut = list[tuple[Border, ...]]  # the borders of each part, as in `store.contract`
PARTS = "parts"  # document: the cuts, and the key of all their inputs
HIDDEN = 0.2  # share above which one probe is insufficient
WORTH = 0.85  # factor to which a cut must lower the share
SOFT = 0.5  # relative to the distance of the halves' centres: width over which their probes are blended
DEPTH = 2  # levels of cuts: at most four parts
FACES = 24  # objects with fewer stay whole
RAYS, LEAST_RAYS = 8192, 256  # from an object, and at least from each of its parts
BURIED = 0.9  # share above which a centre may lie in a solid, from where the target points are not visible
LEAST_RAD = 0.06  # angular size for the median viewer; smaller objects stay whole
CERTAIN = 0.75  # times HIDDEN, by few rays: objects below hide too little
SCREENED = 4096  # the largest objects, which are screened more closely
MOST = 24  # the largest of them, for which cuts are tried


def divided(sight: TriangleVisibility, store: Store, progress: Progress, timed: Timed = untimed) -> TriangleVisibility:
    """The scene with its objects divided; the cuts are recomputed only if geometry has changed."""
    scene = sight.scene
    centres = sorted(scene.probe_centres.items())
    shiny = sorted(name for name, material in scene.materials.items() if needs_probe(material))
    clear = sorted(n for n, m in scene.materials.items() if m.transmits or n in scene.textures)
    materials = [o.material for o in scene.objects]
    whole = [sorted(scene.light_fields)] if scene.light_fields else []  # stores without light fields keep their keys
    looks = [centres, shiny, clear, materials, *whole]
    key = key_of("geometry", REVISION, "parts with borders", *geometry_inputs(scene), *looks)
    found = store.documents.get(PARTS)
    if not isinstance(found, dict) or found.get("key") != key:
        with timed(PARTS):
            found = {"key": key, "cuts": cuts_of(sight, progress)}
        store.set_document(PARTS, found)
    cuts = {name: [tuple(map(quad, borders)) for borders in cut] for name, cut in found["cuts"].items()}
    return TriangleVisibility(split(scene, cuts)) if cuts else sight


def cuts_of(sight: TriangleVisibility, progress: Progress = silent) -> dict[str, Cut]:
    """By name of divided object, the borders of each part. Deterministic."""
    scene = sight.scene
    mirrors = {name for name, material in scene.materials.items() if needs_probe(material)}
    shiny = [o for o in scene.objects if o.material in mirrors and o.name not in scene.probe_centres]
    shiny = [o for o in shiny if len(o.mesh.faces) >= FACES and o.name not in scene.light_fields]
    if not shiny:
        return {}
    engine()  # before Mitsuba is imported
    from lambent.baking.tracing.scene_builder import SceneBuilder
    from lambent.baking.tracing.seen.visibility import viewing_places
    from lambent.baking.tracing.solids import SolidTest

    progress(0, 1, "views of probes")
    places = viewing_places(scene, sight.everything)
    tried = _worth_trying(sight, shiny, places)
    if not tried:
        return {}
    builder = SceneBuilder(scene, coarse_sky=True)
    whole, solids, cuts = builder.build(), SolidTest(builder, None), dict[str, Cut]()
    for i, o in enumerate(tried):
        progress(i, len(tried), "views of probes")
        cut = _cut_of(builder, o, solids, whole, places)
        if len(cut) > 1:
            cuts[o.name] = cut
    return cuts


def _worth_trying(sight: TriangleVisibility, objects: list[SceneObject], places: Floats) -> list[SceneObject]:
    """The MOST largest objects, in order, that are not flat, look large and seem to need more than one probe."""
    from lambent.baking.probes.centre import flat_axis
    from lambent.baking.probes.screening import hidden_shares, median_distances, widths

    meshes = [o.mesh for o in objects]
    size = widths(meshes)
    large = np.arange(len(objects))
    if len(places):
        size /= np.maximum(median_distances(meshes, places), size)
        large = np.flatnonzero(size > LEAST_RAD)
    large = np.sort(large[np.argsort(-size[large], kind="stable")][:SCREENED])
    large = np.array([i for i in large if flat_axis(meshes[i]) is None], np.int64)
    numbers = {o.name: number for number, o in enumerate(sight.scene.objects)}
    mine = [meshes[i] for i in large], [numbers[objects[i].name] for i in large]
    hidden = hidden_shares(sight.everything, sight.owner, *mine)
    tried = large[hidden > CERTAIN * HIDDEN]
    return [objects[i] for i in sorted(tried[np.argsort(-size[tried], kind="stable")][:MOST])]


def _cut_of(builder: SceneBuilder, o: SceneObject, anywhere: SolidTest, whole: Any, places: Floats) -> Cut:
    """The borders of the object's parts, one part if it stays whole. Viewers are at `places`, if there are any."""
    from lambent.baking.probes.centre import centre_among, centre_of
    from lambent.baking.probes.hidden import hidden_share, seen_from, spread
    from lambent.baking.probes.worth import POINTS, pays, seen_in, small_probes

    without = builder.build(leave_out={o.name})
    solids, middle = anywhere.within(without), np.mean(builder.scene.bounds, axis=0)
    points, normals = spread(o.mesh, RAYS)
    surface = seen_from(points, normals, without)

    def share(mine: Flags) -> float:
        """Hidden share from the centre, or, if that seems to lie in a solid, from where it is moved out to."""
        seen, part = surface.among(mine), (points[mine], normals[mine], middle)
        hidden = hidden_share(seen, centre_among(*part, None, without), without)
        return hidden if hidden < BURIED else hidden_share(seen, centre_among(*part, solids, without), without)

    cut = _cut(points, np.ones(RAYS, bool), (), share, DEPTH)[0]
    if len(cut) < 2 or not len(places):
        return cut
    meshes = parts_of(o.mesh, cut)
    areas = np.array([triangle_areas(mesh.corners).sum() for mesh in meshes])
    counts = np.ceil(POINTS * areas / areas.sum()).astype(int)
    material = builder.scene.materials[o.material]
    seen = seen_in([spread(m, n) for m, n in zip(meshes, counts, strict=True)], places, material, whole)
    known = [(s, centre_of(m, middle, solids, without)) for s, m in zip(seen, meshes, strict=True) if s is not None]
    if not known:
        return [()]
    centres = [centre_of(o.mesh, middle, solids, without), *(c for _, c in known)]
    trials = list(zip(small_probes(without, whole, np.array(centres)), centres, strict=True))
    return cut if pays([s for s, _ in known], trials[1:], trials[0]) else [()]


def _cut(
    points: Floats, mine: Flags, borders: tuple[Border, ...], share: Callable[[Flags], float], depth: int
) -> tuple[Cut, float]:
    """Divide the part of a surface within `borders`, `mine` (n,) of its points (n, 3); returns parts and hidden share.

    Chooses the cuts with the smallest hidden `share`.
    """
    hidden = share(mine)
    if depth == 0 or hidden <= HIDDEN:
        return [borders], hidden
    best, least = [borders], WORTH * hidden
    for axis in range(3):
        low, high = float(points[mine, axis].min()), float(points[mine, axis].max())
        lower = points[:, axis] < (low + high) / 2
        if min((mine & lower).sum(), (mine & ~lower).sum()) < LEAST_RAYS:
            continue
        a, b, c, d = (np.append(np.eye(3)[axis], -(low + high) / 2) / (SOFT * (high - low) / 2)).tolist()
        sides = (lower, (-a, -b, -c, -d)), (~lower, (a, b, c, d))
        halves = [_cut(points, mine & side, (*borders, border), share, depth - 1) for side, border in sides]
        left = float(np.average([missed for _, missed in halves], weights=[(mine & side).sum() for side, _ in sides]))
        if left < least:
            best, least = [part for parts, _ in halves for part in parts], left
    return best, least if len(best) > 1 else hidden


def split(scene: Scene, cuts: Mapping[str, Cut]) -> Scene:
    """The scene with objects divided by `cuts_of`; `Scene.parts` maps each part to its whole."""
    if not cuts:
        return scene
    cut = {o.name: _objects_of(o, cuts[o.name]) for o in scene.objects if o.name in cuts}
    objects = tuple(part for o in scene.objects for part in cut.get(o.name, (o,)))
    owners = {part.name: name for name, parts in cut.items() for part in parts}
    planes = {part: scene.probe_planes[owner] for part, owner in owners.items() if owner in scene.probe_planes}
    rules = (rule for r in scene.reflector_rules for rule in (r, replace(r, objects=f"{r.objects}.part*")))
    borders = {part.name: own for name, parts in cut.items() for part, own in zip(parts, cuts[name], strict=True)}
    return replace(
        scene, objects=objects, parts=owners, borders=borders, probe_planes={**scene.probe_planes, **planes},
        reflector_rules=tuple(rules),
    )  # fmt: skip


def _objects_of(o: SceneObject, cut: Cut) -> tuple[SceneObject, ...]:
    meshes = parts_of(o.mesh, cut)
    return tuple(replace(o, name=f"{o.name}.part{i}", mesh=mesh) for i, mesh in enumerate(meshes, 1))


def parts_of(mesh: Mesh, cut: Cut) -> list[Mesh]:
    """The mesh cut along the borders of its parts, so that no face belongs to two of them."""
    for plane in dict.fromkeys(max(border, quad(-x for x in border)) for borders in cut for border in borders):
        mesh = cut_across(mesh, plane)
    middles = np.concatenate([mesh.corners.mean(axis=1), np.ones((len(mesh.faces), 1))], axis=1)
    inside = np.stack([(middles @ np.array(borders).reshape(-1, 4).T).min(axis=1, initial=np.inf) for borders in cut])
    part = inside.argmax(axis=0)
    return [sub_mesh(mesh, np.flatnonzero(part == number)) for number in range(len(cut))]


def family(parts: Mapping[str, str], name: str) -> set[str]:
    """The object and all other parts of its whole: a probe leaves all of them out."""
    owner = parts.get(name)
    return {name} if owner is None else {part for part, other in parts.items() if other == owner}


def sub_mesh(mesh: Mesh, faces: Indices) -> Mesh:
    """The mesh restricted to some faces."""
    vertices, renumbered = np.unique(mesh.faces[faces], return_inverse=True)
    return mesh.at_vertices(vertices, renumbered.reshape(-1, 3).astype(np.uint32))
