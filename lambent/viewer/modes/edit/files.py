"""Files of the edit mode: sessions, material documents, and files dropped onto the window."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from lambent.core.errors import UserError
from lambent.core.plain import plain_name
from lambent.materials.document import Material, load_material
from lambent.store.kept.session import Surroundings
from lambent.viewer.background.fitting import Fitting
from lambent.viewer.editor.files import kind_of, typed_path, with_account
from lambent.viewer.edits.edits import unused
from lambent.viewer.modes.edit.subject import SESSION_ENDING, Subject
from lambent.viewer.screen import Screen


class Files:
    """Saves and opens files, and reports success or failure on the screen; a failure changes nothing.

    Attributes
    ----------
    home : Path or None
        File of the session; None before the first save.
    keeper : SessionKeeper or None
        Keeps the session in the one of its store, if that was opened.
    """

    def __init__(self, subject: Subject, screen: Screen) -> None:
        self._session, self._scene, self._screen = subject.session, subject.scene, screen
        self._stem = plain_name(subject.name, "scene")
        self.home, self.keeper = subject.home, subject.keeper
        self.typed: dict[str, str] = {}
        self.fitting = Fitting(screen)
        self._saved = self._session.document

    @property
    def unsaved(self) -> bool:
        """Whether the session has changed since it was opened or saved, and is not kept."""
        return self._session.document != self._saved and (self.keeper is None or bool(self.keeper.fault))

    def poll(self) -> None:
        """Take a finished fit, and keep the session."""
        self.fitting.poll()
        if self.keeper is not None:
            self.keeper.tick()

    def close(self) -> None:
        """Cancel a running fit, and release the store's session."""
        self.fitting.close()
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
            return
        self.home, self._saved = target, document
        self._screen.say(f"saved {target}")

    def rescue(self) -> Iterator[str | Path]:
        """Write the unsaved session to the store or a new file, because the window is about to be lost."""
        if self.keeper is not None and self.keeper.keeps:
            yield from self.keeper.rescue()
        elif self.unsaved:
            file = self._unused(f"{self._stem}-rescued")
            self._session.save(file)
            yield file

    def name_unsaved(self) -> None:
        """Name what was not saved on stderr, as the window closes."""
        if self.unsaved:
            before, now = self._saved.materials, self._session.document.materials
            changed = [name for name in {**before, **now} if now.get(name) != before.get(name)]
            names = ", ".join(changed) or "the environment"
            sys.stderr.write(f"lambent: note: changes not saved: {names}\n")

    def export(self, material: str) -> None:
        """Write a material as edited as a document of its own."""
        folder = self._screen.folder
        file = folder / f"{unused(folder, plain_name(material), '.json')}.json"
        try:
            with_account(self._session.material(material).now, self._scene.materials[material], None, {}).save(file)
        except (UserError, OSError) as error:
            self._screen.say(f"not saved: {error}")
        else:
            self._screen.say(f"saved {file}")

    def open(self, text: str, material: str) -> None:
        """Open a file: a document or a measured table for a material, or an image as the environment.

        Lobes are fitted to a table in the background.
        """
        try:
            path = typed_path(text)
            kind = kind_of(path)
            if kind == "environment":
                self.light_with(path)
            elif kind == "material":
                self._become(material, path, load_material(path))
            else:
                self.fitting.begin(path, "auto", partial(self._become, material, path))
        except UserError as error:
            self._screen.say(f"not loaded: {error}")

    def light_with(self, path: Path) -> None:
        """Light the scene with an image, as one step of undo."""
        if not path.is_file():
            raise UserError("file does not exist", file=path)
        light = Surroundings(file=str(path.resolve()))
        self._session.history.change(self._session.document.model_copy(update={"environment": light}))
        self._screen.say(f"environment {path.name}: the picture follows once its transport is baked")

    def _become(self, name: str, path: Path, material: Material) -> None:
        self._session.history.end_stroke()
        self._session.change(name, material)
        self._session.history.end_stroke()
        self._screen.say(f"{name} is now {path.name}; undo restores the previous material")

    def _unused(self, stem: str) -> Path:
        folder = self._screen.folder
        return folder / f"{unused(folder, stem, SESSION_ENDING)}{SESSION_ENDING}"
