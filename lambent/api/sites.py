"""Stores as web sites."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lambent.api.progress import Wanted, progress_of
from lambent.api.stores import Note, Store
from lambent.core.extras import needing_extras


def export(
    store: Store | str | Path, folder: str | Path, *, note: Note | None = None, progress: Wanted = None
) -> dict[str, Any]:
    """Write a store as a static web site, in which a browser with WebGPU walks: any host can serve the folder.

    Parameters
    ----------
    store : Store, str or Path
        A baked scene, or its folder.
    folder : str or Path
        New, empty, or a site, which is replaced.
    note, progress
        As of `Store.render`.

    Returns
    -------
    dict
        `written`, `bytes` to be transferred, `files`, `pipelines`.

    Raises
    ------
    UserError
        If the folder holds something else, the store cannot be drawn or has no camera, or there is no adapter.
    """
    opened = store if isinstance(store, Store) else Store(store)
    with needing_extras(), progress_of(progress) as bar:
        from lambent.site.export import export as exported

        return exported(opened.arrays, Path(folder), bar, note or (lambda text: None))
