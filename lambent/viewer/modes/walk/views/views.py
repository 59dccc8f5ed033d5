"""Saved views and camera paths of a store, as the window keeps them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, TypeVar

from lambent.core.errors import UserError
from lambent.core.files import write_text
from lambent.core.light.light_mix import LightMix, MixTrack
from lambent.core.views.camera import Camera, CameraPath
from lambent.store.contract import SceneRecord
from lambent.store.kept.views import Views, change_views, checked_name, free_name, read_views, with_views

Kind = Literal["camera", "path"]
Item = TypeVar("Item", Camera, CameraPath)
STEMS: dict[Kind, str] = {"camera": "view", "path": "walk"}  # stems of default names


@dataclass
class SavedViews:
    """Saved cameras and paths of one store; every change is written at once, or reported as failed."""

    scene: SceneRecord  # its names cannot be used
    folder: Path | None = None  # folder of the store; without one nothing can be saved
    say: Callable[[str], None] = lambda text: None
    saved: Views = field(default_factory=Views)  # as last read
    renaming: tuple[Kind, str] | None = None  # kind and name while a new name is typed
    typed_name: str = ""

    def load(self) -> str | None:
        """Read the file; on failure report and return the reason."""
        try:
            self.saved = Views() if self.folder is None else read_views(self.folder)
        except UserError as error:
            self.say(str(error))
            return str(error)
        return None

    @property
    def all(self) -> SceneRecord:
        """The scene record with the saved cameras and paths."""
        return with_views(self.scene, self.saved)

    def free_name(self, kind: Kind) -> str:
        return free_name(STEMS[kind], self._names(kind, self.saved))

    def add(self, item: Item, name: str | None = None, light: LightMix | MixTrack | None = None) -> Item | None:
        """Save a camera or path with its light as `name`, or under the next free name; None on failure."""
        kind: Kind = "camera" if isinstance(item, Camera) else "path"
        named: list[Item] = []

        def change(views: Views) -> Views:
            taken = self._names(kind, views)  # another window may have saved views meanwhile
            free = free_name(STEMS[kind], taken)
            named.append(replace(item, name=free if name is None else checked_name(name, taken)))
            lit = _lit(views, kind, {**_lights(views, kind), **({} if light is None else {named[0].name: light})})
            return _with(lit, kind, (*_of(views, kind), *named))

        return named[0] if self._change(change) else None

    def rename(self, kind: Kind, old: str, new: str) -> bool:
        """Rename a saved camera or path; return whether that was possible."""

        def change(views: Views) -> Views:
            names = self._names(kind, views)
            if old not in names:
                raise UserError("is gone: another window deleted or renamed it", got=old)
            name = checked_name(new, names - {old})
            lit = _lit(views, kind, {name if key == old else key: one for key, one in _lights(views, kind).items()})
            return _with(lit, kind, (replace(i, name=name) if i.name == old else i for i in _of(views, kind)))

        return self._change(change)

    def delete(self, kind: Kind, name: str) -> bool:
        """Delete a saved camera or path; return whether that was possible."""

        def change(views: Views) -> Views:
            lit = _lit(views, kind, {key: one for key, one in _lights(views, kind).items() if key != name})
            return _with(lit, kind, (i for i in _of(views, kind) if i.name != name))

        return self._change(change)

    def set_track(self, path: str, track: MixTrack | None) -> bool:
        """Save or remove the light along a path; return whether that was possible."""

        def change(views: Views) -> Views:
            others = {name: one for name, one in views.tracks.items() if name != path}
            return _lit(views, "path", others if track is None else {**others, path: track})

        return self._change(change)

    def _names(self, kind: Kind, views: Views) -> set[str]:
        return {item.name for item in (*_of(self.scene, kind), *_of(views, kind))}

    def _change(self, change: Callable[[Views], Views]) -> bool:
        """Apply a change to the file; return whether it was written."""
        if self.folder is None:
            self.say("not saved: there is no store")
            return False
        if not self.folder.is_dir():
            self.say(f"not saved: {self.folder} was deleted or moved")  # a folder with only views would not be a store
            return False

        def seen(views: Views) -> Views:
            self.saved = views  # shows changes of another window even where this change is rejected
            return change(views)

        try:
            self.saved = change_views(self.folder, seen)
        except UserError as error:
            self.say(f"not saved: {error}")
            return False
        return True


def _of(holder: Views | SceneRecord, kind: Kind) -> tuple[Camera, ...] | tuple[CameraPath, ...]:
    return holder.cameras if kind == "camera" else holder.paths


def _with(views: Views, kind: Kind, items: Iterable[Camera | CameraPath]) -> Views:
    return views.model_copy(update={f"{kind}s": tuple(items)})


def _lights(views: Views, kind: Kind) -> Mapping[str, LightMix | MixTrack]:
    return views.lights if kind == "camera" else views.tracks


def _lit(views: Views, kind: Kind, lights: Mapping[str, LightMix | MixTrack]) -> Views:
    return views.model_copy(update={"lights" if kind == "camera" else "tracks": dict(lights)})


def write_alone(file: Path, path: CameraPath, track: MixTrack | None = None) -> None:
    """Write one path to a file in the format of `views.json`, for a store that cannot be written."""
    tracks = {} if track is None else {path.name: track}
    write_text(file, json.dumps(Views(paths=(path,), tracks=tracks).model_dump(mode="json"), indent=1) + "\n")
