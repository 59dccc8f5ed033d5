"""`lambent export --as html`: stills of a store as a page that any browser shows, from any host or from the disk."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.files import write_bytes
from lambent.core.light.exposure import ev100_of
from lambent.core.plain import printable
from lambent.core.progress import Progress, part_of, silent
from lambent.render.images import Settings
from lambent.render.output import ignore, images, opened_with_views
from lambent.render.sheet import BY_LIGHT, Exposures
from lambent.site.chunks import PICTURE_QUALITY, TALLEST_PX
from lambent.site.export import BAKED, Note, states_of
from lambent.site.replacing import check_folder, replacing
from lambent.store.store import Store

FORMAT, VERSION = "lambent-stills", 1
SIZE = 1280, 720
PICTURES = "pictures"  # folder of the stills
THUMBNAIL_PX = 240  # longer side


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
    with replacing(folder, FORMAT, (PICTURES,)) as page:
        exposures = [Exposures(BY_LIGHT, drawn.exposure_ev) for _ in cameras]
        stills: list[list[Still]] = [[] for _ in cameras]
        thumbnails: list[str] = []
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
                if row == 0:
                    thumbnails.append(_written(picture, folder, f"{column + 1}", THUMBNAIL_PX))
                file = _written(picture, folder, f"{column + 1}-{row + 1}")
                ev100 = ev100_of(drawn.exposure_ev or 0.0)
                stills[column].append(Still(file, camera.name, state.name or BAKED, ev100))
        page.named.update(thumbnails, (one.file for row in stills for one in row))
        page.add("manifest.json", json.dumps({"format": FORMAT, "version": VERSION}, separators=(",", ":")).encode())
        page.add("index.html", _page(record.name, _links(stills, thumbnails), _sections(stills, settings)))
        page.add_page("stills_page", (".js", ".css"))
    written = [*(folder / PICTURES).iterdir()]
    return {
        "written": folder, "bytes": sum(file.stat().st_size for file in written), "files": len(written),
        "views": len(cameras), "states": len(states),
    }  # fmt: skip


def _written(picture: NDArray[np.uint8], folder: Path, name: str, most_px: int | None = None) -> str:
    """The file of a picture, of at most so many pixels a side, relative to the page; named by its content, too."""
    from PIL import Image

    image, made = Image.fromarray(picture), io.BytesIO()
    if most_px is not None:
        image.thumbnail((most_px, most_px))
    image.save(made, "webp", quality=PICTURE_QUALITY)
    file = f"{PICTURES}/{name}-{hashlib.sha256(made.getvalue()).hexdigest()[:20]}.webp"
    write_bytes(folder / file, made.getvalue())
    return file


def _links(stills: Sequence[Sequence[Still]], thumbnails: Sequence[str]) -> str:
    """A thumbnail of each view, which leads to it."""
    return "".join(
        f'<a href="#view-{view + 1}"><img src="{file}" alt="" />{_said(row[0].view)}</a>'
        for view, (row, file) in enumerate(zip(stills, thumbnails, strict=True))
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


def _page(name: str, links: str, sections: str) -> bytes:
    """`name` as a file has it; the others as HTML."""
    template = Template(files("lambent.site").joinpath("stills_page/index.html").read_text("utf-8"))
    return template.substitute(name=_said(name), links=links, sections=sections).encode()
