"""The window: passes events to a mode, draws due frames, sleeps when nothing changes.

Importing this needs a display.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import glfw
import numpy as np
import wgpu
from imgui_bundle import imgui
from rendercanvas.glfw import RenderCanvas, loop

from lambent.viewer import layout
from lambent.viewer.gamepad import GlfwPads, PadWatch
from lambent.viewer.interface import renderer
from lambent.viewer.mode import Image, Mode
from lambent.viewer.pacing import Beat
from lambent.viewer.screen import least
from lambent.viewer.settings import settings_file

MAX_FPS = 60
BEFORE_IMGUI = -100  # Dear ImGui's handlers (order -99) stop events, which would hide hovers from ours
SETTLE_FRAMES = 3  # Dear ImGui shows what an event did one or two frames later
FOR_IMGUI_ONLY = ("char", "resize")
EVENTS = ("pointer_down", "pointer_move", "pointer_up", "pointer_leave", "wheel", "key_down", "key_up", *FOR_IMGUI_ONLY)


def _interrupt_between_frames() -> None:
    """Let Ctrl-C close the window between two frames.

    The event loop's own handler closes the canvas at once. Within a frame this destroys the surface being drawn to, and
    the graphics library aborts the process.
    """
    close = signal.getsignal(signal.SIGINT)
    if callable(close):
        signal.signal(signal.SIGINT, lambda number, stack: loop.call_soon(close, number, stack))


class Window:
    """One window of rendercanvas with Dear ImGui. `run` shows it until it is closed."""

    def __init__(self, mode: Mode, *, size: tuple[int, int], frames: int | None = None) -> None:
        self.mode, self.screen, self._frames, self._device = mode, mode.screen, frames, mode.drawing.device
        self.canvas = RenderCanvas(size=size, title=f"Lambent: {mode.title}", max_fps=MAX_FPS)
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
        self._extra_frames = 0
        self._told: list[str] = []  # messages of the last frame
        self._drawn_s = self.screen.clock()
        self._beat = Beat(1 / MAX_FPS)
        self._moving = False  # whether something moves between this frame and the next
        self._wake_at_s: float | None = None
        self._error: Exception | None = None
        self.canvas.add_event_handler(self._on_event, *EVENTS, order=BEFORE_IMGUI)
        self._woken = False  # by background work, since the last frame
        self.screen.wake = self._wake
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

    @contextmanager
    def _watched(self) -> Iterator[None]:
        """Close at the first error, which `run` raises; the event loop would only log it.

        A frame for which the display has no image in time is skipped by the canvas, and drawn again.
        """
        try:
            yield
        except wgpu.DrawCancelled:
            self.canvas.request_draw()
            raise
        except Exception as error:  # noqa: BLE001
            self._error = self._error or error
            loop.call_soon(self.canvas.close)

    def _on_event(self, event: dict[str, Any]) -> None:
        self._extra_frames, self.screen.pace.touched_s = SETTLE_FRAMES, self.screen.clock()
        self.canvas.request_draw()
        if event["event_type"] in FOR_IMGUI_ONLY:
            return
        with self._watched():
            io = self._imgui.backend.io
            has_keys = io.want_text_input or io.want_capture_keyboard or self.screen.asks_to_close
            self.mode.input.handle(event, ui_has_mouse=self._popup_open, ui_has_keys=has_keys)

    def _draw(self) -> None:
        with self._watched():
            # The canvas sleeps from the start of a frame and wakes late; without correction, delays add up.
            self.canvas.set_update_mode("ondemand", max_fps=1 / self._beat.wait_s(self.screen.clock()))
            self._advance()
            self._show()
            self._schedule()

    def _advance(self) -> None:
        """Advance the mode to the present time."""
        now_s = self.screen.clock()
        since_last_s, self._drawn_s = now_s - self._drawn_s, now_s
        self.mode.input.steer(self._pad.now, since_last_s if self._moving else 0.0)
        self.mode.advance(since_last_s if self._moving else 0.0)  # a sleep before the first step is no walking
        if (enter := self.screen.enter) is not None:
            self.screen.enter, self.mode = None, enter(self.mode)
        if self.screen.close_wanted or self.screen.closes:
            self._want_close()
        self.screen.drop_old_messages()
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
        """Request the next frame if something will change; otherwise sleep."""
        if self._frames is not None:
            self._frames -= 1
            if self._frames <= 0:
                loop.call_soon(self.canvas.close)
        # Dear ImGui handles quick key presses and clicks one by one, one per frame.
        unread = len(self._imgui.imgui_context.input_events_queue) > 0
        told = [message.text for message in self.screen.messages]
        if unread or told != self._told:  # messages from the background also change sizes
            self._extra_frames = SETTLE_FRAMES
        else:
            self._extra_frames = max(0, self._extra_frames - 1)
        self._told = told
        self._moving = self.mode.moving
        woken, self._woken = self._woken, False  # Dear ImGui fits new text to its table one frame later
        if self._moving or self._extra_frames or self._frames is not None or woken:
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
            loop.call_later(seconds, wake)
        else:
            wake()
