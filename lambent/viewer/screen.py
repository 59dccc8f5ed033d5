"""The window itself, whatever its mode: the picture's place, messages, the pace of drawing, the cost of a frame."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lambent.viewer.pacing import BUDGET_S

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
    """Cost of the last frame. Times in ms; `gpu_ms` is empty where the adapter has no timers."""

    adapter: str = ""
    integrator: str = ""
    frame_ms: float = 0.0
    gpu_ms: Mapping[str, float] = field(default_factory=dict)
    draw_calls: int = 0
    resolution: tuple[int, int] = (0, 0)
    samples: int = 0  # per pixel, of the frame
    accumulated: int = 0  # per pixel, since the camera rests
    accumulate_to: int = 0
    scale: float = 1.0  # of the picture's width and height, by the pacing
    light_fields: Mapping[str, Any] = field(default_factory=dict)  # `Streaming.statistics`
    mirrors: int | None = 0  # planar reflectors with a mirrored view; None: left out, by the pacing


@dataclass
class Pace:
    """How frames are paced, as the user chose, and when the window last had to answer."""

    refine: bool = True  # accumulate samples while nothing moves
    adaptive: bool = True  # draw fewer pixels while something moves, where the adapter is slow
    target_ms: float = 1e3 * BUDGET_S  # of a frame in motion
    covers: bool | None = None  # means over places of each pixel in motion; None: as the adapter is fast enough
    touched_s: float = -math.inf  # when the last event came
    answering: bool = False  # an event was just seen: the interface answers before the picture is refined further


@dataclass
class Screen:
    """State of the window. Pictures and materials are saved in `folder`; `clock` gives seconds."""

    folder: Path = field(default_factory=Path)
    clock: Callable[[], float] = time.monotonic
    picture: Rect = Rect(0, 0, 1, 1)
    pace: Pace = field(default_factory=Pace)
    statistics: Statistics = field(default_factory=Statistics)
    messages: list[Message] = field(default_factory=list)
    panels_shown: bool = True
    save_wanted: bool = False  # of the picture
    close_wanted: bool = False  # by a key
    asks_to_close: bool = False  # what is to become of unsaved work
    closes: bool = False  # that question was answered: the window closes now

    def say(self, text: str) -> None:
        """Show a message for `MESSAGE_S` seconds."""
        self.messages.append(Message(text, self.clock() + MESSAGE_S))

    def drop_old_messages(self) -> None:
        now_s = self.clock()
        self.messages = [message for message in self.messages if message.until_s > now_s]


def least(*waits_s: float | None) -> float | None:
    """The shortest of times to wait, where None is for ever."""
    return min((wait_s for wait_s in waits_s if wait_s is not None), default=None)
