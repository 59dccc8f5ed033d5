"""Objects that one probe cannot stand for: which they are, and where they are cut into parts with a probe each.

A probe shows what its centre sees; a surface mirrors what it sees itself. Rays from points all over an object find what
its surface sees (the object left out, as in its probe); the share of these hits that other things hide from the centre
is light that the probe has never seen. Where it is above HIDDEN, the object is halved across the axis that leaves the
least hidden, and so are its parts, where that lowers the share to WORTH of it. A face belongs to the half that its
middle lies in: each is drawn with one probe, that of its part.

Flat objects are left whole: planar reflectors show them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.bake.mitsuba_scene import SceneBuilder
from lambent.bake.probe_centre import centre_of, flat_axis
from lambent.bake.solids import SolidTest
from lambent.bake.vectors import rays_from
from lambent.core.directions import normalize
from lambent.core.progress import Progress, silent
from lambent.core.sequences import cosine_hemisphere, r2
from lambent.scenes.scene import Mesh, ReflectorRule, Scene, SceneObject
from lambent.store.contract import needs_probe

Array = NDArray[np.floating]
Faces = NDArray[np.integer]
RAYS = 4096  # per object
HIDDEN = 0.2  # share of what a surface sees and its probe does not, from which on an object is cut
WORTH = 0.85  # times the share: a cut that leaves more is not made
DEPTH = 2  # cuts of cuts: at most four parts
FACES = 24  # an object of fewer is left whole
OFTEN = 0.9
_SLACK = 1e-3  # of a ray's length, at its end


@dataclass(frozen=True)
class Seen:
    """What points of a surface see: origins, unit directions, hits (n, 3), and whether there is a hit (n,)."""

    origins: Array
    directions: Array
    hits: Array
    valid: NDArray[np.bool_]


def seen_from(mesh: Mesh, without: Any, count: int = RAYS) -> Seen:
    """Cosine distributed rays from points evenly spread over a mesh; `without` is the Mitsuba scene without it."""
    points, normals = spread(mesh, count)
    local = cosine_hemisphere(r2(count))
    aside = np.where(np.abs(normals[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]])
    t = normalize(np.cross(aside, normals))
    directions = local[:, :1] * t + local[:, 1:2] * np.cross(normals, t) + local[:, 2:] * normals
    size = float(np.ptp(mesh.positions, axis=0).max())
    return seen_along(points + normals * (1e-4 * size), directions, without)


def seen_along(origins: Array, directions: Array, without: Any) -> Seen:
    """What rays (n, 3) meet first in a Mitsuba scene."""
    distance = _distances(without, origins, directions)
    valid = np.isfinite(distance)
    return Seen(origins, directions, origins + directions * np.where(valid, distance, 0.0)[:, None], valid)


def hidden_share(seen: Seen, centre: Array, without: Any) -> float:
    """Share of the hits that something hides from the centre; 0 where nothing is hit."""
    if not seen.valid.any():
        return 0.0
    hits = seen.hits[seen.valid]
    offset = hits - centre
    distance = np.linalg.norm(offset, axis=1)
    t = _distances(without, np.broadcast_to(centre, hits.shape), offset / np.maximum(distance, 1e-9)[:, None])
    return float((t < distance * (1 - _SLACK) - 1e-3).mean())


def parallax_deg(seen: Seen, centre: Array, planes: Array) -> float:
    """Angle, in degrees, between where a hit is seen from the centre and where the planes have it looked up.

    That which OFTEN of the rays do not exceed.
    """
    n, d = planes[:, :3].astype(float), planes[:, 3].astype(float)
    if not seen.valid.any():
        return 0.0
    origins, w, hits = (a[seen.valid] for a in (seen.origins, seen.directions, seen.hits))
    falling = w @ n.T
    height = origins @ n.T + d
    t = np.divide(height, -falling, out=np.full(height.shape, np.inf), where=falling < -1e-6)
    t = np.where(t > 0, t, np.inf).min(axis=1, initial=np.inf)
    met = np.isfinite(t)
    looked_up = np.where(met[:, None], origins + w * np.where(met, t, 0.0)[:, None] - centre, w)
    cosine = (normalize(looked_up) * normalize(hits - centre)).sum(axis=1)
    return float(np.degrees(np.quantile(np.arccos(cosine.clip(-1, 1)), OFTEN)))


def cuts_of(scene: Scene, progress: Progress = silent) -> dict[str, str]:
    """Which objects are to be cut: by name, the digit of each face's part. Deterministic."""
    curved = [o for o in scene.objects if _may_be_cut(scene, o)]
    if not curved:
        return {}
    builder = SceneBuilder(scene)
    solids = SolidTest(builder, None)
    cuts = {}
    for i, o in enumerate(curved):
        progress(i, len(curved), "what probes see")
        pieces = _pieces_of(builder, o, solids)
        if len(pieces) > 1:
            part = np.zeros(len(o.mesh.faces), int)
            for number, faces in enumerate(pieces):
                part[faces] = number
            cuts[o.name] = "".join(map(str, part))
    return cuts


def split(scene: Scene, cuts: Mapping[str, str]) -> Scene:
    """The scene with objects in the parts of `cuts_of`; `Scene.parts` says whose parts they are."""
    cut = {o.name: _parts_of(o, cuts[o.name]) for o in scene.objects if o.name in cuts}
    if not cut:
        return scene
    objects = tuple(part for o in scene.objects for part in cut.get(o.name, (o,)))
    owners = {part.name: name for name, parts in cut.items() for part in parts}
    planes = {part: scene.probe_planes[owner] for part, owner in owners.items() if owner in scene.probe_planes}
    return replace(
        scene,
        objects=objects,
        parts=owners,
        probe_planes={**scene.probe_planes, **planes},
        reflector_rules=tuple(_for_parts(scene.reflector_rules)),
    )


def _parts_of(o: SceneObject, digits: str) -> tuple[SceneObject, ...]:
    part = np.array(list(digits), int)
    meshes = (_sub_mesh(o.mesh, np.flatnonzero(part == number)) for number in range(part.max() + 1))
    return tuple(replace(o, name=f"{o.name}.part{i}", mesh=mesh) for i, mesh in enumerate(meshes, 1))


def _for_parts(rules: tuple[ReflectorRule, ...]) -> list[ReflectorRule]:
    return [rule for r in rules for rule in (r, replace(r, objects=f"{r.objects}.part*"))]


def family(parts: Mapping[str, str], name: str) -> set[str]:
    """The object itself and the other parts of what it is a part of: a probe leaves them all out."""
    owner = parts.get(name)
    return {name} if owner is None else {part for part, other in parts.items() if other == owner}


def _may_be_cut(scene: Scene, o: SceneObject) -> bool:
    wants_one = needs_probe(scene.materials[o.material]) and o.name not in scene.probe_centres
    return wants_one and len(o.mesh.faces) >= FACES and flat_axis(o.mesh) is None


def _pieces_of(builder: SceneBuilder, o: SceneObject, anywhere: SolidTest) -> list[Faces]:
    """Faces of the object's parts; one where it stays whole."""
    without = builder.build(leave_out={o.name})
    solids, middle = anywhere.within(without), np.mean(builder.scene.bounds, axis=0)

    def share(faces: Faces) -> float:
        part = _sub_mesh(o.mesh, faces)
        return hidden_share(seen_from(part, without), centre_of(part, middle, solids, without), without)

    return _cut(o.mesh, np.arange(len(o.mesh.faces)), share, DEPTH)[0]


def _cut(mesh: Mesh, faces: Faces, share: Callable[[Faces], float], depth: int) -> tuple[list[Faces], float]:
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


def _sub_mesh(mesh: Mesh, faces: Faces) -> Mesh:
    vertices, renumbered = np.unique(mesh.faces[faces], return_inverse=True)
    arrays = (a[vertices] for a in (mesh.positions, mesh.normals, mesh.tangents, mesh.uv))
    return Mesh(*arrays, renumbered.reshape(-1, 3).astype(np.uint32))


def spread(mesh: Mesh, count: int) -> tuple[Array, Array]:
    """Points and normals (count, 3), evenly over the area."""
    corners = mesh.positions[mesh.faces].astype(float)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    up_to = np.cumsum(np.linalg.norm(cross, axis=1))
    rng = np.random.default_rng(0)
    face = np.searchsorted(up_to, (np.arange(count) + 0.5) / count * up_to[-1]).clip(0, len(cross) - 1)
    weights = rng.dirichlet((1, 1, 1), size=count)
    order = rng.permutation(count)  # so that a point's place on the object says nothing of its ray's direction
    return np.einsum("kcx,kc->kx", corners[face], weights)[order], normalize(cross[face])[order]


def _distances(scene: Any, origins: Array, directions: Array) -> Array:
    """To the first hit, infinite where there is none."""
    return np.asarray(np.array(scene.ray_intersect_preliminary(rays_from(origins, directions)).t), float)
