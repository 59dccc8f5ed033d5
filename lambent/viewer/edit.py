"""`lambent edit`: opens the mode that edits a file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lambent.viewer import app


def run(file: Path, material: Path | None = None, environments: Sequence[Path] = (), **window: Any) -> None:
    """Show the editor of a file; returns when its window is closed.

    Parameters
    ----------
    file : Path
        A measured table in any known format, or a material document.
    material : Path, optional
        A document: the material to start from, or, where `file` is one too, the material B to compare with.
    environments : sequence of Path
        Lat-long pictures to light the preview with; the .hdr files beside `file` are offered too.
    **window
        `size`, `frames`, `folder` as in `app.run`, which raises what this raises.
    """
    app.run(file, editing_mode(file), material=material, environments=environments, **window)


def editing_mode(file: Path) -> str:
    """Name of the mode that edits this kind of file; the material editor by default, which names faults of the file."""
    found = app.starts().items()
    return next((name for name, mode in found if hasattr(mode, "edits") and mode.edits(file)), "material")
