"""Opens the window in one of the modes that are found in `lambent.viewer.modes`."""

from __future__ import annotations

import warnings
from pathlib import Path
from types import ModuleType
from typing import Any

from lambent.core.discovery import known, modules_in
from lambent.core.errors import UserError
from lambent.viewer import modes
from lambent.viewer.background.lost import kept
from lambent.viewer.screen import Screen


def run(
    path: Path,
    mode: str = "walk",
    *,
    size: tuple[int, int] = (1680, 1050),
    frames: int | None = None,
    folder: Path | None = None,
    **options: Any,
) -> None:
    """Show a file or store in a window; returns when it is closed.

    Parameters
    ----------
    path : Path
        For "walk" and "view": a store with at least geometry and the scene record.
    mode : str
        A name in `starts`: "walk" starts on foot, "view" orbits the camera's target.
    size, frames : (width, height), int or None
        Size of the window, logical pixels; number of frames to draw without a pause before the window closes.
    folder : Path, optional
        Folder for saved pictures and materials; by default the working folder.
    **options
        Options of the mode.

    Raises
    ------
    UserError
        If there is no display or adapter, `path` cannot be shown, or the mode is unknown.
    """
    found = starts()
    module = found[known("mode", mode, found)]
    if hasattr(module, "check"):
        module.check(Path(path), **options)
    check_display(module.NO_DISPLAY)
    from lambent.viewer.window import Window

    # The window alone holds the mode: it may be exchanged, and its renderer is then to be freed.
    screen = Screen(folder or Path.cwd())
    window = Window(module.start(Path(path), mode, screen, **options), size=size, frames=frames)
    with kept(lambda: window.mode.rescue()):  # the mode may be exchanged
        try:
            window.run()
        finally:
            window.mode.drawing.close()
    window.mode.close()


def starts() -> dict[str, ModuleType]:
    """Modules of the modes, by the names that open them."""
    return {name: module for module in modules_in(modes, having="STARTS").values() for name in module.STARTS}


def check_display(hint: str) -> None:
    """Raise `UserError` if no window can be opened; `hint` suggests an alternative."""
    import glfw

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", glfw.GLFWError)
        if not glfw.init():
            raise UserError("no display", hint=hint)
