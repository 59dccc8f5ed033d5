"""Stills of a view whose materials a session edits."""

from __future__ import annotations

import shlex
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.baking.artefacts.visibility import SETTINGS
from lambent.core.arrays import Image
from lambent.core.errors import UserError
from lambent.core.pictures.images import WRITABLE, check_writable
from lambent.core.progress import Progress, silent
from lambent.core.views.camera import Camera
from lambent.editing.interreflection.whole import ALL_HITS, WholePicture, whole_picture
from lambent.editing.session.session import Session
from lambent.editing.stored import NotBaked
from lambent.render.images import Images, Settings
from lambent.render.output import DEFAULT, Rendered, displayed_as, exposed, write_still
from lambent.store.contract import transport_lights
from lambent.store.source import SOURCE
from lambent.store.store import Store

EDITED = "edited"  # stands for the integrator in `Rendered`


class Edited(Images):
    """Images of an edited picture, through the camera of its session only."""

    def __init__(self, picture: WholePicture, settings: Settings) -> None:
        super().__init__(settings)
        self._picture = picture

    def radiance(self, camera: Camera, progress: Progress = silent) -> Image:
        return np.maximum(self._picture.image(), 0)  # wavelets in half floats round below 0 in dark pixels


def edited_still(
    store: Store | Path | str,
    session: Path,
    file: Path | str,
    settings: Settings = DEFAULT,
    surfaces: tuple[int, int] = ALL_HITS,
) -> Rendered:
    """Draw the view of a session with its edits into a file; parameters as of `edited_view` and `output.still`."""
    began, file = time.perf_counter(), Path(file)
    check_writable(file, WRITABLE)
    drawn, camera = edited_view(store, session, settings, surfaces)
    write_still(drawn, file, camera)
    width, height = drawn.settings.width, drawn.settings.height
    return Rendered(file, width, height, EDITED, 1, time.perf_counter() - began, **displayed_as(file, drawn))


def edited_view(
    store: Store | Path | str, session: Path, settings: Settings = DEFAULT, surfaces: tuple[int, int] = ALL_HITS
) -> tuple[Edited, Camera]:
    """Images of a session's view with its edits, from the transport and interreflections of a store; and its camera.

    Parameters
    ----------
    session : path
        A session's file; its camera and size replace those of `settings`.
    settings
        Exposure, view transform and false colours.
    surfaces
        Least and most surfaces on the shown light paths.

    Raises
    ------
    UserError
        If the session or the store cannot be used, or the store lacks the transport; the hint is then the command that
        bakes it.
    """
    opened = store if isinstance(store, Store) else Store.open(Path(store))
    wanted = Session.open(Path(session))
    width, height = wanted.document.size
    settings = exposed(replace(settings, width=width, height=height), opened)
    try:
        picture = whole_picture(opened, wanted, hits=surfaces)
    except NotBaked as error:
        raise UserError(
            error.message, file=error.file, field=error.field, got=error.got, expected=error.expected,
            hint=f"run `{_bake_command(opened, wanted, Path(session))}`",
        ) from error  # fmt: skip
    return Edited(picture, settings), wanted.document.camera


def _bake_command(store: Store, wanted: Session, session: Path) -> str:
    """The command that bakes a session's transport, with as many lights as the store has for the view."""
    place = store.documents.get(SOURCE)
    scene = "SCENE" if not isinstance(place, str) else place if place.startswith("builtin:") else store.folder / place
    view = wanted.document
    most = max(transport_lights(store, view.camera, *view.size), default=0)
    better = [name for name, how in SETTINGS.items() if how.lights[-1] == most]
    quality = f" --quality {better[-1]}" if better else ""
    options = f"-o {shlex.quote(str(store.folder))} --only transport --edit {shlex.quote(str(session))}"
    return f"lambent bake {scene if scene == 'SCENE' else shlex.quote(str(scene))} {options}{quality}"
