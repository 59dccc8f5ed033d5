"""Rows of bakes, and the store that other rows show."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

from lambent.bench.card_rows.effort import Effort
from lambent.bench.card_rows.row import CUDA, PROCESSOR, Figure, Published, Row, cuda_name, engine_name
from lambent.store.contract import LAST_RUN
from lambent.store.store import Store

KINDS = ("light_map", "probe")


def measure(effort: Effort, work: Path, variant: str) -> Iterator[Figure]:
    """Seconds of a whole bake and of its parts, kernels included, in a new store."""
    if variant == CUDA:
        cuda_name()
    from lambent.baking.bake import bake
    from lambent.scenes.loaders.load import load_scene

    with bake(load_scene(effort.scene), _folder(work, variant), quality=effort.quality, resume=False) as store:
        seconds = store.documents[LAST_RUN]
    device = engine_name()
    what = f"{effort.scene}, {effort.quality.name}"
    yield Figure(what, sum(seconds.values()), "s", device)
    yield from (Figure(f"{what}, {kind}", seconds[kind], "s", device) for kind in KINDS if kind in seconds)


def baked(effort: Effort, work: Path) -> Store:
    """The store of a row of bakes that has ended; without one, a bake that was stopped is continued, or begun."""
    from lambent.baking.bake import bake
    from lambent.scenes.loaders.load import load_scene

    begun = [folder for folder in (_folder(work, CUDA), _folder(work, PROCESSOR)) if folder.exists()]
    for folder in begun:
        if LAST_RUN in (store := Store.open(folder)).documents:
            return store
    return bake(load_scene(effort.scene), (begun or [_folder(work, PROCESSOR)])[0], quality=effort.quality)


def _folder(work: Path, variant: str) -> Path:
    return work / f"{variant}.store"


# The whole bake of the built-in room takes 163 CPU s on two cores (docs/performance.md).
OWN = {"builtin:room, preview": Published("163 CPU", "two cores of an EPYC")}
ROWS = {
    "bake, CUDA": Row(partial(measure, variant=CUDA), 150, 0, OWN, CUDA),
    "bake, processor": Row(partial(measure, variant=PROCESSOR), 100, 1, OWN, PROCESSOR),
}
