"""Frames of a mode on a canvas: events go in, due frames are drawn, nothing happens while nothing changes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import wgpu

from lambent.viewer.mode import Mode
from lambent.viewer.screen import least

SETTLE_FRAMES = 3  # an interface shows what an event did one or two frames later
EVENTS = ("pointer_down", "pointer_move", "pointer_up", "pointer_leave", "wheel", "key_down", "key_up")


class Frames:
    """Shows a mode on a canvas of rendercanvas, and its event `loop`. What is drawn there, a subclass says."""

    def __init__(self, mode: Mode, canvas: Any, loop: Any) -> None:
        self.mode, self.screen, self.canvas, self._loop = mode, mode.screen, canvas, loop
        self._extra_frames = 0
        self._told: list[str] = []  # messages of the last frame
        self._drawn_s = self.screen.clock()
        self._moving = False  # whether something moves between this frame and the next
        self._woken = False  # by background work, since the last frame
        self._wake_at_s: float | None = None
        self.screen.wake = self._wake

    def _failed(self, error: Exception) -> None:
        """Handle an error of an event or a frame, which the event loop would only log."""
        raise NotImplementedError

    def _show(self) -> None:
        """Draw what is outdated."""
        raise NotImplementedError

    @property
    def _captured(self) -> tuple[bool, bool]:
        """Whether the mouse and the keys belong to an interface over the picture."""
        return False, False

    @property
    def _unread(self) -> bool:
        """Whether events wait for further frames."""
        return False

    @contextmanager
    def _watched(self) -> Iterator[None]:
        """Catch errors; a frame for which the display has no image in time is drawn again."""
        try:
            yield
        except wgpu.DrawCancelled:
            self.canvas.request_draw()
            raise
        except Exception as error:  # noqa: BLE001
            self._failed(error)

    def touched(self) -> None:
        """Draw soon, because the user did something."""
        self._extra_frames, self.screen.pace.touched_s = SETTLE_FRAMES, self.screen.clock()
        self.canvas.request_draw()

    def _on_event(self, event: dict[str, Any]) -> None:
        self.touched()
        if event["event_type"] in EVENTS:
            with self._watched():
                has_mouse, has_keys = self._captured
                self.mode.input.handle(event, ui_has_mouse=has_mouse, ui_has_keys=has_keys)

    def _draw(self) -> None:
        with self._watched():
            now_s = self.screen.clock()
            since_last_s, self._drawn_s = now_s - self._drawn_s, now_s
            self._advance(since_last_s)
            self._show()
            self._schedule()

    def _advance(self, since_last_s: float) -> None:
        """Advance the mode to the present time."""
        self.mode.advance(since_last_s if self._moving else 0.0)  # a sleep before the first step is no walking
        self.screen.drop_old_messages()

    def _schedule(self) -> None:
        """Request the next frame if something will change; otherwise sleep."""
        told = [message.text for message in self.screen.messages]
        if self._unread or told != self._told:  # messages from the background also change sizes
            self._extra_frames = SETTLE_FRAMES
        else:
            self._extra_frames = max(0, self._extra_frames - 1)
        self._told = told
        self._moving = self.mode.moving
        woken, self._woken = self._woken, False  # an interface fits new text to its table one frame later
        if self._moving or self._extra_frames or woken:
            self.canvas.request_draw()
        messages = (message.until_s - self.screen.clock() for message in self.screen.messages)
        due_s = least(self.mode.wait_s(), self.mode.drawing.wait_s(), *messages)
        if due_s is not None:
            self._wake_in(max(0.0, due_s))

    def _wake(self) -> None:
        """Draw a frame soon; runs in any thread, and sets flags that the canvas reads sixty times a second."""
        self._woken = True
        self.canvas.request_draw()

    def _wake_in(self, seconds: float) -> None:
        at_s = self.screen.clock() + seconds
        if self._wake_at_s is not None and self._wake_at_s <= at_s:
            return  # an earlier frame will check again
        self._wake_at_s = at_s

        def wake() -> None:
            if self._wake_at_s == at_s:
                self._wake_at_s = None
                self.canvas.request_draw()

        if seconds > 0:
            self._loop.call_later(seconds, wake)
        else:
            wake()
