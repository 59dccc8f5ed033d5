"""Sharing of probes between neighbouring objects, where viewers would hardly notice.

A probe suits another object as far as its centre sees what viewers see mirrored in that object. Viewers' rays are
mirrored at points all over each object, and two shares of them are wrong in a neighbour's probe: rays whose hits are
hidden from its centre, and rays that hit an object that the probe leaves out. A probe suits if both together stay below
a limit: HIDDEN at MEDIUM size as seen by the median viewer, scaled by the inverse root of the size. Of the left out
hits, at most OPEN may have nothing behind them, because even a small thing would then mirror the sky. What is left out
may hide at most OPEN of the emitters' light, because the probe shows a lamp without its shade. An object does not share
a probe if it is larger than SMALL plus its lobe's roughness, which blurs as much, or if the probe's centre is farther
away than NEAR of the mirrored distance, or less for narrow lobes: distant look-ups are turned wrongly. Groups are found
greedily, the largest first.

Objects that fill only a few pixels when close, or that nobody sees, have no probe and show the nearest, as do the
groups that fill least of the view if a scene has very many (leaves, for example): there are MOST probes.

A probe leaves out its objects except `held` ones: flat ones that viewers see from one side, on which it stands, and
those without a probe because nobody sees them. Without its ceiling, a probe would see the sky, which wide lobes and all
objects that share the probe would bring into the room.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from lambent.baking.probes.centre import flat_axis, outside
from lambent.baking.probes.division import HIDDEN, family
from lambent.baking.probes.hidden import SHORT, spread
from lambent.baking.probes.screening import median_distances, widths
from lambent.baking.probes.selection import viewers_of, widest_lobe
from lambent.baking.tracing.rays import leaving, rays_from
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize, reflect
from lambent.core.geometry.triangles import points_on_triangles, triangle_areas, triangle_normals
from lambent.core.light.colour import luminance
from lambent.scenes.mesh import boxes_of
from lambent.scenes.scene import Mesh

POINTS = 256  # per object
NEIGHBOURS = 12  # candidates per object for sharing a probe
JUDGED = 1024  # objects
MOST = 64  # probes per scene, about two CPU seconds each at `preview`; exceeded only if the scene places more
MEDIUM, SMALL = 0.1, 0.06  # radians
NEAR, REACH = 0.5, 0.75  # limit relative to the mirrored distance, for wide lobes, and the quantile of that distance
MOST_BEYOND, LEAST_MET = 4.0, 0.05  # limit of that distance by the median hit, if more than this share of rays hits
NEAR_MIRROR, PER_BLUR = 0.2, 2.0  # limit for mirrors, and its increase by a lobe's roughness, which blurs errors
OPEN = 0.04  # share of an object's mirrored rays that may hit left out objects with nothing, or emitters, behind
CROSSINGS = 4  # of left out objects, after which something counts as behind
ONE_SIDE = 0.95  # share of a flat object's mirrored rays that leave on one side of it
FEW = 0.006  # radians: six pixels of a picture of 60 degrees and 1080 rows
SEEN = 4  # of the points, from anywhere: below this, nobody sees the object
CLOSEST = 0.05  # quantile of the distances of viewers
SKY = 10.0  # diagonals of the scene: distance assumed for misses
NOTHING = -1


@dataclass(frozen=True)
class Looked:
    """What viewers see mirrored in N objects, at POINTS points of each.

    `ways` (N, POINTS, 3) are unit directions, `hits` (N, POINTS, 3) their hits, `met` (N, POINTS) the object hit, or
    NOTHING, and `open` (N, POINTS) whether nothing is behind that object. `valid` (N, POINTS) marks points seen by a
    viewer. `size` and `largest` (N,) are the objects' angular sizes in radians, for the median viewer and for close
    ones; `reach` (N,) is the distance in metres to far hits.
    """

    ways: Floats
    hits: Floats
    met: NDArray[np.int64]
    open: NDArray[np.bool_]
    valid: NDArray[np.bool_]
    size: Floats
    largest: Floats
    reach: Floats


@dataclass(frozen=True)
class Sharing:
    """The owner of the shown probe, by object without its own, and the objects that no probe leaves out."""

    owners: dict[str, str]
    held: frozenset[str]


def shared(builder: SceneBuilder, whole: Any, places: Floats, names: Collection[str]) -> Sharing:
    """Assign shared probes to the objects `names`.

    `whole` is the Mitsuba scene of the builder, `places` (m, 3) are the viewers'; without viewers, no probe is shared.
    Objects whose probe the scene places keep their own. Beyond the JUDGED objects that look largest, objects show the
    nearest probe: judging takes time and memory by pairs.
    """
    scene, names = builder.scene, list(names)
    if not names or not len(places):
        return Sharing({}, frozenset())
    meshes = [scene.object(name).mesh for name in names]
    size = widths(meshes)
    size /= np.maximum(median_distances(meshes, places), size)
    size[[name in scene.probe_centres or name in scene.probe_planes for name in names]] = np.inf
    judged = np.zeros(len(names), bool)
    judged[np.argsort(-size, kind="stable")[: max(JUDGED, int(np.isinf(size).sum()))]] = True
    found = _judged(builder, whole, places, [names[i] for i in np.flatnonzero(judged)])
    if judged.all():
        return found
    own = np.array([i for i in np.flatnonzero(judged) if names[i] not in found.owners])
    middles, rest = boxes_of(meshes).mean(axis=1), np.flatnonzero(~judged)
    nearest = own[KDTree(middles[own]).query(middles[rest])[1]]
    shown = {names[i]: names[owner] for i, owner in zip(rest, nearest, strict=True)}
    return Sharing(found.owners | shown, found.held | shown.keys())


def _judged(builder: SceneBuilder, whole: Any, places: Floats, names: list[str]) -> Sharing:
    scene = builder.scene
    meshes = [scene.object(name).mesh for name in names]
    middle = np.mean(scene.bounds, axis=0)
    looked = _looked(builder, whole, places, names)
    clear = np.array([scene.materials[scene.object(name).material].transmits for name in names])
    ways = [way[valid & ~through] for way, valid, through in zip(looked.ways, looked.valid, clear, strict=True)]
    centres = np.stack([outside(mesh, middle, way, whole) for mesh, way in zip(meshes, ways, strict=True)])
    given = np.array([name in scene.probe_centres or name in scene.probe_planes for name in names])
    shown = given | ((looked.valid.sum(axis=1) >= SEEN) & (looked.largest >= FEW))
    if not shown.any():
        shown[np.argmax(looked.largest)] = True
    worth = np.flatnonzero(shown)
    near = np.argsort(np.linalg.norm(centres[worth, None] - centres[worth], axis=2), axis=1)[:, : NEIGHBOURS + 1]
    pairs = np.stack([np.repeat(worth, near.shape[1]), worth[near].ravel()], axis=1)
    alone = np.array([any(scene.object(name).emission) for name in names])  # a lamp that is left out would be missed
    pairs = pairs[(clear[pairs[:, 0]] == clear[pairs[:, 1]]) & ~given[pairs[:, 0]] & ~alone[pairs].any(axis=1)]
    blur = np.array([widest_lobe(scene.materials[scene.object(name).material]) for name in names])
    one, other = pairs.T
    near = np.minimum(NEAR_MIRROR + PER_BLUR * blur, NEAR)
    close = np.linalg.norm(centres[one] - centres[other], axis=1) < near[one] * looked.reach[one]
    pairs = pairs[(one != other) & close & (looked.size[one] < SMALL + blur[one])]
    flat = np.array([_is_seen_from_one_side(*one) for one in zip(meshes, looked.ways, looked.valid, strict=True)])
    held = ~shown | (flat & ~clear & ~given)
    limits = np.minimum(HIDDEN * np.sqrt(MEDIUM / np.maximum(looked.size, 1e-9)), 1)
    lost, bare = (_lost(looked, rays, held) for rays in (looked.valid, looked.valid & looked.open))
    bare += _revealed(builder, whole, names, held)
    wrong = _wrong(builder, whole, names, centres, looked, pairs, held)
    owner = _grouped(worth, pairs, wrong, lost, bare, limits)
    own = _largest(owner, worth, looked.size, given)
    for i in np.flatnonzero(~np.isin(owner, own)):
        owner[i] = own[np.argmin(np.linalg.norm(centres[own] - centres[i], axis=1))]
    owners = {name: names[owner[i]] for i, name in enumerate(names) if owner[i] != i}
    return Sharing(owners, frozenset(names[i] for i in np.flatnonzero(held)))


def _is_seen_from_one_side(mesh: Mesh, ways: Floats, valid: NDArray[np.bool_]) -> bool:
    """Whether a mesh is flat, and its `valid` mirrored rays `ways` (POINTS, 3) leave on one side of it."""
    axis = flat_axis(mesh)
    if axis is None or not valid.any():
        return False
    above = float((ways[valid] @ axis > 0).mean())
    return max(above, 1 - above) >= ONE_SIDE


def _largest(
    owner: NDArray[np.int64], worth: NDArray[np.int64], size: Floats, given: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """The owners whose probes are baked: the MOST whose objects fill most of the view, and all `given` ones."""
    filled = np.bincount(owner[worth], size[worth] ** 2, minlength=len(owner))
    filled[given] = np.inf
    own = np.unique(owner[worth])
    kept = own[np.argsort(-filled[own], kind="stable")]
    return np.sort(kept[: max(MOST, int(given.sum()))])


def _looked(builder: SceneBuilder, whole: Any, places: Floats, names: list[str]) -> Looked:
    scene, count = builder.scene, len(names)
    meshes = [scene.object(name).mesh for name in names]
    points, normals = (np.concatenate(a) for a in zip(*(spread(mesh, POINTS) for mesh in meshes), strict=True))
    found, eyes = viewers_of(points, normals, places, whole, np.random.default_rng(0))
    view = normalize(np.where(found[:, None], eyes - points, normals))
    clear = np.repeat([scene.materials[scene.object(name).material].transmits for name in names], POINTS)
    directions = np.where(clear[:, None], -view, reflect(view, normals))
    first = _FirstHits(builder, whole, names)
    t, met = first(leaving(whole, points, normals, directions))
    open_ = _nothing_behind(first, points, directions, t, met)
    far = SKY * float(np.linalg.norm(np.ptp(np.array(scene.bounds), axis=0)))
    reach = _reach(t.reshape(count, POINTS), far)
    t = np.where(np.isfinite(t), t, far)
    valid, distance = (a.reshape(count, POINTS) for a in (found, np.linalg.norm(eyes - points, axis=1)))
    seen = [
        np.quantile(d[v], (CLOSEST, 0.5)) if v.any() else (np.inf,) * 2 for d, v in zip(distance, valid, strict=True)
    ]
    largest, size = widths(meshes) / np.array(seen).T
    ways, hits = (a.reshape(count, POINTS, 3) for a in (directions, points + directions * t[:, None]))
    grid = count, POINTS
    return Looked(ways, hits, met.reshape(grid), open_.reshape(grid), valid, size, largest, reach)


def _reach(t: Floats, far: float) -> Floats:
    """(N,) distance to far hits of rays of lengths (N, POINTS), infinite for the sky, which counts as `far`.

    An object outdoors mirrors the sky, but the ground beside it as well: where far hits are in the sky, MOST_BEYOND
    limits their distance by that of other hits.
    """
    of_all = np.quantile(np.minimum(t, far), REACH, axis=1)
    count, met = np.isfinite(t).sum(axis=1), np.sort(t, axis=1)
    longest, middle = (np.take_along_axis(met, at[:, None], axis=1)[:, 0] for at in (count - 1, (count - 1) // 2))
    outdoors = (count > LEAST_MET * t.shape[1]) & (of_all > longest)
    return np.asarray(np.where(outdoors, np.minimum(of_all, MOST_BEYOND * middle), of_all))


def _nothing_behind(
    first: _FirstHits, points: Floats, ways: Floats, t: Floats, met: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Whether rays (n,) along `ways` (n, 3), which `met` an object after `t`, hit no other object beyond it."""
    found, at, left = np.zeros(len(points), bool), t.copy(), np.flatnonzero(met != NOTHING)
    for _ in range(CROSSINGS):
        if not len(left):
            break
        at[left] += SHORT * (1 + at[left])
        ahead, other = first(rays_from(points[left] + ways[left] * at[left, None], ways[left]))
        found[left[~np.isfinite(ahead)]] = True
        again = np.isfinite(ahead) & (other == met[left])
        left = left[again]
        at[left] += ahead[again]
    return found


class _FirstHits:
    """Finds the first hits of rays in `whole`, and their objects' indices in `names`, NOTHING for other objects."""

    def __init__(self, builder: SceneBuilder, whole: Any, names: list[str]) -> None:
        places = {name: i for i, name in enumerate(names)}
        self._places = np.array([places.get(o.name, NOTHING) for o in builder.scene.objects])
        self._whole, self._numbers = whole, builder.numbers

    def __call__(self, ray: Any) -> tuple[Floats, NDArray[np.int64]]:
        """Distances (n,), infinite without a hit, and indices (n,)."""
        found = self._whole.ray_intersect_preliminary(ray)
        met = found.is_valid()
        place = self._places[np.array(self._numbers.at(found, met))]
        return np.array(found.t).astype(float), np.where(np.array(met), place, NOTHING)


def _lost(looked: Looked, rays: NDArray[np.bool_], held: NDArray[np.bool_]) -> Floats:
    """(N, N): share of an object's rays that are among `rays` (N, POINTS) and hit another that is not `held` (N,)."""
    count = len(held)
    own = np.arange(count)[:, None]
    seen = rays & (looked.met != NOTHING) & (looked.met != own) & ~held[looked.met]
    flat = np.bincount((own * count + looked.met)[seen], minlength=count * count).reshape(count, count)
    return np.asarray(flat / np.maximum(looked.valid.sum(axis=1, keepdims=True), 1))


def _revealed(builder: SceneBuilder, whole: Any, names: list[str], held: NDArray[np.bool_]) -> Floats:
    """(N, N): share of an object's points from which another object, with its other parts, hides emitters.

    It counts if it is the first thing on the way from the emitter, and not `held` (N,).
    """
    scene, count = builder.scene, len(names)
    lamps = [o for o in scene.objects if any(o.emission)]
    corners = np.concatenate([lamp.mesh.corners for lamp in lamps] or [np.zeros((0, 3, 3))])
    bright = [float(luminance(np.array(lamp.emission, float))) for lamp in lamps]
    power = triangle_areas(corners) * np.repeat(bright, [len(lamp.mesh.faces) for lamp in lamps])
    if not power.any():
        return np.zeros((count, count))
    rng = np.random.default_rng(0)
    face = rng.choice(len(corners), count * POINTS, p=power / power.sum())
    lit, facing = points_on_triangles(corners, face, rng), triangle_normals(corners)[face]
    points, normals = (
        np.concatenate(a) for a in zip(*(spread(scene.object(n).mesh, POINTS) for n in names), strict=True)
    )
    distance = np.linalg.norm(points - lit, axis=1)
    w = (points - lit) / np.maximum(distance, 1e-9)[:, None]
    start = SHORT * (1 + distance)
    t, between = _FirstHits(builder, whole, names)(rays_from(lit + w * start[:, None], w))
    hidden = ((facing * w).sum(axis=1) > 0) & ((normals * w).sum(axis=1) < 0) & (t < distance - 2 * start)
    hidden &= (between != NOTHING) & ~held[between]
    pair = np.repeat(np.arange(count), POINTS) * count + between
    by_part = np.bincount(pair[hidden], minlength=count * count).reshape(count, count) / POINTS
    wholes = np.array([min(family(scene.parts, name)) for name in names])
    same = wholes[:, None] == wholes
    return np.where(same, 0.0, by_part @ same)


def _wrong(
    builder: SceneBuilder,
    whole: Any,
    names: list[str],
    centres: Floats,
    looked: Looked,
    pairs: NDArray[np.int64],
    held: NDArray[np.bool_],
) -> Floats:
    """(P,): share of what the first object of each pair mirrors that is hidden from the second's centre.

    Neither of the two occludes unless `held` (N,), and hits on them do not count.
    """
    if not len(pairs):
        return np.zeros(0)
    one, other = np.repeat(pairs, POINTS, axis=0).T
    hits, met = looked.hits[pairs[:, 0]].reshape(-1, 3), looked.met[pairs[:, 0]].ravel()
    offset = centres[other] - hits
    distance = np.linalg.norm(offset, axis=1)
    w = offset / np.maximum(distance, 1e-9)[:, None]
    start = SHORT * (1 + distance)
    t, between = _FirstHits(builder, whole, names)(rays_from(hits + w * start[:, None], w))
    left_out = ((between == one) | (between == other)) & ~held[between]
    blocked = (t < distance - 2 * start) & ~left_out
    blocked &= (met != one) & (met != other)
    valid = looked.valid[pairs[:, 0]]
    return np.asarray((blocked.reshape(-1, POINTS) & valid).sum(axis=1) / np.maximum(valid.sum(axis=1), 1))


def _grouped(
    worth: NDArray[np.int64], pairs: NDArray[np.int64], wrong: Floats, lost: Floats, bare: Floats, limits: Floats
) -> NDArray[np.int64]:
    """(N,) owner of each object's probe. `lost`, `bare` (N, N) and `limits` (N,) are by object, `wrong` by pair."""
    owner = np.arange(len(limits))
    served: dict[int, list[tuple[float, int]]] = {int(i): [] for i in worth}
    for (one, other), share in zip(pairs, wrong, strict=True):
        if share <= limits[one]:
            served[int(other)].append((float(share), int(one)))
    left, groups = set(served), dict[int, list[int]]()

    def group(i: int) -> list[int]:
        members, shares = [i], [0.0]
        for share, j in sorted(served[i]):
            if j not in left:
                continue
            tried = np.array([*members, j])
            totals = np.array([*shares, share]) + lost[np.ix_(tried, tried)].sum(axis=1)
            if (totals <= limits[tried]).all() and (bare[np.ix_(tried, tried)].sum(axis=1) <= OPEN).all():
                members, shares = [*members, j], [*shares, share]
        return members

    while left:
        groups = {i: groups.get(i) or group(i) for i in sorted(left)}
        best = max(groups.values(), key=len)
        owner[best] = best[0]
        left -= set(best)
        groups = {i: members for i, members in groups.items() if not set(members) & set(best)}
    return owner
