"""A view for which arrays are baked."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.store.contract import view_artefact_name, view_meta

SIZE, MOST = (512, 512), 16384  # pixels


@dataclass(frozen=True)
class View:
    """A camera, and the size of its image in pixels, for which arrays are baked."""

    camera: Camera
    width: int
    height: int

    def name(self, kind: str, part: str) -> str:
        """Name of an array of this view."""
        return view_artefact_name(self.camera, self.width, self.height, kind, part)

    @property
    def meta(self) -> dict[str, Any]:
        return view_meta(self.camera, self.width, self.height)


def view_named(text: str, cameras: Iterable[Camera]) -> View:
    """Parse a view "CAMERA" or "CAMERA:WIDTHxHEIGHT"; `UserError` if the camera or the size is invalid."""
    found = {camera.name: camera for camera in cameras}
    size = re.fullmatch(r"(.*):(\d+)x(\d+)", text, re.DOTALL | re.ASCII)
    if text in found or size is None:
        return View(found[known("camera", text, found, field="--view")], *SIZE)
    name, *lengths = size.groups()
    if not all(len(length) < 9 and 0 < int(length) <= MOST for length in lengths):
        raise UserError("not a picture size", field="--view", got=text, expected=f"WIDTHxHEIGHT, each 1 to {MOST}")
    return View(found[known("camera", name, found, field="--view")], *map(int, lengths))
