"""Stores as web sites."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from lambent.api.progress import Wanted, progress_of
from lambent.api.stores import Note, Store
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.extras import needing_extras


def export(
    store: Store | str | Path,
    folder: str | Path,
    *,
    as_: Literal["site", "html"] = "site",
    size: tuple[int, int] | None = None,
    views: Sequence[str] = (),
    note: Note | None = None,
    progress: Wanted = None,
) -> dict[str, Any]:
    """Write a store as a static web site, in which a browser with WebGPU walks, or as a page of stills.

    Any host can serve the folder; a page of stills opens from the disk too.

    Parameters
    ----------
    store : Store, str or Path
        A baked scene, or its folder.
    folder : str or Path
        New, empty, or an earlier export of the same kind, which is replaced.
    as_ : {"site", "html"}
        "html": a page with a traced still of every view in every state.
    size : (width, height), optional
        Of a still, pixels; by default 1280x720.
    views : sequence of str
        Stills: cameras and saved views by name; by default all.
    note, progress
        As of `Store.render`.

    Returns
    -------
    dict
        `written`, `bytes` to be transferred, `files`; `pipelines` of a site, `views` and `states` of stills.

    Raises
    ------
    UserError
        If the folder holds something else, a name is unknown, the store cannot be drawn or has no camera, or there is
        no adapter.
    """
    known("kind of export", as_, ("site", "html"), field="--as")
    for option, is_said in (("--size", size is not None), ("--view", bool(views))):
        if is_said and as_ == "site":
            raise UserError("applies to stills only", field=option, hint="add --as html")
    opened = store if isinstance(store, Store) else Store(store)
    with needing_extras(), progress_of(progress) as bar:
        if as_ == "html":
            from lambent.site.stills import export_stills

            return export_stills(opened.arrays, Path(folder), size, views, bar, note or (lambda text: None))
        from lambent.site.export import export as exported

        return exported(opened.arrays, Path(folder), bar, note or (lambda text: None))
