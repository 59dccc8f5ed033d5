"""The outline of the selected object over the picture."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.store.contract import ObjectRecord


class Outlining:
    """`images` has the outline of the selected object as the camera sees it, drawn again after changes."""

    def __init__(self, renderer: Renderer) -> None:
        self._renderer, self._outline = renderer, renderer.outline()
        self._drawn_for: tuple[Any, ...] = ()
        self.images: Mapping[str, Any] = {}

    def update(self, frame: FrameState, selected: ObjectRecord | None) -> None:
        """Outline the object `selected` in the picture of `frame`; None: no outline."""
        wanted = (frame.camera, frame.size, frame.near_m, selected)
        if wanted == self._drawn_for:
            return
        self._drawn_for = wanted
        self.images = {} if selected is None else {"outline": self._outline.draw(frame, selected)}
