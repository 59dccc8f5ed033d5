"""The views and ways that people save while they look at a store, as the window keeps them; see `store.views`."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

from lambent.core.camera import Camera, CameraPath
from lambent.core.errors import UserError
from lambent.core.files import write_text
from lambent.store.contract import SceneRecord
from lambent.store.views import Views, change_views, checked_name, free_name, read_views, with_views


@dataclass
class SavedViews:
    """Saved cameras and paths of one store; every change is on disk at once, or said not to be.

    Attributes
    ----------
    scene : SceneRecord
        Whose names are taken.
    folder : Path, optional
        Of the store; without one nothing can be saved.
    say : callable
        Shows the user a line.
    """

    scene: SceneRecord
    folder: Path | None = None
    say: Callable[[str], None] = lambda text: None
    _views: Views = field(default_factory=Views)

    def load(self) -> str | None:
        """Read the file, or say, and return, why it cannot be used."""
        if self.folder is None:
            return None
        try:
            self._take(read_views(self.folder))
        except UserError as error:
            self.say(str(error))
            return str(error)
        return None

    @property
    def cameras(self) -> tuple[Camera, ...]:
        return self._views.cameras

    @property
    def paths(self) -> tuple[CameraPath, ...]:
        return self._views.paths

    @property
    def all(self) -> SceneRecord:
        """The scene record with what was saved."""
        return with_views(self.scene, self._views)

    def free_path_name(self) -> str:
        return free_name("walk", {path.name for path in self.all.paths})

    def add_camera(self, camera: Camera, name: str | None = None) -> Camera | None:
        """Save where `camera` stands as `name`, or under the next free one; None where that cannot be."""
        named: list[Camera] = []

        def change(views: Views) -> Views:
            free = free_name("view", self._camera_names(views))  # another window may have saved some meanwhile
            checked = free if name is None else self._camera_name(views, name)
            named.append(replace(camera, name=checked))
            return views.model_copy(update={"cameras": (*views.cameras, named[0])})

        return named[0] if self._change(change) else None

    def rename_camera(self, old: str, new: str) -> bool:
        def change(views: Views) -> Views:
            _check_there(old, self._camera_names(views))
            name = self._camera_name(views, new, but=old)
            renamed = (replace(c, name=name) if c.name == old else c for c in views.cameras)
            return views.model_copy(update={"cameras": tuple(renamed)})

        return self._change(change)

    def delete_camera(self, name: str) -> bool:
        return self._change(
            lambda views: views.model_copy(update={"cameras": tuple(c for c in views.cameras if c.name != name)})
        )

    def add_path(self, path: CameraPath, name: str | None = None) -> CameraPath | None:
        """Save a path as `name`, or under the next free one; None where that cannot be."""
        named: list[CameraPath] = []

        def change(views: Views) -> Views:
            free = free_name("walk", self._path_names(views))
            named.append(replace(path, name=free if name is None else self._path_name(views, name)))
            return views.model_copy(update={"paths": (*views.paths, named[0])})

        return named[0] if self._change(change) else None

    def rename_path(self, old: str, new: str) -> bool:
        def change(views: Views) -> Views:
            _check_there(old, self._path_names(views))
            name = self._path_name(views, new, but=old)
            renamed = (replace(p, name=name) if p.name == old else p for p in views.paths)
            return views.model_copy(update={"paths": tuple(renamed)})

        return self._change(change)

    def delete_path(self, name: str) -> bool:
        return self._change(
            lambda views: views.model_copy(update={"paths": tuple(p for p in views.paths if p.name != name)})
        )

    def _camera_name(self, views: Views, name: str, but: str | None = None) -> str:
        return checked_name(name, self._camera_names(views) - {but or ""})

    def _path_name(self, views: Views, name: str, but: str | None = None) -> str:
        return checked_name(name, self._path_names(views) - {but or ""})

    def _camera_names(self, views: Views) -> set[str]:
        return {camera.name for camera in (*self.scene.cameras, *views.cameras)}

    def _path_names(self, views: Views) -> set[str]:
        return {path.name for path in (*self.scene.paths, *views.paths)}

    def _change(self, change: Callable[[Views], Views]) -> bool:
        """Apply a change to the file; whether it is there now."""
        if self.folder is None:
            self.say("not saved: there is no store")
            return False
        if not self.folder.is_dir():
            self.say(f"not saved: the store is gone: {self.folder}")  # and a folder with nothing but views is none
            return False

        def seen(views: Views) -> Views:
            self._take(views)  # what another window saved is shown even where this change is refused
            return change(views)

        try:
            self._take(change_views(self.folder, seen))
        except UserError as error:
            self.say(f"not saved: {error}")
            return False
        return True

    def _take(self, views: Views) -> None:
        self._views = views


def _check_there(name: str, names: set[str]) -> None:
    if name not in names:
        raise UserError("is no longer there: another window deleted or renamed it", got=name)


def write_alone(file: Path, path: CameraPath) -> None:
    """A `views.json` of another name that holds one path, for a store that cannot take it."""
    try:
        write_text(file, json.dumps(Views(paths=(path,)).model_dump(mode="json"), indent=1) + "\n")
    except OSError as error:
        raise UserError(f"cannot be written ({error.strerror})", file=file) from error
