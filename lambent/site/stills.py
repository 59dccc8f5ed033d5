"""`lambent export --as html`: stills of a store as a page that any browser shows, from any host or from the disk."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import as_file, files
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.files import atomic_path, write_bytes, write_text
from lambent.core.light.exposure import ev100_of
from lambent.core.plain import printable
from lambent.core.progress import Progress, part_of, silent
from lambent.render.images import Settings
from lambent.render.output import ignore, images, opened_with_views
from lambent.render.sheet import BY_LIGHT, Exposures
from lambent.site.chunks import PICTURE_QUALITY, TALLEST_PX
from lambent.site.export import BAKED, Note, check_folder, mark, states_of
from lambent.store.store import Store

FORMAT, VERSION = "lambent-stills", 1
SIZE = 1280, 720
PICTURES = "pictures"  # folder of the stills
THUMBNAIL_PX = 240  # longer side
UNFINISHED = '<p role="status">These stills are unfinished: export them again.</p>'


@dataclass(frozen=True)
class Still:
    """A picture on the page: its file, relative to the page, and what it shows."""

    file: str
    view: str
    state: str
    ev100: float


def export_stills(
    store: Store,
    folder: Path,
    size: tuple[int, int] | None = None,
    views: Sequence[str] = (),
    progress: Progress = silent,
    note: Note = ignore,
) -> dict[str, Any]:
    """Write a page with a traced still of every view in every state; returns its figures: bytes, files, views, states.

    Parameters
    ----------
    store : Store
    folder : Path
        New, empty, or a page of stills that is replaced.
    size : (width, height), optional
        Of a still, pixels; by default `SIZE`.
    views : sequence of str
        Cameras and saved views by name, in their order; by default all.

    Raises
    ------
    UserError
        If the folder holds something else, a view is unknown, or the store cannot be drawn at this size.
    """
    check_folder(folder, FORMAT, "stills")
    settings = Settings(*(size or SIZE))
    if max(settings.width, settings.height) > TALLEST_PX:
        got, expected = f"{settings.width}x{settings.height}", f"at most {TALLEST_PX} pixels wide and high"
        raise UserError("is larger than a WebP picture", field="--size", got=got, expected=expected)
    record = opened_with_views(store)[1]
    if not record.cameras:
        raise UserError("has no camera", file=store.folder, hint="add [[cameras]] to its scene.toml")
    by_name = {camera.name: camera for camera in record.cameras}
    cameras = [by_name[known("view", name, by_name, field="--view")] for name in views] or [*record.cameras]
    states = [*states_of(store, note)]
    drawn = images(store, settings, note=note)
    mark(folder, FORMAT)
    _write_page(folder, record.name, "", UNFINISHED)
    shutil.rmtree(folder / PICTURES, ignore_errors=True)
    (folder / PICTURES).mkdir()
    exposures = [Exposures(BY_LIGHT, drawn.exposure_ev) for _ in cameras]
    stills: list[list[Still]] = [[] for _ in cameras]
    for row, state in enumerate(states):
        drawn.apply_variant(state)
        for column, camera in enumerate(cameras):
            done = row * len(cameras) + column
            part = part_of(
                progress, done / len(states) / len(cameras), (done + 1) / len(states) / len(cameras), "stills"
            )
            drawn.exposure_ev = exposures[column].wanted(state.light)
            picture = drawn.displayed(camera, part)
            exposures[column].take(drawn.exposure_ev)
            file = f"{PICTURES}/{column + 1}-{row + 1}.webp"
            _write(picture, folder / file)
            if row == 0:
                _write(picture, folder / _thumbnail(column), THUMBNAIL_PX)
            stills[column].append(Still(file, camera.name, state.name or BAKED, ev100_of(drawn.exposure_ev or 0.0)))
    _write_page(folder, record.name, _links(stills), _sections(stills, settings))
    mark(folder, FORMAT, VERSION)
    written = [*(folder / PICTURES).iterdir()]
    return {
        "written": folder, "bytes": sum(file.stat().st_size for file in written), "files": len(written),
        "views": len(cameras), "states": len(states),
    }  # fmt: skip


def _write(picture: NDArray[np.uint8], file: Path, most_px: int | None = None) -> None:
    from PIL import Image

    image = Image.fromarray(picture)
    if most_px is not None:
        image.thumbnail((most_px, most_px))
    with atomic_path(file) as temporary:
        image.save(temporary, "webp", quality=PICTURE_QUALITY)


def _thumbnail(view: int) -> str:
    return f"{PICTURES}/{view + 1}.webp"


def _links(stills: Sequence[Sequence[Still]]) -> str:
    """A thumbnail of each view, which leads to it."""
    return "".join(
        f'<a href="#view-{view + 1}"><img src="{_thumbnail(view)}" alt="" />{_said(row[0].view)}</a>'
        for view, row in enumerate(stills)
    )


def _sections(stills: Sequence[Sequence[Still]], settings: Settings) -> str:
    """Each view with its stills."""
    return "\n".join(
        f'<section class="view" id="view-{view + 1}"><h2>{_said(row[0].view)}</h2><div class="stills">\n'
        + "\n".join(_figure(one, settings) for one in row)
        + "\n</div></section>"
        for view, row in enumerate(stills)
    )


def _figure(still: Still, settings: Settings) -> str:
    state, view = _said(still.state), _said(still.view)
    return (
        f'<figure data-state="{state}"><img src="{still.file}" width="{settings.width}" height="{settings.height}" '
        f'alt="{view}, {state}" /><figcaption>{state}, {view}, EV100 {still.ev100:.1f}</figcaption></figure>'
    )


def _said(name: str) -> str:
    """A name from a file as HTML, in text and in quotes."""
    return escape(printable(name))


def _write_page(folder: Path, name: str, links: str, sections: str) -> None:
    """`name` as a file has it; the others as HTML."""
    with as_file(files("lambent.site").joinpath("stills_page")) as page:
        for file in page.iterdir():
            if file.suffix in (".js", ".css"):
                write_bytes(folder / file.name, file.read_bytes())
        template = Template((page / "index.html").read_text("utf-8"))
    write_text(folder / "index.html", template.substitute(name=_said(name), links=links, sections=sections))
