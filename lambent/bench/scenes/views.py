"""Stores whose first view is measured: the given ones, or one of a scene baked for the bench."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from lambent.core.errors import UserError
from lambent.core.progress import Progress
from lambent.core.views.camera import Camera
from lambent.store.contract import SceneRecord
from lambent.store.store import Store


@contextmanager
def inputs_or_baked(inputs: Sequence[Path], scene: str, progress: Progress) -> Iterator[list[Store]]:
    """The inputs, which are baked stores; without inputs, a scene baked here in `preview`."""
    from lambent.baking.bake import bake
    from lambent.scenes.loaders.load import load_scene

    with tempfile.TemporaryDirectory() as folder:
        stores = [Store.open(path) for path in inputs]
        yield stores or [bake(load_scene(scene), Path(folder) / "store", progress=progress)]


def first_camera(store: Store, record: SceneRecord) -> Camera:
    """The camera of the measured view; `UserError` if a store has none."""
    if not record.cameras:
        raise UserError("store has no camera", file=store.folder, expected="a camera whose view is compared")
    return record.cameras[0]
