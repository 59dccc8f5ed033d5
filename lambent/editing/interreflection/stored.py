"""Load the interreflections of a view from a store (store.contract): by material and term, tiles concatenated."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import count, takewhile

import numpy as np
from numpy.typing import NDArray

from lambent.baked.transport.tails import Tails
from lambent.core.arrays import Indices
from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.editing.interreflection.entries import Entries, TermLight
from lambent.editing.session.session import Session
from lambent.materials.factored.terms import Editable
from lambent.store.contract import view_artefact_name
from lambent.store.source import environment_note
from lambent.store.store import Store


@dataclass(frozen=True)
class PartLight:
    """The pixels that show one material, and the light of its terms; `edited` is False for an uneditable one."""

    start: Editable
    pixel: Indices
    theta_o: NDArray[np.float32]
    terms: tuple[TermLight, ...]
    edited: bool


@dataclass(frozen=True)
class Interreflections:
    """The interreflections of a view: its tails, and its parts by material. `samples` is the fewest of any tile."""

    size: tuple[int, int]
    tails: Tails
    parts: Mapping[str, PartLight]
    samples: int


def samples_of(store: Store, session: Session) -> int:
    """Paths per pixel that the store has for a session's view under its light; 0 if it has none."""
    view = session.document
    names = [view_artefact_name(view.camera, *view.size, "interreflection", part) for part in ("tails", "")]
    if names[0] not in store or store.artefact(names[0]).meta["environment"] != environment_note(session.environment):
        return 0
    tiles = [a.meta.get("samples", 0) for a in store.artefacts("interreflection") if a.name.startswith(names[1])]
    return max(tiles, default=0)


def series_of(store: Store, session: Session) -> tuple[int, ...]:
    """Series of the interreflections that the store has for a session's view."""
    view = session.document
    return tuple(store.artefact(view_artefact_name(view.camera, *view.size, "interreflection", "tails")).meta["series"])


def interreflections(
    store: Store, camera: Camera, size: tuple[int, int], materials: Mapping[str, Editable]
) -> Interreflections:
    """Read the interreflections as far as they are stored; missing tiles are black.

    Parameters
    ----------
    materials
        Of the scene, as at the bake.

    Raises
    ------
    UserError
        If the store has none of this view, or its terms are not those of the materials.
    """

    def name(kind: str, part: str) -> str:
        return view_artefact_name(camera, *size, kind, part)

    if name("interreflection", "tails") not in store:
        raise UserError(
            f"no interreflections for camera {camera.name}, {size[0]} x {size[1]}", file=store.folder,
            hint="bake them: `lambent bake SCENE -o STORE --only interreflection`",
        )  # fmt: skip
    known_tails = store.artefact(name("interreflection", "tails"))
    if known_tails.meta.get("points", (now := store.artefact(name("view_points", "pixel")).key)) != now:
        raise UserError(
            "interreflections were baked for other materials", file=store.folder,
            hint="bake them again: `lambent bake SCENE -o STORE --only interreflection`",
        )  # fmt: skip
    tails = Tails.of(known_tails.meta["tails"])
    pixel, number, theta_o = (store.read(name("view_points", part)) for part in ("pixel", "object", "theta_o"))
    objects = store.artefact(name("view_points", "object")).meta["objects"]
    owner = np.array([material for _, material in objects])[number]
    edited = {material for material, _ in tails.slots}
    parts, samples = {}, []
    for material, start in materials.items():
        mine = owner == material
        if not mine.any():
            continue
        is_edited = material in edited
        terms = []
        for k in range(len(start.terms) if is_edited else 1):
            factors = len(start.terms[k].factors) if is_edited else 0
            found, least = _term(
                store, name("interreflection", f"{material}/{k}"), int(np.count_nonzero(mine)), factors
            )
            terms.append(found)
            samples.append(least)
            if is_edited:
                _check(store, name("interreflection", f"{material}/{k}/0"), material, start.terms[k].fixed)
        parts[material] = PartLight(start, pixel[mine].astype(np.int64), theta_o[mine], tuple(terms), is_edited)
    return Interreflections(size, tails, parts, min(samples, default=0))


def _term(store: Store, name: str, points: int, factors: int) -> tuple[TermLight, int]:
    """The tiles of a term with `factors` curves, concatenated, and the fewest samples of any tile."""
    names = list(takewhile(lambda tile: tile in store, (f"{name}/{k}" for k in count())))
    said = [store.artefact(tile).meta for tile in names]
    many = [int(one["points"]) for one in said]
    samples, units = [int(one["samples"]) for one in said], np.repeat([one["unit"] for one in said], many)
    missing = points - sum(many)
    curves = tuple(bands for _, bands in said[0]["curves"]) if said else (1,) * factors

    def tiles() -> Iterator[Entries]:
        for tile, here in zip(names, many, strict=True):
            array = store.read(tile)
            codes, values = np.split(array[here:], 2)
            yield array[:here], codes, values
        if missing:
            yield np.zeros(missing, np.uint32), np.zeros(0, np.uint32), np.zeros(0, np.uint32)

    units = np.concatenate([units, np.ones(missing)]).astype(np.float32)
    return TermLight.of_tiles(tiles(), units, curves), min(samples if not missing else [0])


def _check(store: Store, tile: str, material: str, fixed: str) -> None:
    if tile in store and store.artefact(tile).meta["fixed"] != fixed:
        raise UserError(
            "interreflections were baked for other terms of the material", file=store.folder, field=material,
            hint="bake the view for editing again",
        )  # fmt: skip
