"""The room's own view while the window shows one of its views alone, edited in place or relit."""

from __future__ import annotations

from lambent.core.views.camera import Camera
from lambent.store.kept.session import KeptView
from lambent.viewer.edits.keeping import SessionKeeper
from lambent.viewer.look import Look


class RoomsView:
    """The view of a room's session while one of its views is shown alone: its exposure, view transform, and way back.

    Sets the `look` to the session's.
    """

    def __init__(self, keeper: SessionKeeper, look: Look) -> None:
        self.opened, self._look = keeper.opened.view, look
        self._left: dict[str, object] = {}
        if self.opened is not None:
            look.view_transform, look.scale = self.opened.look.view_transform, self.opened.look.scale
        if self.has_exposure and self.opened is not None and self.opened.look.exposure_ev is not None:
            look.exposure_ev, look.base_ev = self.opened.look.exposure_ev, self.opened.look.base_ev
        keeper.view = self.now

    @property
    def has_exposure(self) -> bool:
        """Whether the session has an exposure."""
        return self.opened is not None and self.opened.look.exposure_ev is not None

    @property
    def selected(self) -> str | None:
        """The selected object."""
        return None if self.opened is None else self.opened.selected

    def leave(self, camera: Camera, selected: str | None) -> None:
        """Let the room be shown from a camera, with an object selected."""
        self._left = {"camera": camera, "selected": selected}

    def now(self) -> KeptView | None:
        """The view to keep."""
        if self.opened is None:
            return KeptView.model_validate(self._left) if self._left else None
        look = self._look
        shown: dict[str, object] = {"view_transform": look.view_transform, "scale": look.scale}
        shown |= {"exposure_ev": look.exposure_ev, "base_ev": look.base_ev} if self.has_exposure else {}
        return self.opened.model_copy(update={"look": self.opened.look.model_copy(update=shown), **self._left})
