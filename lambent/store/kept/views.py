"""Cameras and recorded camera paths that users save while viewing a store: `views.json` in its folder.

Bakes never touch the file, and it needs no bake's lock. Each change reads the file again and replaces it whole, so two
windows on one store do not lose each other's views.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import count, pairwise
from pathlib import Path
from typing import Literal

from pydantic import Field, ValidationError

from lambent.core.ceilings import VIEWS_BYTES
from lambent.core.errors import UserError
from lambent.core.files import write_text
from lambent.core.inputs import parse_json, read_bytes
from lambent.core.light.light_mix import LightMix, MixTrack
from lambent.core.strict import Strict
from lambent.core.views.camera import Camera, CameraPath
from lambent.store.consistency import is_usable
from lambent.store.contract import SceneRecord
from lambent.store.lock import lock

FILE = "views.json"
LONGEST_NAME = 80


class Views(Strict):
    """Content of a `views.json`."""

    format: Literal["lambent-views"] = "lambent-views"
    version: Literal[1] = 1
    cameras: tuple[Camera, ...] = ()
    paths: tuple[CameraPath, ...] = ()
    lights: dict[str, LightMix] = Field(default={}, exclude_if=lambda one: not one)  # mix of light groups, by camera
    tracks: dict[str, MixTrack] = Field(default={}, exclude_if=lambda one: not one)  # the same over time, by path


def read_views(folder: Path) -> Views:
    """The saved views of the store in `folder`; empty if there is no file yet.

    Raises
    ------
    UserError
        If the file is damaged, of another version, or holds unusable cameras.
    """
    path = Path(folder) / FILE
    if not path.exists():
        return Views()
    said = parse_json(read_bytes(path, VIEWS_BYTES), path)
    try:
        views = Views.model_validate(said)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise UserError(f"saved views cannot be used ({first['msg']})", file=path, field=where or None) from error
    except UserError as error:  # an invalid mix
        raise UserError(f"saved views cannot be used ({error.message})", file=path, field=error.field) from error
    _check(views, path)
    return views


def change_views(folder: Path, change: Callable[[Views], Views]) -> Views:
    """Read the views, apply `change`, and replace the file; returns the new views.

    Raises
    ------
    UserError
        If the file cannot be read or written; it is then unchanged.
    """
    with _alone(Path(folder)):
        views = change(read_views(folder))
        write_text(Path(folder) / FILE, json.dumps(views.model_dump(mode="json"), indent=1) + "\n")
    return views


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Exclude others who change this folder's views, so that no addition is overwritten unread.

    Locks the folder itself, because a lock file would stay behind; does nothing on Windows, which cannot.
    """
    if sys.platform == "win32":
        yield
        return
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise UserError(f"cannot be opened ({error.strerror})", file=folder) from error
    try:
        lock(handle, wait=True)
        yield
    finally:
        os.close(handle)  # releases the lock


def with_views(record: SceneRecord, views: Views) -> SceneRecord:
    """The scene record with saved views after its own; a scene's name hides a saved view of the same name."""
    cameras = {c.name for c in record.cameras}
    paths = {p.name for p in record.paths}
    return record.model_copy(
        update={
            "cameras": (*record.cameras, *(c for c in views.cameras if c.name not in cameras)),
            "paths": (*record.paths, *(p for p in views.paths if p.name not in paths)),
        }
    )


def checked_name(text: str, taken: set[str]) -> str:
    """The typed name without surrounding blanks; `UserError` if it is invalid or taken."""
    name = text.strip()
    if not name:
        raise UserError("name is empty", expected="a name, as in entrance")
    if len(name) > LONGEST_NAME or not name.isprintable():
        raise UserError(
            "name cannot be used", got=name, expected=f"at most {LONGEST_NAME} characters that can be shown"
        )
    if name in taken:
        raise UserError("name is already used", got=name)
    return name


def free_name(stem: str, taken: set[str]) -> str:
    """`stem` with the first free number."""
    return next(name for number in count(1) if (name := f"{stem} {number}") not in taken)


def _check(views: Views, path: Path) -> None:
    for kind, cameras in (("cameras", views.cameras), *((f"paths.{p.name}", p.keys) for p in views.paths)):
        for camera in cameras:
            if not is_usable(camera):
                raise UserError(
                    "a camera is beyond 1e9 m or has an impossible field of view",
                    file=path,
                    field=f"{kind}.{camera.name}",
                )
    for walk in views.paths:
        times = walk.times_s or ()
        if not walk.keys or len(times) != len(walk.keys):
            raise UserError("a path needs one time for each key", file=path, field=walk.name, got=len(times))
        if times[0] != 0 or times[-1] != walk.seconds or any(b <= a for a, b in pairwise(times)):
            raise UserError(
                "times of a path must start at 0, increase, and end at its duration", file=path, field=walk.name
            )
