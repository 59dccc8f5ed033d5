"""The material mode: the editor beside a preview, for a measured table or a material document; see `lambent edit`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from lambent.viewer.mode import Mode, check_there
from lambent.viewer.screen import Screen

check = check_there  # before a window is opened
STARTS = ("material",)
NO_DISPLAY = "the editor needs a display; without one, use `lambent fit --plot`"


def start(
    path: Path, name: str, screen: Screen, *, material: Path | None = None, environments: Sequence[Path] = ()
) -> Mode:
    """Start the mode on the file at `path`; `material` and `environments` as in `lambent.viewer.edit.run`."""
    from lambent.realtime.gpu.device import open_device
    from lambent.viewer.modes.material.mode import MaterialMode, MaterialState
    from lambent.viewer.modes.material.stage import Stage

    state = MaterialState.of(path, material, environments, screen)
    return MaterialMode(state, Stage(open_device(), state))
