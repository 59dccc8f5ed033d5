"""Rows of light fields: their bake, and frames that march through their maps, beside those of one probe."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from lambent.bench.card_rows.effort import Effort
from lambent.bench.card_rows.frames import AT, of_store
from lambent.bench.card_rows.row import Figure, Published, Row, engine_name
from lambent.scenes.loaders.load import load_scene
from lambent.store.contract import LAST_RUN

KIND = "light_field"


def measure(effort: Effort, work: Path) -> Iterator[Figure]:
    from lambent.baking.bake import bake

    device = engine_name()
    with TemporaryDirectory(dir=work) as folder:
        store = bake(
            load_scene(effort.field_scene), Path(folder) / "store", quality=effort.quality,
            only={KIND, "environment"}, light_fields=effort.field_object,
        )  # fmt: skip
        yield Figure("bake", store.documents[LAST_RUN][KIND], "s", device)
        yield from of_store(store, effort, KIND, ", light field")
        yield from of_store(store, effort, "plain", ", one probe")


SHADER = {f"{AT}, light field": Published(".013", "thesis R, software shader, one core")}
ROWS = {"light fields": Row(measure, 80, 9, SHADER)}
