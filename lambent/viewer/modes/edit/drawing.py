"""The edited picture as textures: A and B, fitted into the window or at one pixel per pixel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lambent.viewer.edits.fitted import FittedDrawing
from lambent.viewer.mode import Divider, Image
from lambent.viewer.modes.edit.state import EditState


class EditDrawing(FittedDrawing):
    """Uploads the painter's frames, and the outlines over them."""

    def __init__(self, device: Any, state: EditState) -> None:
        super().__init__(device, state)
        self._state = state
        self._outline: tuple[object, Image] | None = None

    @property
    def divider(self) -> Divider | None:
        frame = self._frame
        return self._state.compared.divider if frame is not None and frame.compared is not None else None

    @property
    def images(self) -> Mapping[str, Image]:
        """The outline of the object under the mouse and, for a moment, of a new selection."""
        view, wanted = self._state.loading.view, self._state.outlined
        if view is None or not wanted:
            return {}
        if self._outline is None or self._outline[0] != wanted:
            self._outline = wanted, view.outline(set(wanted))
        return {"outline": self._outline[1]}
