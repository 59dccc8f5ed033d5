"""Materials that were changed in the window: undo and redo; names of files; rescue when the window is lost."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from lambent.core.errors import UserError
from lambent.core.plain import plain_name
from lambent.editing.history import History
from lambent.materials.document import Material


@dataclass(frozen=True)
class _State:
    """Edited materials, and what goes with materials besides their numbers, both by name."""

    materials: Mapping[str, Material] = field(default_factory=dict)
    beside: Mapping[str, Hashable] = field(default_factory=dict)


class MaterialEdits:
    """Materials that differ from the scene's, with undo and redo.

    A stroke is what one drag of a slider does: any number of `change`, then one `end_stroke`. It is undone as a whole.

    Attributes
    ----------
    scene
        The materials of the scene, by name.
    saved
        Materials as they were saved last.
    """

    def __init__(self, scene: Mapping[str, Material]) -> None:
        self.scene = scene
        self.saved: dict[str, Material] = {}
        self._history: History[_State] = History(_State())

    @property
    def edited(self) -> Mapping[str, Material]:
        """The materials that differ from the scene's."""
        return self._history.now.materials

    def current(self, name: str) -> Material:
        return self.edited.get(name, self.scene[name])

    def change(self, name: str, material: Material) -> None:
        """One moment of the stroke that is under way, or the first of a new one."""
        others = {other: edited for other, edited in self.edited.items() if other != name}
        self._go_on(materials=others if material == self.scene[name] else {**others, name: material})

    def beside(self, name: str) -> Hashable:
        """What was kept beside a material; None where nothing was."""
        return self._history.now.beside.get(name)

    def keep_beside(self, name: str, value: Hashable) -> None:
        """Keep something beside a material, such as what a fit leaves alone: undo brings back what was there before."""
        self._go_on(beside={**self._history.now.beside, name: value})

    def _go_on(self, **changes: Any) -> None:
        if not self.in_stroke:
            self._history.begin_stroke()
        self._history.change(replace(self._history.now, **changes))

    def end_stroke(self) -> None:
        self._history.end_stroke()

    def reset(self, name: str) -> None:
        """Back to the scene's material, as a stroke of its own."""
        self.end_stroke()
        self.change(name, self.scene[name])
        self.end_stroke()

    @property
    def in_stroke(self) -> bool:
        """Whether something is being changed at this moment."""
        return self._history.in_stroke

    def previous(self, name: str) -> Material | None:
        """The material before the last stroke, or before the one under way; None where there was none."""
        before = self._history.previous
        return None if before is None else before.materials.get(name, self.scene[name])

    @property
    def can_undo(self) -> bool:
        return self._history.can_undo

    @property
    def can_redo(self) -> bool:
        return self._history.can_redo

    def undo(self) -> None:
        self._history.undo()

    def redo(self) -> None:
        self._history.redo()


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
