"""Interreflections of a view in a store (store.contract), in memory: by material and term, tiles in one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Indices
from lambent.core.camera import Camera
from lambent.core.errors import UserError
from lambent.editing.session import Session
from lambent.materials.factored.terms import Editable
from lambent.store.contract import view_artefact_name
from lambent.store.source import environment_note
from lambent.store.store import Store
from lambent.store.tails import Tails


@dataclass(frozen=True)
class TermLight:
    """Light of one term of a material by bands and tails; of a material that is not edited, all its light.

    Attributes
    ----------
    ends : (P + 1,) int64
        Entries of point p are ends[p] to ends[p + 1].
    codes : (N,) uint32
        Tail times the number of bands, plus band.
    values : (N,) uint32
        RGB9E5 (`core.shared_exponent`), times `units` of the point.
    units : (P,) float32
        W/(sr m^2).
    counts : tuple of int
        Bands of each of the term's curves; empty where it has none.
    """

    ends: NDArray[np.int64]
    codes: NDArray[np.uint32]
    values: NDArray[np.uint32]
    units: NDArray[np.float32]
    counts: tuple[int, ...]

    @property
    def bands(self) -> int:
        return int(np.prod(self.counts, dtype=int))


@dataclass(frozen=True)
class PartLight:
    """The pixels that show one material, and the light of its terms; `edited` is False for one that is not edited."""

    start: Editable
    pixel: Indices
    theta_o: NDArray[np.float32]
    terms: tuple[TermLight, ...]
    edited: bool


@dataclass(frozen=True)
class Interreflections:
    """All of a view: its tails, and the parts by material. `samples` is the least that a tile has."""

    size: tuple[int, int]
    tails: Tails
    parts: Mapping[str, PartLight]
    samples: int


def samples_of(store: Store, session: Session) -> int:
    """Paths per pixel that the store has of a session's view, under its light; 0 where there are none."""
    view = session.document
    names = [view_artefact_name(view.camera, *view.size, "interreflection", part) for part in ("tails", "")]
    if names[0] not in store or store.artefact(names[0]).meta["environment"] != environment_note(session.environment):
        return 0
    tiles = [a.meta.get("samples", 0) for a in store.artefacts("interreflection") if a.name.startswith(names[1])]
    return max(tiles, default=0)


def series_of(store: Store, session: Session) -> tuple[int, ...]:
    """Of the interreflections that a store has of a session's view."""
    view = session.document
    return tuple(store.artefact(view_artefact_name(view.camera, *view.size, "interreflection", "tails")).meta["series"])


def interreflections(
    store: Store, camera: Camera, size: tuple[int, int], materials: Mapping[str, Editable]
) -> Interreflections:
    """Read them, as far as they are there: tiles that are missing are black.

    Parameters
    ----------
    materials
        Of the scene, as they were when the store was baked.

    Raises
    ------
    UserError
        The store has none of this view, or those of other terms than the materials have.
    """

    def name(kind: str, part: str) -> str:
        return view_artefact_name(camera, *size, kind, part)

    if name("interreflection", "tails") not in store:
        raise UserError(
            f"no interreflections of camera {camera.name}, {size[0]} x {size[1]}", file=store.folder,
            hint="bake them: `lambent bake SCENE -o STORE --only interreflection`",
        )  # fmt: skip
    tails = Tails.of(store.artefact(name("interreflection", "tails")).meta["tails"])
    pixel, number, theta_o = (store.read(name("view_points", part)) for part in ("pixel", "object", "theta_o"))
    worn = np.array([material for _, material in store.artefact(name("view_points", "object")).meta["objects"]])[number]
    edited = {material for material, _ in tails.slots}
    parts, samples = {}, []
    for material, start in materials.items():
        mine = worn == material
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
    """The tiles of a term of so many curves one after another, and the samples of the one that has the fewest."""
    counts, codes, values = np.zeros(points, np.int64), [], []
    units, done = np.ones(points, np.float32), 0
    curves = (1,) * factors  # as long as no tile is there
    samples: list[int] = []
    while done < points:
        tile = f"{name}/{len(samples)}"
        if tile not in store:
            samples.append(0)
            break
        meta, array = store.artefact(tile).meta, store.read(tile)
        many = int(meta["points"])
        rest = array[many:]
        counts[done : done + many], units[done : done + many] = array[:many], meta["unit"]
        codes.append(rest[: len(rest) // 2])
        values.append(rest[len(rest) // 2 :])
        samples.append(int(meta["samples"]))
        curves, done = tuple(count for _, count in meta["curves"]), done + many
    ends = np.concatenate([[0], np.cumsum(counts)])
    empty = [np.zeros(0, np.uint32)]
    light = TermLight(ends, np.concatenate(codes or empty), np.concatenate(values or empty), units, curves)
    return light, min(samples, default=0)


def _check(store: Store, tile: str, material: str, fixed: str) -> None:
    if tile in store and store.artefact(tile).meta["fixed"] != fixed:
        raise UserError(
            "interreflections are of other terms than the material has", file=store.folder, field=material,
            hint="bake the view for editing again",
        )  # fmt: skip
