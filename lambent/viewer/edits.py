"""Materials that were changed in the window: undo and redo; names of files; rescue when the window is lost."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from lambent.core.errors import UserError
from lambent.core.plain import plain_name
from lambent.materials.document import Material

UNDO_LIMIT = 200


@dataclass
class MaterialEdits:
    """Materials that differ from the scene's, with undo and redo.

    A stroke is what one drag of a slider does: any number of `change`, then one `end_stroke`. It is undone as a whole.
    """

    scene: Mapping[str, Material]
    edited: dict[str, Material] = field(default_factory=dict)
    saved: dict[str, Material] = field(default_factory=dict)  # as they were saved last
    _undo: list[dict[str, Material]] = field(default_factory=list)
    _redo: list[dict[str, Material]] = field(default_factory=list)
    _before: dict[str, Material] | None = None  # at the start of the open stroke

    def current(self, name: str) -> Material:
        return self.edited.get(name, self.scene[name])

    def change(self, name: str, material: Material) -> None:
        if self._before is None:
            self._before = dict(self.edited)
        self.edited[name] = material
        if material == self.scene[name]:
            del self.edited[name]

    def end_stroke(self) -> None:
        before, self._before = self._before, None
        if before is not None and before != self.edited:
            self._undo = [*self._undo, before][-UNDO_LIMIT:]
            self._redo.clear()

    def reset(self, name: str) -> None:
        """Back to the scene's material, as a stroke of its own."""
        self.end_stroke()
        self.change(name, self.scene[name])
        self.end_stroke()

    @property
    def in_stroke(self) -> bool:
        """Whether something is being changed at this moment."""
        return self._before is not None

    def previous(self, name: str) -> Material | None:
        """The material before the last stroke, or before the one under way; None where there was none."""
        before = self._before if self._before is not None else self._undo[-1] if self._undo else None
        return None if before is None else before.get(name, self.scene[name])

    @property
    def can_undo(self) -> bool:
        return bool(self._undo) or self._before is not None

    @property
    def can_redo(self) -> bool:
        return bool(self._redo)

    def undo(self) -> None:
        self.end_stroke()
        if self._undo:
            self._redo.append(self.edited)
            self.edited = self._undo.pop()

    def redo(self) -> None:
        self.end_stroke()
        if self._redo:
            self._undo.append(self.edited)
            self.edited = self._redo.pop()


def rescue(edits: MaterialEdits, names: Iterable[str], folder: Path) -> Iterator[Path]:
    """Write materials to files of new names, because the window is about to be lost."""
    for name in names:
        material = edits.current(name)
        file = rescue_file(folder, material.name or name)
        material.save(file)
        yield file


def rescue_file(folder: Path, name: str) -> Path:
    """A file that is not there yet, for unsaved work."""
    return folder / f"{unused(folder, f'{plain_name(name)}-rescued', '.json')}.json"


def file_in(folder: Path, name: str) -> Path:
    """The file of a name, in `folder` unless it says otherwise; `UserError` where no file can be there."""
    file = folder / Path(name).expanduser()
    if not file.parent.is_dir():
        raise UserError("no such folder", file=file.parent)
    if file.is_dir():
        raise UserError("is a folder", file=file)
    return file


def unused(folder: Path, stem: str, *suffixes: str) -> str:
    """`stem-001`, or with the first number that no file of these suffixes in `folder` has."""
    number = 1
    while any((folder / f"{stem}-{number:03}{suffix}").exists() for suffix in suffixes):
        number += 1
    return f"{stem}-{number:03}"
