"""Files of the edit mode: sessions, exported material documents, and files dropped onto the window."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from lambent.core.errors import UserError
from lambent.core.plain import plain_name
from lambent.editing.session.document import Surroundings
from lambent.editing.session.exported import ExportedMaterial, export
from lambent.editing.session.session import Session, Start
from lambent.materials.document import load_material
from lambent.materials.factored.opening import editable_of
from lambent.materials.factored.terms import Editable
from lambent.viewer.background.work import Work, pending
from lambent.viewer.editor.files import kind_of, typed_path
from lambent.viewer.edits.edits import unused
from lambent.viewer.modes.edit.in_place import InPlace
from lambent.viewer.modes.edit.subject import SESSION_ENDING
from lambent.viewer.screen import Screen


class Tables:
    """Cache of the curves of measured tables, which take seconds to compute."""

    def __init__(self) -> None:
        self._made: dict[tuple[Path, int], Editable] = {}

    def __call__(self, file: Path) -> Editable:
        key = file.resolve(), file.stat().st_mtime_ns
        if key not in self._made:
            self._made[key] = editable_of(file).editable
        return self._made[key]


class Files:
    """Saves and opens files, and reports success or failure on the screen; a failure changes nothing.

    Attributes
    ----------
    home : Path or None
        File of the session; None before the first save.
    exported : ExportedMaterial or None
        The last exported material.
    keeper : InPlace or None
        Keeps the session in the one of its store, if that was opened.
    """

    def __init__(
        self, session: Session, screen: Screen, name: str, home: Path | None, keeper: InPlace | None = None
    ) -> None:
        self._session, self._screen, self._tables = session, screen, Tables()
        self._stem = plain_name(name, "scene")
        self.home = home
        self.exported: ExportedMaterial | None = None
        self.exported_to: Path | None = None
        self.keeper = keeper
        self.typed: dict[str, str] = {}
        self._work: Work | None = None
        self._saved = session.document

    @property
    def busy(self) -> bool:
        return self._work is not None

    @property
    def doing(self) -> str:
        """The running task, for people; empty without one."""
        return self._work.what if self._work is not None else ""

    @property
    def unsaved(self) -> bool:
        """Whether the session has changed since it was opened or saved, and is not kept."""
        return self._session.document != self._saved and (self.keeper is None or bool(self.keeper.fault))

    def poll(self) -> None:
        """Handle the end of the running task, and keep the session."""
        self._work = pending(self._work)
        if self.keeper is not None:
            self.keeper.tick()

    def close(self) -> None:
        """Cancel the running task, and release the store's session."""
        if self._work is not None:
            self._work.cancel()
            self._work = None
        if self.keeper is not None:
            self.keeper.close()

    def save(self) -> None:
        """Write the session to its store or file, or to a new file with the next free number."""
        if self.keeper is not None and self.keeper.keeps:
            self.keeper.save()
            return
        target, document = self.home or self._unused(self._stem), self._session.document
        try:
            self._session.save(target)
        except (UserError, OSError) as error:
            self._screen.say(f"not saved: {error}")
        else:
            self.home, self._saved = target, document
            self._screen.say(f"saved {target}")

    def rescue(self) -> Iterator[Path | str]:
        """Write the session to its store, or an unsaved one to a new file, because the window is about to be lost."""
        if self.keeper is not None and self.keeper.keeps:
            yield from self.keeper.rescue()
        elif self.unsaved:
            file = self._unused(f"{self._stem}-rescued")
            self._session.save(file)
            yield file

    def name_unsaved(self) -> None:
        """Name unsaved materials on stderr."""
        if self.unsaved:
            now, before = self._session.document.materials, self._saved.materials
            changed = [name for name in {**before, **now} if now.get(name) != before.get(name)]
            names = ", ".join(changed) or "the environment"
            sys.stderr.write(f"lambent: note: changes not saved: {names}\n")

    def export(self, material: str, *, into_room: bool = False) -> None:
        """Write the edited material as a document, or show it in the room; lobes are fitted in the background."""
        session = Session(self._session.document, self._session.folder, self._tables)

        def done(found: ExportedMaterial) -> None:
            self.exported, self.exported_to = found, None
            if into_room and self.keeper is not None:
                self.keeper.show_in_room(material, found.material)
                self._screen.say(f"the room shows {material} as edited: {found.verdict}")
                return
            folder = self._screen.folder
            file = folder / f"{unused(folder, plain_name(material), '.json')}.json"
            try:
                found.material.save(file)
            except (UserError, OSError) as error:
                self._screen.say(f"not exported: {error}")
                return
            self.exported_to = file
            self._screen.say(f"saved {file}: {found.verdict}")

        self._begin(lambda: export(session, material), f"fitting {material}", done, "not exported")

    def open(self, text: str, material: str) -> None:
        """Open a file: a document or a table for a material, or an image as the environment."""
        try:
            path = typed_path(text)
            kind = kind_of(path)
            if kind == "environment":
                self.light_with(path)
            elif kind == "material":
                self._become(material, load_material(path), path)
            else:
                become = partial(self._become, material, path, path)
                self._begin(lambda: self._tables(path), f"curves of {path.name}", lambda _: become(), "not loaded")
        except UserError as error:
            self._screen.say(f"not loaded: {error}")

    def light_with(self, path: Path) -> None:
        """Light the scene with an image, as one step of undo."""
        if not path.is_file():
            raise UserError("file does not exist", file=path)
        light = Surroundings(file=str(path.resolve()))
        self._session.history.change(self._session.document.model_copy(update={"environment": light}))
        self._screen.say(f"environment {path.name}: the picture follows once its transport is baked")

    def _become(self, name: str, start: Start, path: Path) -> None:
        try:
            self._session.become(name, start)
        except UserError as error:
            self._screen.say(f"not loaded: {error}")
        else:
            self._screen.say(f"{name} is now {path.name}; undo restores the previous material")

    def _unused(self, stem: str) -> Path:
        folder = self._screen.folder
        return folder / f"{unused(folder, stem, SESSION_ENDING)}{SESSION_ENDING}"

    def _begin(self, run: Callable[[], object], what: str, done: Callable[..., None], refused: str) -> None:
        if self._work is not None:
            raise UserError(f"still {self.doing}", hint="wait until it is done")
        self._work = Work(lambda _: run(), done, lambda error: self._screen.say(f"{refused}: {error}"))
        self._work.what = what
