"""The window: passes events to a mode, draws due frames, sleeps when nothing changes.

Importing this needs a display.
"""

from __future__ import annotations

import gc
import signal
from collections.abc import Sequence
from typing import Any

import glfw
import numpy as np
import wgpu
from imgui_bundle import imgui
from rendercanvas.glfw import RenderCanvas, loop

from lambent.viewer import layout
from lambent.viewer.canvas.frames import EVENTS, SETTLE_FRAMES, Frames
from lambent.viewer.gamepad import GlfwPads, PadWatch
from lambent.viewer.interface import renderer
from lambent.viewer.mode import Image, Mode
from lambent.viewer.pacing import Beat
from lambent.viewer.settings import settings_file

MAX_FPS = 60
BEFORE_IMGUI = -100  # Dear ImGui's handlers (order -99) stop events, which would hide hovers from ours
FOR_IMGUI_ONLY = ("char", "resize")


def _interrupt_between_frames() -> None:
    """Let Ctrl-C close the window between two frames.

    The event loop's own handler closes the canvas at once. Within a frame this destroys the surface being drawn to, and
    the graphics library aborts the process.
    """
    close = signal.getsignal(signal.SIGINT)
    if callable(close):
        signal.signal(signal.SIGINT, lambda number, stack: loop.call_soon(close, number, stack))


class Window(Frames):
    """One window of rendercanvas with Dear ImGui. `run` shows it until it is closed."""

    def __init__(self, mode: Mode, *, size: tuple[int, int], frames: int | None = None) -> None:
        canvas = RenderCanvas(size=size, title=f"Lambent: {mode.title}", max_fps=MAX_FPS)
        super().__init__(mode, canvas, loop)
        self._frames, self._device = frames, mode.drawing.device
        context = self.canvas.get_wgpu_context()
        # Not an sRGB format: Dear ImGui blends encoded colours, and the picture is already encoded.
        surface = context.get_preferred_format(self._device.adapter).removesuffix("-srgb")
        context.configure(device=self._device, format=surface)
        self._imgui = renderer(self._device, self.canvas)
        self._imgui.set_gui(self._interface)
        self._imgui.KEY_MAP = {**self._imgui.KEY_MAP, " ": imgui.Key.space}  # which wgpu's renderer lacks
        layout.set_style()
        self._context = context
        self._textures: dict[str, Any] = {}  # Dear ImGui textures, by the layout's names
        self._made_of: dict[str, Any] = {}  # the view or array that each texture shows
        self._popup_open = False
        self._beat = Beat(1 / MAX_FPS)
        self._error: Exception | None = None
        self.canvas.add_event_handler(self._on_event, *EVENTS, *FOR_IMGUI_ONLY, order=BEFORE_IMGUI)
        self.screen.remembered.open(settings_file())
        glfw.set_drop_callback(self.canvas._window, self._dropped)  # type: ignore[arg-type]
        self._take_the_close_button()
        self._pad = PadWatch(GlfwPads(glfw), loop.call_later, self._wake)
        glfw.set_joystick_callback(self._pad.connected)

    def run(self) -> None:
        """Show the window until it is closed; raise the first error."""
        self.canvas.request_draw(self._draw)
        loop.call_soon(_interrupt_between_frames)
        loop.call_soon(self._pad.connected)
        loop.run()
        if self._error is not None:
            raise self._error

    def _failed(self, error: Exception) -> None:
        """Close at the first error, which `run` raises; the event loop would only log it."""
        self._error = self._error or error
        loop.call_soon(self.canvas.close)

    @property
    def _captured(self) -> tuple[bool, bool]:
        io = self._imgui.backend.io
        return self._popup_open, io.want_text_input or io.want_capture_keyboard or self.screen.asks_to_close

    def _draw(self) -> None:
        # The canvas sleeps from the start of a frame and wakes late; without correction, delays add up.
        self.canvas.set_update_mode("ondemand", max_fps=1 / self._beat.wait_s(self.screen.clock()))
        super()._draw()

    def _advance(self, since_last_s: float) -> None:
        self.mode.input.steer(self._pad.now, since_last_s if self._moving else 0.0)
        super()._advance(since_last_s)
        if (enter := self.screen.enter) is not None:
            self.screen.enter, self.mode = None, enter(self.mode)
            gc.collect()  # a mode lies in cycles, and its renderer holds textures that Python's counts do not see
        if self.screen.close_wanted or self.screen.closes:
            self._want_close()
        self._imgui.backend.io.delta_time = min(max(since_last_s, 1e-4), 1.0)

    def _show(self) -> None:
        """Draw an outdated picture, then the interface over it."""
        screen, drawing = self.screen, self.mode.drawing
        screen.pace.answering = self._extra_frames > 0
        screen.picture = layout.regions(self.mode, *self.canvas.get_logical_size()).picture
        drawing.update(screen.picture, self.canvas.get_pixel_ratio())
        self._register()
        if screen.save_wanted:
            screen.save_wanted = False
            drawing.save()
        self._clear()
        self._imgui.render()

    def _register(self) -> None:
        """Register new textures of the layout with Dear ImGui."""
        drawing, side_plots = self.mode.drawing, self.mode.side_plots
        wanted: dict[str, Any] = {f"picture {'AB'[i]}": view for i, view in enumerate(drawing.views)}
        wanted |= drawing.images
        if side_plots is not None:
            wanted |= side_plots.images
        wanted |= self.screen.images
        known = {id(source): self._textures[name] for name, source in self._made_of.items()}
        shown = {id(source) for source in wanted.values()}
        # By their source: Dear ImGui forgets a view after the frame, also one that got another name in it.
        for number, texture in known.items():
            if number not in shown:
                self._imgui.backend.unregister_texture(texture)
        for source in wanted.values():
            if id(source) not in known:
                view = self._uploaded(source) if isinstance(source, np.ndarray) else source
                known[id(source)] = self._imgui.backend.register_texture(view)
        self._textures = {name: known[id(source)] for name, source in wanted.items()}
        self._made_of = wanted

    def _uploaded(self, image: Image) -> Any:
        """View of a texture with an RGBA picture (H, W, 4)."""
        height, width = image.shape[:2]
        usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
        texture = self._device.create_texture(size=(width, height, 1), format="rgba8unorm", usage=usage)
        rows = {"bytes_per_row": 4 * width, "rows_per_image": height}
        self._device.queue.write_texture({"texture": texture}, image, rows, (width, height, 1))
        return texture.create_view()

    def _dropped(self, window: Any, paths: Sequence[str]) -> None:
        """Pass dropped files to the mode, and where the mouse is; the canvas has no event for them."""
        # While another program drags, the canvas tells of no moves.
        shares = (at / size for at, size in zip(glfw.get_cursor_pos(window), glfw.get_window_size(window), strict=True))
        x, y = (share * size for share, size in zip(shares, self.canvas.get_logical_size(), strict=True))
        with self._watched():
            moved = {"event_type": "pointer_move", "x": x, "y": y}
            self.mode.input.handle(moved, ui_has_mouse=self._popup_open, ui_has_keys=False)
            for path in paths:
                self.mode.drop(path)
        self._extra_frames = SETTLE_FRAMES
        self.canvas.request_draw()

    def _take_the_close_button(self) -> None:
        """Ask before the window closes with unsaved work."""

        def pressed(_: object) -> None:
            glfw.set_window_should_close(self.canvas._window, 0)
            with self._watched():
                self._want_close()

        glfw.set_window_close_callback(self.canvas._window, pressed)

    def _want_close(self) -> None:
        self.screen.close_wanted = False
        if self.mode.unsaved and not self.screen.closes:
            self.screen.asks_to_close = True
            self._extra_frames = SETTLE_FRAMES
            self.canvas.request_draw()
        else:
            loop.call_soon(self.canvas.close)

    def _interface(self) -> None:
        self._popup_open = layout.draw(self.mode, self._textures)

    def _clear(self) -> None:
        encoder = self._device.create_command_encoder()
        view = self._context.get_current_texture().create_view()
        attachment = {"view": view, "load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 1)}
        encoder.begin_render_pass(color_attachments=[attachment]).end()
        self._device.queue.submit([encoder.finish()])

    def _schedule(self) -> None:
        if self._frames is not None:
            self._frames -= 1
            if self._frames <= 0:
                loop.call_soon(self.canvas.close)
            self.canvas.request_draw()
        super()._schedule()

    @property
    def _unread(self) -> bool:
        """Dear ImGui handles quick key presses and clicks one by one, one per frame."""
        return len(self._imgui.imgui_context.input_events_queue) > 0
