"""Mouse and keys."""

from __future__ import annotations

from lambent.viewer.input import PREVIEW_SHORTCUTS, SHORTCUTS
from lambent.viewer.panels.widgets import rows
from lambent.viewer.state import ViewerState

TITLE = "Help"


def draw(state: ViewerState) -> None:
    rows(SHORTCUTS if state.preview is None else PREVIEW_SHORTCUTS, "shortcuts")
