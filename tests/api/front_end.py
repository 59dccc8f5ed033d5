"""The browser's side of a view in a notebook, within the kernel: it sends events, and takes and confirms pictures."""

from __future__ import annotations

import asyncio
import io

import numpy as np
from PIL import Image

PLAIN = {"button": 0, "buttons": (), "modifiers": (), "ntouches": 0, "touches": {}}


class FrontEnd:
    """Shows a view in `size`, pixels; `picture` is the last that came."""

    def __init__(self, view, size=(160, 120)):
        self.canvas, self.state, self.count = view._cell.canvas, view._state, 0
        self.picture = None
        self._came = asyncio.Event()
        self.canvas.send = self._take
        self.canvas._has_visible_views = True
        width, height = size
        self.say("resize", width=width, height=height, ratio=1.0, pwidth=width, pheight=height)

    def _take(self, said, buffers=()):
        self.picture = np.asarray(Image.open(io.BytesIO(buffers[0])).convert("RGB")).astype(int)
        self.count += 1
        self.canvas._frame_feedback = {"index": said["index"], "timestamp": said["timestamp"], "localtime": 0.0}
        self._came.set()

    def say(self, kind, **more):
        self.canvas._rfb_handle_msg(self.canvas, {"type": kind, "timestamp": 0.0, **PLAIN, **more}, [])

    def drag(self, *points, button=1):
        (x, y), *others = points
        self.say("pointer_down", x=x, y=y, button=button, buttons=(button,))
        for x, y in others:
            self.say("pointer_move", x=x, y=y, buttons=(button,))
        self.say("pointer_up", x=x, y=y, button=button)

    async def until(self, holds):
        """The picture after `holds()`; it is asked after each that comes."""
        while self.picture is None or not holds():
            self._came.clear()
            await self._came.wait()
        return self.picture

    async def after(self, act):
        """The next picture that differs from the present one, after `act()`."""
        before = await self.until(lambda: True)
        act()
        return await self.until(lambda: self.picture.shape != before.shape or np.abs(self.picture - before).max() > 8)
