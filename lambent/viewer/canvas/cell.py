"""A live view in the cell of a notebook: the walk mode on rendercanvas's Jupyter canvas, with ipywidgets below it.

Events come from the browser, pictures go there compressed. Importing this needs jupyter_rfb and ipywidgets.
"""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import ipywidgets
import numpy as np
import wgpu
from IPython.utils.capture import capture_output
from numpy.typing import NDArray
from rendercanvas.jupyter import RenderCanvas, loop

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.light.light_mix import LightMix
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.realtime.gpu.targets import texels
from lambent.store.kept.session import FILE, RoomState, WalkSession, read_session
from lambent.store.kept.states import SAVED
from lambent.viewer.canvas.controls import Controls
from lambent.viewer.canvas.frames import EVENTS, Frames
from lambent.viewer.modes.walk.session.states import BAKED
from lambent.viewer.modes.walk.walking import Opened, Walking, opened
from lambent.viewer.screen import Rect, Screen

MAX_FPS = 30  # of pictures through a browser's connection


def open_cell(folder: Path, size: tuple[int, int]) -> Cell:
    """Open a view of the store in a folder; its session's states are offered, but it is neither kept nor locked.

    Raises
    ------
    UserError
        If this is no notebook, there is no adapter, or the store cannot be shown.
    """
    try:
        asyncio.get_running_loop()
    except RuntimeError as error:
        raise UserError("needs the kernel of a notebook", field="view", hint="use `lambent walk`") from error
    found = opened(folder, "walk", Screen(Path.cwd()), session=False)
    kept = read_session(folder / FILE)
    if kept is not None:
        left = {SAVED: kept.now} if kept.now != RoomState() else {}
        found.state.materials.edits.begin_from(WalkSession(states={**left, **kept.states}))
    return Cell(found, size)


class Cell(Frames):
    """One view. `widget` is what the notebook shows."""

    mode: Walking

    def __init__(self, found: Opened, size: tuple[int, int]) -> None:
        with capture_output():  # an empty line for errors, which goes below the controls
            canvas = RenderCanvas(size=size, max_fps=MAX_FPS)
        super().__init__(Walking(found.state, found.input, found.pictures), canvas, loop)
        self.closed, self._size, self._pictures = False, size, found.pictures
        self.controls = Controls(found.state, self.touched)
        self.widget = ipywidgets.VBox([canvas, self.controls.widget, canvas._output_context])
        self._sent: NDArray[np.uint8] | None = None  # the picture that the browser has
        self._context = self.canvas.get_bitmap_context()
        self.canvas.add_event_handler(self._on_event, *EVENTS)
        self.canvas.add_event_handler(self._resized, "resize")
        self.canvas.add_event_handler(lambda event: self.close(), "close")
        self.canvas.request_draw(self._draw)

    def begin(
        self, camera: Camera | None, variant: str, light: LightMix | None, edits: Mapping[str, Material],
        exposure_ev: float | None,
    ) -> None:  # fmt: skip
        """Go to a camera, and to the room of a variant with a light mix and edited materials; undo does not go back."""
        state = self.mode.state
        stored, room = state.materials.edits.stored, {**state.states.all, **state.states.variants}[variant or BAKED]
        room = room.model_copy(update={"materials": {**room.materials, **edits}, "light": light or room.light})
        state.materials.edits.begin_from(WalkSession(now=room, states=dict(stored)))
        if camera is not None:
            state.navigation.jump(camera)
        if exposure_ev is not None:
            state.meter.expose_wanted = False
            state.look.expose(exposure_ev)

    @property
    def image(self) -> NDArray[np.uint8]:
        """The picture (height, width, 4) as shown; a whole frame if no browser has asked for one yet."""
        if self._sent is not None:
            return self._sent
        pace, self.screen.picture = self.screen.pace, Rect(0, 0, *self._size)
        pace.adaptive = False
        for _ in range(2):  # the first may meter the exposure
            self.mode.drawing.update(self.screen.picture, 1.0)
        pace.adaptive = True
        return self._composed()

    @property
    def radiance(self) -> Floats:
        """The picture (height, width, 3) as it is now, in W/(sr m^2)."""
        assert self.image is not None, "drawn once"
        return self._pictures.shown[0].read()

    def close(self) -> None:
        """Stop background work and free the device; may be called again."""
        if not self.closed:
            self.closed = True
            self.widget.close()
            self.canvas.close()
            self.mode.drawing.close()
            self.mode.close()
            self.mode.drawing.device.destroy()

    def _failed(self, error: Exception) -> None:
        self.controls.say([f"stopped: {error}"])
        self.close()
        raise error

    def _draw(self) -> None:
        super()._draw()
        if self.closed:
            return
        image = self._composed()
        if self._sent is not None and np.array_equal(image, self._sent):
            raise wgpu.DrawCancelled
        self._sent = image
        self._context.set_bitmap(image)

    def _resized(self, event: dict[str, Any]) -> None:
        """Send a picture, also to a second place in the notebook that shows this view."""
        self._sent = None
        self.touched()

    def _show(self) -> None:
        screen = self.screen
        if self._extra_frames <= 1:
            self.mode.state.materials.edits.end_stroke()
        screen.pace.answering = self._extra_frames > 0
        width, height = self.canvas.get_logical_size()
        screen.picture = Rect(0, 0, max(1, round(width)), max(1, round(height)))
        self.mode.drawing.update(screen.picture, self.canvas.get_pixel_ratio())
        if screen.save_wanted:
            screen.save_wanted = False
            self.mode.drawing.save()
        self.controls.follow()
        if screen.close_wanted:
            self._loop.call_soon(self.close)

    def _composed(self) -> NDArray[np.uint8]:
        """The picture read back, with the outline of the selection over it."""
        drawing = self.mode.drawing
        image = np.array(texels(drawing.device, drawing.views[0].texture))
        if (outline := drawing.images.get("outline")) is not None:
            draw_over(image, texels(drawing.device, outline.texture))
        image[..., 3] = 255
        return image


def draw_over(image: NDArray[np.uint8], over: NDArray[np.uint8]) -> None:
    """Blend a picture with an alpha channel over an image (height, width, 4) that may be smaller."""
    rows, columns = ((np.arange(n) * m) // n for n, m in zip(image.shape[:2], over.shape[:2], strict=True))
    over = over[np.ix_(rows, columns)]
    share = over[..., 3:] / np.float32(255)
    image[..., :3] = (share * over[..., :3] + (1 - share) * image[..., :3] + 0.5).astype(np.uint8)
