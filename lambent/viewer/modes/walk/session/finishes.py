"""The finish library: materials of the scene, and material documents of the folder in which the command started."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from lambent.core.errors import UserError
from lambent.materials.document import Material, load_material
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.modes.walk.session.texturing import Texturing
from lambent.viewer.modes.walk.session.thumbnails import Thumbnail, ball, name_of
from lambent.viewer.screen import Screen

MOST_DOCUMENTS = 500  # of a folder


@dataclass(frozen=True)
class Finish:
    """A material to choose: of the scene, by `name`, or of a document, which was changed at `changed_ns`."""

    name: str
    file: Path | None = None
    changed_ns: int = 0


@dataclass
class Finishes:
    """The library, and what choosing from it does. Documents are read when they are first shown or chosen."""

    edits: MaterialEdits
    texturing: Texturing
    screen: Screen
    _seen_ns: int = -1  # when the folder changed before it was last listed
    _documents: tuple[Finish, ...] = field(default_factory=tuple)

    @property
    def all(self) -> tuple[Finish, ...]:
        """The scene's materials, then the documents of the folder."""
        return (*map(Finish, self.edits.scene), *self._listed())

    def _listed(self) -> tuple[Finish, ...]:
        """JSON files of the folder; listed again when the folder has changed."""
        folder = self.screen.folder
        try:
            changed_ns = folder.stat().st_mtime_ns
            if changed_ns != self._seen_ns:
                self._seen_ns, self._documents = changed_ns, tuple(_documents(folder))
        except OSError as error:
            self._documents = ()
            self.screen.say(f"finishes of {folder} are not shown: {error.strerror}")
        return self._documents

    def thumbnail(self, finish: Finish) -> str:
        """Name of the thumbnail of a finish, see `Thumbnails.get`."""
        return self.texturing.thumbnails.get(finish, partial(self._picture, finish))

    def is_unusable(self, finish: Finish) -> bool:
        """Whether the file was found to be no material document."""
        return name_of(finish) in self.texturing.thumbnails.failed

    def _picture(self, finish: Finish) -> Thumbnail:
        return ball(self._material(finish))

    def _material(self, finish: Finish) -> Material:
        return self.edits.scene[finish.name] if finish.file is None else load_material(finish.file)

    def choose(self, name: str, finish: Finish) -> None:
        """Give a material the numbers of a finish, and of one of the scene also its texture, as one stroke."""
        try:
            numbers = self._material(finish).model_copy(update={"name": self.edits.scene[name].name})
        except UserError as error:
            self.screen.say(f"finish not taken: {error}")
            return
        of = self._texture(name, finish)
        self.edits.end_stroke()
        self.edits.change(name, numbers)
        self.edits.show_texture(name, of)
        self.edits.end_stroke()

    def _texture(self, name: str, finish: Finish) -> str | None:
        """What a material with this finish shows: None its own texture, "" none."""
        textures: Mapping[str, object] = self.texturing.textures
        if finish.file is None and finish.name in textures and name not in self.texturing.without_uv:
            return None if finish.name == name else finish.name
        return "" if name in textures else None


def _documents(folder: Path) -> list[Finish]:
    files = sorted(file for file in folder.iterdir() if file.suffix.lower() == ".json" and file.is_file())
    return [Finish(file.stem, file, file.stat().st_mtime_ns) for file in files[:MOST_DOCUMENTS]]
