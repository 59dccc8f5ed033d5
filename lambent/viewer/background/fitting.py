"""Lobes fitted to a measured file in the background of a window."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Literal

from lambent.core.errors import UserError
from lambent.core.progress import Progress
from lambent.materials.document import Material
from lambent.viewer.background.work import Work, pending
from lambent.viewer.screen import Screen


class Fitting:
    """One fit at a time; its end is reported by `poll`, an error on the screen."""

    def __init__(self, screen: Screen) -> None:
        self._screen = screen
        self._work: Work | None = None

    @property
    def busy(self) -> bool:
        return self._work is not None

    @property
    def doing(self) -> str:
        """The fit and its progress, for people; empty without one."""
        return f"{self._work.what} {100 * self._work.share:.0f} %" if self._work is not None else ""

    def begin(self, file: Path, lobes: Literal["auto", "curve"], done: Callable[[Material], None]) -> None:
        """Fit lobes to a file and call `done` with the material; `UserError` while another fit runs."""
        if self._work is not None:
            raise UserError(f"still {self.doing}", hint="wait until it is done")

        def run(progress: Progress) -> Material:
            from lambent.materials.fitting.fit import fit  # loads SciPy
            from lambent.materials.measured import load

            return fit(load(file), lobes=lobes, source=file, progress=progress).material

        self._work = Work(run, done, lambda error: self._screen.say(f"not loaded: {error}"), self._screen.wake)
        self._work.what = f"fitting {file.name}"

    def poll(self) -> None:
        """Hand over a finished fit."""
        self._work = pending(self._work)

    def close(self) -> None:
        """Cancel the running fit."""
        if self._work is not None:
            self._work.cancel()
            self._work = None
