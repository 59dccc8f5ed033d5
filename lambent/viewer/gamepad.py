"""A gamepad: its sticks, triggers and buttons, read only while one is connected."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

DEAD = 0.15  # deflection of a stick or trigger that counts as none
POLL_S = 1 / 60


@dataclass(frozen=True)
class PadState:
    """Deflections of the sticks, right and up, within the unit disc; of the triggers, 0 to 1; pressed buttons."""

    left: tuple[float, float] = (0.0, 0.0)
    right: tuple[float, float] = (0.0, 0.0)
    slower: float = 0.0
    faster: float = 0.0
    pressed: frozenset[str] = frozenset()

    @property
    def moves(self) -> bool:
        """Whether a stick is deflected."""
        return any((*self.left, *self.right))


IDLE = PadState()


class Pads(Protocol):
    """The gamepads of the computer."""

    def read(self) -> PadState | None:
        """The state of the first gamepad; None while none is connected."""


@dataclass(frozen=True)
class GlfwPads:
    """Gamepads by `glfw`, the window library's module."""

    glfw: Any

    def read(self) -> PadState | None:
        """The state of the first gamepad; None while none is connected."""
        glfw = self.glfw
        numbers = range(glfw.JOYSTICK_1, glfw.JOYSTICK_LAST + 1)
        found = next((pad for number in numbers if (pad := glfw.get_gamepad_state(number)) is not None), None)
        if found is None:
            return None
        named = {"A": glfw.GAMEPAD_BUTTON_A, "B": glfw.GAMEPAD_BUTTON_B, "Start": glfw.GAMEPAD_BUTTON_START}
        (left_x, left_y, right_x, right_y), triggers = found.axes[:4], found.axes[4:6]
        slower, faster = (_beyond_dead(max((one + 1) / 2, 0.0)) for one in triggers)  # -1 at rest
        pressed = frozenset(name for name, number in named.items() if found.buttons[number])
        return PadState(stick(left_x, -left_y), stick(right_x, -right_y), slower, faster, pressed)


def stick(x: float, y: float) -> tuple[float, float]:
    """A deflection without its dead zone, within the unit disc."""
    length = math.hypot(x, y)
    factor = _beyond_dead(length) / length if length > 0 else 0.0
    return factor * x, factor * y


def _beyond_dead(value: float) -> float:
    return min(max(value - DEAD, 0.0) / (1 - DEAD), 1.0)


class PadWatch:
    """Polls from `connected` on until no gamepad is left; calls `woken` when there is something to do.

    `later(seconds, function)` calls a function later, in the thread of the window.
    """

    def __init__(self, pads: Pads, later: Callable[[float, Callable[[], None]], object], woken: Callable[[], None]):
        self._pads, self._later, self._woken = pads, later, woken
        self.now = IDLE
        self._polls = False

    def connected(self, *_: object) -> None:
        """Begin to poll, if a gamepad is there; a callback of the window library."""
        if not self._polls:
            self._polls = True
            self._poll()

    def _poll(self) -> None:
        found = self._pads.read()
        before, self.now = self.now, found or IDLE
        if self.now != before or self.now.moves:
            self._woken()
        self._polls = found is not None
        if self._polls:
            self._later(POLL_S, self._poll)
