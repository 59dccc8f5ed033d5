"""Files of the edit mode: sessions, material documents that are handed over, and what is dropped onto the window."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from lambent.core.errors import UserError
from lambent.core.plain import plain_name
from lambent.editing.document import SessionDocument, Surroundings
from lambent.editing.handover import Handover, hand_over
from lambent.editing.session import Session, Start
from lambent.materials.document import load_material
from lambent.materials.factored.opening import editable_of
from lambent.materials.factored.terms import Editable
from lambent.viewer.editor.files import kind_of, typed_path
from lambent.viewer.edits import unused
from lambent.viewer.modes.edit.subject import SESSION_ENDING
from lambent.viewer.work import Work

if TYPE_CHECKING:
    from lambent.viewer.modes.edit.state import EditState


class Tables:
    """Curves of tables, each made once: that takes seconds."""

    def __init__(self) -> None:
        self._made: dict[tuple[Path, int], Editable] = {}

    def __call__(self, file: Path) -> Editable:
        key = file.resolve(), file.stat().st_mtime_ns
        if key not in self._made:
            self._made[key] = editable_of(file).editable
        return self._made[key]


class Files:
    """Saves and opens, and says so, or why not, on the screen; a failure changes nothing.

    Attributes
    ----------
    home : Path or None
        Where the session is saved; None until it has a file.
    handed : Handover or None
        What was handed over last.
    """

    def __init__(self, state: EditState, tables: Tables) -> None:
        self._state, self._tables = state, tables
        self.home: Path | None = state.subject.home
        self.handed: Handover | None = None
        self.handed_to: Path | None = None
        self.typed: dict[str, str] = {}
        self._work: Work | None = None
        self._saved = state.session.document

    @property
    def busy(self) -> bool:
        return self._work is not None

    @property
    def doing(self) -> str:
        """What is under way, for people; empty where nothing is."""
        return self._work.what if self._work is not None else ""

    @property
    def unsaved(self) -> bool:
        """Whether the session has changed since it was opened or saved."""
        return self._state.session.document.materials != self._saved.materials or (
            self._state.session.document.environment != self._saved.environment
        )

    def poll(self) -> None:
        """Take the end of what was under way."""
        if self._work is not None and self._work.poll():
            self._work = None

    def close(self) -> None:
        """Cancel what is under way."""
        if self._work is not None:
            self._work.cancel()
            self._work = None

    def save(self) -> None:
        """Write the session to its file; to a new one of the next free number where it has none."""
        state = self._state
        folder, stem = state.screen.folder, plain_name(state.subject.name, "scene")
        target = self.home or folder / f"{unused(folder, stem, SESSION_ENDING)}{SESSION_ENDING}"
        document = state.session.document
        try:
            state.session.save(target)
        except (UserError, OSError) as error:
            state.screen.say(f"not saved: {error}")
        else:
            self.home, self._saved = target, document
            state.screen.say(f"saved {target}")

    def rescue(self) -> Iterator[Path]:
        """Write an unsaved session to a file of a new name, because the window is about to be lost."""
        if self.unsaved:
            state = self._state
            folder, stem = state.screen.folder, f"{plain_name(state.subject.name, 'scene')}-rescued"
            file = folder / f"{unused(folder, stem, SESSION_ENDING)}{SESSION_ENDING}"
            state.session.save(file)
            yield file

    def name_unsaved(self) -> None:
        """Say on stderr which materials were changed and not saved."""
        if self.unsaved:
            now, before = self._state.session.document.materials, self._saved.materials
            names = ", ".join(name for name, one in now.items() if one != before.get(name)) or "the environment"
            sys.stderr.write(f"lambent: note: {names} changed and not saved\n")

    def hand_over(self, material: str) -> None:
        """Write a material document of a material as it is edited now; lobes are fitted beside the window."""
        session, state = self._copy(), self._state

        def done(found: Handover) -> None:
            folder = state.screen.folder
            file = folder / f"{unused(folder, plain_name(material), '.json')}.json"
            try:
                found.material.save(file)
            except (UserError, OSError) as error:
                state.screen.say(f"not handed over: {error}")
                return
            self.handed, self.handed_to = found, file
            state.screen.say(f"saved {file}: {found.verdict}")

        self._begin(lambda: hand_over(session, material), f"fitting {material}", done, "not handed over")

    def open(self, text: str) -> None:
        """Take a file: a document or a table for the selected material, an image as the environment."""
        state = self._state
        try:
            path = typed_path(text)
            kind = kind_of(path)
            if kind == "environment":
                self.light_with(path)
            elif kind == "material":
                self._become(state.material, load_material(path), path)
            else:
                name = state.material

                def done(_: Editable) -> None:
                    self._become(name, path, path)

                self._begin(lambda: self._tables(path), f"curves of {path.name}", done, "not loaded")
        except UserError as error:
            state.screen.say(f"not loaded: {error}")

    def light_with(self, path: Path) -> None:
        """Light the scene with an image, as a step of undo."""
        if not path.is_file():
            raise UserError("no such file", file=path)
        state = self._state
        light = Surroundings(file=str(path.resolve()))
        state.session.history.change(state.session.document.model_copy(update={"environment": light}))
        state.screen.say(f"light of {path.name}: the picture follows when its transport is baked")

    def _become(self, name: str, start: Start, path: Path) -> None:
        try:
            self._state.session.become(name, start)
        except UserError as error:
            self._state.screen.say(f"not loaded: {error}")
        else:
            self._state.screen.say(f"{name} is {path.name} now; undo brings back the one before")

    def _copy(self) -> Session:
        """The session as it is now, for another thread."""
        document: SessionDocument = self._state.session.document
        return Session(document, self._state.session.folder, self._tables)

    def _begin(self, run: Callable[[], object], what: str, done: Callable[..., None], refused: str) -> None:
        if self._work is not None:
            raise UserError(f"still {self.doing}", hint="wait until that is done")
        self._work = Work(lambda _: run(), done, lambda error: self._state.screen.say(f"{refused}: {error}"))
        self._work.what = what
