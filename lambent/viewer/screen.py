"""State of the window, independent of its mode: place of the picture, messages, pacing, cost of a frame."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lambent.viewer.pacing import BUDGET_S
from lambent.viewer.settings import SIZES, Remembered, Size

MESSAGE_S = 6.0


@dataclass(frozen=True)
class Rect:
    """A place in the window, in logical pixels."""

    x: int
    y: int
    width: int
    height: int

    def point(self, x: float, y: float) -> tuple[float, float]:
        """Of the window, at shares of this place."""
        return self.x + x * self.width, self.y + y * self.height

    def holds(self, x: float, y: float) -> bool:
        return self.x <= x < self.x + self.width and self.y <= y < self.y + self.height


@dataclass
class Message:
    text: str
    until_s: float


@dataclass(frozen=True)
class Statistics:
    """Cost of the last frame. Times are in ms; `gpu_ms` is empty on adapters without timers."""

    adapter: str = ""
    integrator: str = ""
    frame_ms: float = 0.0
    gpu_ms: Mapping[str, float] = field(default_factory=dict)
    draw_calls: int = 0
    resolution: tuple[int, int] = (0, 0)
    samples: int = 0  # per pixel in the frame
    scale: float = 1.0  # scale of width and height, chosen by the pacing
    light_fields: Mapping[str, Any] = field(default_factory=dict)  # `Streaming.statistics`
    mirrors: int | None = 0  # planar reflectors with a mirrored view; None: skipped by the pacing


@dataclass
class Pace:
    """The user's pacing choices, and the time of the last event."""

    traces: bool = True  # trace the picture at rest
    adaptive: bool = True  # draw fewer pixels in motion if the adapter is slow
    target_ms: float = 1e3 * BUDGET_S  # target time of a frame in motion
    covers: bool | None = None  # several depth samples per pixel in motion; None: if the adapter is fast enough
    touched_s: float = -math.inf  # time of the last event
    dragging: bool = False  # a material is being dragged: its light is shown soon rather than sharp
    answering: bool = False  # an event was just handled: draw the interface before a frame at rest


@dataclass
class Screen:
    """State of the window. Pictures and materials are saved in `folder`; `clock` gives seconds."""

    folder: Path = field(default_factory=Path)
    clock: Callable[[], float] = time.monotonic
    picture: Rect = Rect(0, 0, 1, 1)
    pace: Pace = field(default_factory=Pace)
    statistics: Statistics = field(default_factory=Statistics)
    messages: list[Message] = field(default_factory=list)
    at_rest: str = ""  # a line on the picture at rest
    panels_shown: bool = True
    save_wanted: bool = False  # whether to save the picture
    close_wanted: bool = False  # whether a key asked to close the window
    asks_to_close: bool = False  # whether the question about unsaved work is shown
    closes: bool = False  # whether the question was answered and the window closes
    wake: Callable[[], None] = lambda: None  # draws a frame soon; any thread may call it
    enter: Callable[[Any], Any] | None = None  # returns the mode to exchange the present one for, see `exchange`
    exchanging: bool = False  # whether the present mode is being closed for another one
    histories: dict[object, Any] = field(default_factory=dict)  # of edits, for the mode that comes back
    card_shown: bool = False  # whether the card of the first start is shown
    by_keys: bool = False  # whether keys go to the controls instead of the picture
    list_open: bool = False  # whether a list or a question lay over the last frame
    images: dict[str, Any] = field(default_factory=dict)  # pictures of panels (H, W, 4), by name
    textures: Mapping[str, Any] = field(default_factory=dict)  # of the layout and of `images`, once on the GPU

    def __post_init__(self) -> None:
        self.remembered = Remembered(self.say)

    @property
    def size(self) -> Size:
        """The size of the window, see `sizes`."""
        return self.remembered.now.size

    @size.setter
    def size(self, size: Size) -> None:
        self.remembered.set(size=size)

    def next_size(self, step: int = 1) -> None:
        """Go to the next size of the window, or `step` further."""
        self.size = SIZES[(SIZES.index(self.size) + step) % len(SIZES)]

    def say(self, text: str) -> None:
        """Show a message for `MESSAGE_S` seconds."""
        self.messages.append(Message(text, self.clock() + MESSAGE_S))

    def drop_old_messages(self) -> None:
        now_s = self.clock()
        self.messages = [message for message in self.messages if message.until_s > now_s]


def least(*waits_s: float | None) -> float | None:
    """The shortest waiting time; None means for ever."""
    return min((wait_s for wait_s in waits_s if wait_s is not None), default=None)
