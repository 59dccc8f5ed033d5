"""A view that arrays are baked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from lambent.core.camera import Camera
from lambent.store.contract import view_artefact_name, view_meta


@dataclass(frozen=True)
class View:
    """A camera and the size of its image, in pixels, that arrays are baked for."""

    camera: Camera
    width: int
    height: int

    def name(self, kind: str, part: str) -> str:
        """Name of an array of this view."""
        return view_artefact_name(self.camera, self.width, self.height, kind, part)

    @property
    def meta(self) -> dict[str, Any]:
        return view_meta(self.camera, self.width, self.height)
