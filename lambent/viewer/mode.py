"""The contract between the window and its modes: `Mode`, its panels, and the `Drawing` of the picture.

A mode is a folder of `lambent.viewer.modes`; the window uses modes only through this contract.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.errors import UserError
from lambent.core.inputs import BUILTIN_PREFIX
from lambent.viewer.input import Input
from lambent.viewer.screen import Rect, Screen

Image = NDArray[np.uint8]  # (H, W, 4), encoded
Textures = Mapping[str, Any]  # imgui.ImTextureRef by name: "picture A", "picture B", and the images


@dataclass
class Divider:
    """The divider between the pictures A and B: `share` of the picture's width belongs to A."""

    share: float = 0.5
    a_label: str = "A"
    b_label: str = "B"

    def move(self, share: float) -> None:
        """Move the divider; a strip of both pictures stays visible."""
        self.share = min(max(share, 0.02), 0.98)


@dataclass(frozen=True)
class Panel:
    """A collapsible section of the column; `meaning` is the tooltip of its header."""

    title: str
    draw: Callable[[], None]
    meaning: str
    opened: bool = False  # whether the panel starts open


@dataclass(frozen=True)
class SidePlots:
    """Plots right of the picture and below it; `images` are textures they need in addition to the drawing's."""

    right: Callable[[Textures], None]
    below: Callable[[Textures], None]
    images: Mapping[str, Image]


class Drawing:
    """Fills the picture's place with `views` of textures: of A and, with a `divider`, of B.

    `images` are further textures by name, arrays or views; one named "picture A" replaces A's view, and over one named
    "before A", A is blended by its `share`.
    """

    def __init__(self, device: Any) -> None:
        self.device = device

    @property
    def views(self) -> Sequence[Any]:
        raise NotImplementedError

    def update(self, place: Rect, pixel_ratio: float) -> None:
        """Draw the due frames into views of the size of `place`, or smaller."""
        raise NotImplementedError

    @property
    def images(self) -> Mapping[str, Any]:
        return {}

    @property
    def share(self) -> float:
        return 1.0

    @property
    def divider(self) -> Divider | None:
        return None

    def within(self, place: Rect) -> Rect:
        """Rectangle of the views within the picture's place; a picture with another aspect leaves borders."""
        return place

    def wait_s(self) -> float | None:
        """Seconds until something is due without an event; None: never."""
        return None

    def save(self) -> None:
        """Write the picture into the screen's folder, and report success or failure."""

    def close(self) -> None:
        """Stop background work; may be called again."""


class Mode:
    """Content and behaviour of a window; a mode overrides methods."""

    head: Callable[[], None] | None = None  # draws the lines above the panels that do not scroll

    def __init__(self, title: str, screen: Screen, input: Input, drawing: Drawing, panels: Sequence[Panel]) -> None:
        self.title, self.screen, self.input, self.drawing, self.panels = title, screen, input, drawing, panels
        self.across, self.down = 0.5, 0.6  # where the plots begin, as shares of the window left of the column

    @property
    def side_plots(self) -> SidePlots | None:
        return None

    def draw_over(self, textures: Textures) -> None:
        """Draw marks, scales and messages over the picture."""

    @property
    def moving(self) -> bool:
        """Whether the next frame differs without an event."""
        return False

    def advance(self, dt_s: float) -> None:
        """Advance motion by `dt_s` seconds (0 after a sleep), and take results of background work."""

    def wait_s(self) -> float | None:
        """Seconds until `advance` must be called although nothing moves; None: never."""
        return None

    def drop(self, path: str) -> None:
        """Open a file that was dropped onto the window."""

    @property
    def unsaved(self) -> tuple[str, ...]:
        """Names of unsaved work, for people."""
        return ()

    def save(self) -> None:
        """Save unsaved work, and report success or failure on the screen."""

    def discard(self) -> None:
        """Discard unsaved work."""

    def rescue(self) -> None:
        """Write unsaved work to new files because the window is lost, and name them on stderr."""

    def close(self) -> None:
        """Stop background work after the window was closed, and name unsaved work on stderr."""


def check_there(path: Path, **_: object) -> None:
    """Raise `UserError` if `path` is neither a file, a folder, nor a built-in scene."""
    if not path.exists() and not str(path).startswith(BUILTIN_PREFIX):
        raise UserError("file does not exist", file=path)
