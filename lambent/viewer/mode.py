"""The contract between the window and its modes: `Mode`, its panels, and the `Drawing` that fills the picture's place.

A mode is a folder of `lambent.viewer.modes`, see there. The window knows nothing else of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.errors import UserError
from lambent.scenes.loaders.load import BUILTIN_PREFIX
from lambent.viewer.input import Input
from lambent.viewer.screen import Rect, Screen

Image = NDArray[np.uint8]  # (H, W, 4), encoded
Textures = Mapping[str, Any]  # imgui.ImTextureRef by name: "picture A", "picture B", and the images


@dataclass
class Divider:
    """The line between the pictures A and B: `share` of the picture's width belongs to A."""

    share: float = 0.5
    a_label: str = "A"
    b_label: str = "B"

    def move(self, share: float) -> None:
        """Put the line elsewhere; a strip of both pictures stays."""
        self.share = min(max(share, 0.02), 0.98)


@dataclass(frozen=True)
class Panel:
    """A section of the column at the right, under a header that folds it; `meaning` says what it is for."""

    title: str
    draw: Callable[[], None]
    meaning: str
    opened: bool = False  # at the start


@dataclass(frozen=True)
class Beside:
    """Plots right of the picture and below it; `images` are the textures that they need besides the drawing's."""

    right: Callable[[Textures], None]
    below: Callable[[Textures], None]
    images: Mapping[str, Image]


class Drawing:
    """Fills the picture's place with `views` of textures: of A and, beside a `divider`, of B.

    `images` are further textures by name, arrays or views; one called "picture A" takes the place of A's view.
    """

    def __init__(self, device: Any) -> None:
        self.device = device

    @property
    def views(self) -> Sequence[Any]:
        raise NotImplementedError

    def update(self, place: Rect, pixel_ratio: float) -> None:
        """Draw what is due into views of the size of `place`, or smaller."""
        raise NotImplementedError

    @property
    def images(self) -> Mapping[str, Any]:
        return {}

    @property
    def divider(self) -> Divider | None:
        return None

    def within(self, place: Rect) -> Rect:
        """Where in the picture's place the views lie: a picture of a shape of its own leaves borders."""
        return place

    def wait_s(self) -> float | None:
        """Seconds until something is due although nothing changes; None: never."""
        return None

    @property
    def under_way(self) -> bool:
        """Whether a frame is being drawn in parts: `work` goes on with it."""
        return False

    def work(self) -> bool:
        """Draw a part of the frame under way; whether there is a new picture to show."""
        return False

    def save(self) -> None:
        """Write the picture into the screen's folder, and say so, or why not."""

    def close(self) -> None:
        """End work in the background; harmless when repeated."""


class Mode:
    """Content and behaviour of a window; a mode overrides the methods where it differs."""

    head: Callable[[], None] | None = None  # draws the lines above the panels that do not scroll

    def __init__(self, title: str, screen: Screen, input: Input, drawing: Drawing, panels: Sequence[Panel]) -> None:
        self.title, self.screen, self.input, self.drawing, self.panels = title, screen, input, drawing, panels
        self.across, self.down = 0.5, 0.6  # where the plots begin, as shares of the window left of the column

    @property
    def beside(self) -> Beside | None:
        return None

    def draw_over(self, textures: Textures) -> None:
        """Draw marks, scales and messages over the picture."""

    @property
    def moving(self) -> bool:
        """Whether the next frame differs from this one although no event comes."""
        return False

    def advance(self, dt_s: float) -> None:
        """Go on for `dt_s` seconds of motion (0 after a sleep), and take results of work in the background."""

    def wait_s(self) -> float | None:
        """Seconds until `advance` has something to do although nothing moves; None: never."""
        return None

    def drop(self, path: str) -> None:
        """Take a file that was dropped onto the window."""

    @property
    def unsaved(self) -> tuple[str, ...]:
        """What would be lost if the window closed now, in plain words."""
        return ()

    def save(self) -> None:
        """Save what is unsaved, and say so on the screen, or why not."""

    def discard(self) -> None:
        """Closing keeps nothing of what is unsaved."""

    def rescue(self) -> None:
        """The window is lost: write unsaved work to files of new names, and say where on stderr."""

    def close(self) -> None:
        """The window was closed in order: end the work in the background, and name unsaved materials on stderr."""


def check_there(path: Path) -> None:
    """`UserError` where `path` names neither a file or folder nor a built-in scene."""
    if not path.exists() and not str(path).startswith(BUILTIN_PREFIX):
        raise UserError("cannot be read (no such file or folder)", file=path)
