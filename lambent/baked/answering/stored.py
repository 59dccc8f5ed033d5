"""The arrays from which a store recomputes its indirect light after edits of materials, by `baked.answering.answer`.

answer/patch               (2, H, W) uint16, patch of each texel of the light map on the normal's side and on the other;
                           NO_PATCH without a patch. meta["materials"]: names, in order
answer/patch_material      (P,) uint16, material number of each patch
answer/patch_paired        (P,) uint16, the patch on the other side; its own number where no light crosses
answer/patch_direct        (G, P, 3) float32, direct irradiance with the sun's, W/m^2, by light group
answer/direct, direct_back (G, H, W, 3) float16, direct irradiance of texels without the sun's, at most that of the
                           light map; light that arrives through lobes alone counts as direct. Absent if the light map
                           holds it as light_map/direct, direct_back; meta["direct"] of answer/patch names the arrays
answer/transfer            (P, P) float16, share of each patch's light that reaches each other; rows receive
answer/rays                (3, K, R) uint8, `baked.answering.rays.packed_rays` of the points that send and gather light
answer/receiver_rays       (3, F, S) uint8, likewise of points near contacts, which gather and do not send
answer/points              (K + F,) numbers, texel and side of each, coded as answer/texels; the F come last
answer/point_sun           (K + F, 3) float32, direct irradiance of the sun at the points, W/m^2
answer/point_direct        (G, K, 3) float32, W/m^2, direct irradiance by light group with the sun's, averaged over the
                           texels that a point stands for
answer/point_light         (G, K, 3) float32, likewise all irradiance as baked
answer/point_other         (K,) numbers, the point on the other side of the surface; its own where no light crosses
answer/texels              (T,) numbers, texels with an answer: 2 (row * W + column), plus 1 on the other side
answer/near                (T, 8) numbers, points near each texel
answer/shares              (T, 8) uint8, weights of these points
answer/probe/OBJECT/spots  (6, N, N) numbers, texel seen by each texel of a probe, coded as above; NO_SPOT for none
answer/probe/OBJECT/tint   (6, N, N, 3) float16, texture at that texel, relative to the material's colour
answer/probe/OBJECT/sun    (6, N, N) float16, direct sun there over its normal irradiance; negative on the far side
answer/traced, traced_back (2, H, W, 4) float32, samples of direct light, with which a bake continues; if light is
                           separated, also by group: traced_by_group, traced_back_by_group (1, H, W, 6 G)

Numbers are `baked.answering.delta_bytes` (4, ...) uint8. G is the number of light groups, in the order of
`store.light_groups`; 1 if all light was baked together.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lambent.baked.answering.albedos import albedos_of
from lambent.baked.answering.answer import Answer, Neighbours, Patches, Points
from lambent.baked.answering.delta_bytes import PLACES, from_delta_bytes
from lambent.baked.answering.rays import Rays, last_points
from lambent.baked.answering.smoothing import alike
from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.plain import as_folder
from lambent.scenes.light_groups import SUN
from lambent.store.contract import SIDES, SceneRecord, scene_record, sun_left_out
from lambent.store.light_groups import group_name, light_groups
from lambent.store.store import Store

NO_PATCH = 0xFFFF
NO_SPOT = 0xFFFFFFFF
DIRECT = ("direct", "direct_back")  # by side
NO_ANSWER = "the store has no answer data (`lambent bake --only answer`)"
LAST = "answer/shares"  # written last, except for probes


def answer_name(part: str) -> str:
    """Name of an array of the answer."""
    return f"answer/{part}"


def probe_spots_name(object_name: str, part: str) -> str:
    """Name of an array of a probe's visible texels."""
    return f"answer/probe/{as_folder(object_name)}/{part}"


def has_answer(store: Store) -> bool:
    """Whether a store can recompute its light for edited materials, by group if its light is separated."""
    needed = (
        "patch",
        "transfer",
        "rays",
        "receiver_rays",
        "points",
        "point_other",
        "point_sun",
        "point_direct",
        "point_light",
        "near",
        "texels",
        "patch_direct",
    )
    if LAST not in store or not all(answer_name(part) in store for part in needed):
        return False
    if store.artefact(answer_name("near")).shape[0] != PLACES or not all(one in store for one in _directs(store)):
        return False  # baked by an earlier version
    return store.artefact(answer_name("patch_direct")).shape[0] == max(1, len(light_groups(store)))


def _directs(store: Store) -> list[str]:
    """Names of the arrays of direct light, one per side."""
    return list(map(str, store.artefact(answer_name("patch")).meta.get("direct", ())))


@dataclass(frozen=True, eq=False)
class SeenSpots:
    """What one probe sees: answer texel (6, N, N), -1 for none; tint (6, N, N, 3); sun (6, N, N)."""

    texel: NDArray[np.int64]
    tint: NDArray[np.float16]
    sun: NDArray[np.float16]


@dataclass(frozen=True, eq=False)
class StoredAnswer:
    """The answer of a store, decoded.

    Attributes
    ----------
    texels : (T,) uint32, 2 x the texel of the light map, plus 1 on the other side
    other : (T,) index of the same texel on the other side, -1 if absent
    material : (T,) material number of each
    materials : names, by number
    seen : what each probe sees, by object
    sun : (3,) normal irradiance of the sun, W/m^2
    of_sun : number of the sun's light group
    point_sun : (K + F, 3) direct irradiance of the sun at the points, W/m^2
    patch : (T,) patch of each texel
    """

    answer: Answer
    texels: NDArray[np.uint32]
    other: NDArray[np.int64]
    material: NDArray[np.int64]
    materials: tuple[str, ...]
    seen: dict[str, SeenSpots]
    sun: Floats
    of_sun: int = 0
    point_sun: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 3), np.float32))
    patch: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))


def read_answer(store: Store) -> StoredAnswer:
    """Read the answer of a store.

    Raises
    ------
    UserError
        If the store has none, or its arrays contradict one another.
    """
    if not has_answer(store):
        hint = "run `lambent bake --only answer` for its scene"
        raise UserError("store has no answer data for changed materials", file=store.folder, field="answer", hint=hint)
    record = scene_record(store)
    parts = (
        "patch_material", "patch_paired", "patch_direct", "transfer", "rays", "receiver_rays", "points", "point_sun",
        "point_direct", "point_light", "point_other", "texels", "near", "shares", "patch",
    )  # fmt: skip
    material, paired, direct, transfer, rays, more_rays, points, point_sun, *rest = map(
        store.read, map(answer_name, parts)
    )
    point_direct, point_light, across, texels, near, shares, patch = rest
    names = tuple(map(str, store.artefact(answer_name("patch")).meta.get("materials", ())))
    count, height, width = len(material), *patch.shape[1:]
    points, across, texels, near = map(from_delta_bytes, (points, across, texels, near))
    rays, more_rays = np.moveaxis(rays, 0, -1), np.moveaxis(more_rays, 0, -1)
    senders = len(rays)
    fits = (
        set(names) <= set(record.materials)
        and (not count or int(material.max()) < len(names))
        and paired.shape == material.shape
        and (not count or int(paired.max()) < count)
        and direct.shape[1:] == (count, 3)
        and transfer.shape == (count, count)
        and rays.shape[2] == more_rays.shape[2] == 3
        and near.shape == shares.shape
        and near.shape[0] == len(texels)
        and (not near.size or int(near.max()) < len(points))
        and (not shares.size or bool((shares.sum(axis=1) > 0).all()))
        and (not len(texels) or int(texels.max()) < 2 * height * width)
        and len(points) == senders + len(more_rays)
        and across.shape == (senders,)
        and (not senders or int(across.max()) < senders)
        and point_sun.shape == (len(points), 3)
        and point_direct.shape == point_light.shape == (len(direct), senders, 3)
        and bool(np.isin(points, texels).all())
        and all(not one.size or int(last_points(one).max()) < max(senders, 1) for one in (rays, more_rays))
    )
    if not fits:
        raise store.broken("answer", "its arrays do not match")
    sorted_light = bool(light_groups(store))
    maps = [group_name(side) if sorted_light else f"light_map/{side}" for side in SIDES]
    lights = maps, _directs(store)
    baked, directs = (_at_texels(store, of_sides, texels) for of_sides in lights)
    groups = baked.shape[0]
    if not directs.shape[0] == direct.shape[0] == groups:
        got, hint = (
            f"{directs.shape[0]} and {direct.shape[0]} light groups",
            "bake it with `lambent bake --only answer`",
        )
        raise UserError("does not fit the light map", file=store.folder, field="answer", got=got, expected=groups,
                        hint=hint)  # fmt: skip
    patches = Patches(material.astype(np.int64), paired.astype(np.int64), direct, transfer.astype(np.float32))
    albedos = albedos_of([record.materials[name] for name in names])
    number = _numbers(texels, height * width)
    flat = patch.reshape(2, -1)
    of_patch = np.where(flat == NO_PATCH, 0, flat)[texels % 2, texels // 2].astype(np.int64)
    other = number[(texels ^ 1).astype(np.int64)]
    sun = sun_left_out(store)
    of_sun = next((n for n, group in enumerate(light_groups(store)) if SUN in group.members), 0)
    directs, at = np.minimum(directs, baked), number[points[:senders]]
    nearest = Neighbours(near, shares)
    sending = Points(
        of_patch[at], material.astype(np.int64)[of_patch[at]], across.astype(np.int64),
        np.minimum(point_direct, point_light), point_light,
    )  # fmt: skip
    all_rays = Rays.of(rays).followed_by(Rays.of(more_rays))
    around = alike(sending, all_rays, albedos.reflected, nearest[number[points]])
    answer = Answer(patches, sending, all_rays, around, nearest, directs, baked, albedos)
    return StoredAnswer(
        answer, texels, other, material[of_patch].astype(np.int64), names, _seen(store, record, number),
        np.zeros(3) if sun is None else np.array(sun.irradiance), of_sun, point_sun, of_patch,
    )  # fmt: skip


def _at_texels(store: Store, names: list[str], texels: NDArray[np.uint32]) -> NDArray[np.float32]:
    """(G, T, 3) of maps of both sides (G, H, W, 3), or (H, W, 3); black for a side without a map."""
    found: NDArray[np.float32] | None = None
    for side, name in enumerate(names):
        if name not in store:
            continue
        values = store.read(name)
        values = values[None] if values.ndim == 3 else values
        flat = values.reshape(len(values), -1, 3)
        if found is None:
            found = np.zeros((len(values), len(texels), 3), np.float32)
        mine = np.flatnonzero(texels % 2 == side)
        found[:, mine] = flat[:, texels[mine] // 2]
    return np.zeros((1, len(texels), 3), np.float32) if found is None else found


def _numbers(texels: NDArray[np.uint32], size: int) -> NDArray[np.int64]:
    """(2 size,) index of each spot among the answer's texels, -1 for others."""
    number = np.full(2 * size, -1)
    number[texels] = np.arange(len(texels))
    return number


def _seen(store: Store, record: SceneRecord, number: NDArray[np.int64]) -> dict[str, SeenSpots]:
    found = {}
    for o in record.objects:
        name = probe_spots_name(o.name, "spots")
        if name not in store:
            continue
        spots = from_delta_bytes(store.read(name))
        there = spots < len(number)
        tint, sun = (store.read(probe_spots_name(o.name, part)) for part in ("tint", "sun"))
        found[o.name] = SeenSpots(np.where(there, number[np.where(there, spots, 0)], -1), tint, sun)
    return found
