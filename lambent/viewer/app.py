"""The window: opens a store, carries events into the state, draws what the state says, sleeps when nothing changes."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import wgpu

from lambent.core.errors import UserError
from lambent.realtime.baked import read_baked
from lambent.realtime.device import open_device
from lambent.realtime.renderer import Renderer
from lambent.realtime.resources import device_needs
from lambent.store.store import Store
from lambent.viewer.comparison import Comparison
from lambent.viewer.filming import FilmOptions
from lambent.viewer.input import Input, Rect
from lambent.viewer.lost import keep_walk, kept
from lambent.viewer.picking import Geometry
from lambent.viewer.picture import CHOICES
from lambent.viewer.pictures import Pictures
from lambent.viewer.state import Mode, ViewerState
from lambent.viewer.views import SavedViews

MODES: dict[str, Mode] = {"walk": "walk", "view": "orbit"}
MAX_FPS = 60
BEFORE_IMGUI = -100  # its own handlers stand at -99 and stop what they use, so that ours would not see a hover
POLL_S = 0.1  # between two looks at what the editor does in the background
SETTLE_FRAMES = 3  # Dear ImGui shows what an event did one or two frames later
FOR_IMGUI_ONLY = ("char", "resize", "pointer_leave")
EVENTS = ("pointer_down", "pointer_move", "pointer_up", "wheel", "key_down", "key_up", *FOR_IMGUI_ONLY)


def run(
    store_path: Path,
    mode: str = "walk",
    *,
    size: tuple[int, int] = (1680, 1050),
    frames: int | None = None,
    folder: Path | None = None,
) -> None:
    """Show a baked store in a window; returns when it is closed.

    Parameters
    ----------
    store_path : Path
        A store that holds at least geometry and the scene record.
    mode : {"walk", "view"}
        Start on foot, or orbiting the camera's target.
    size : (width, height)
        Of the window, in logical pixels.
    frames : int, optional
        Draw this many frames without a pause, then close.
    folder : Path, optional
        Where pictures and materials are saved; by default the working folder.

    Raises
    ------
    UserError
        Where there is no display or adapter, the store is none, or the mode is unknown.
    """
    if mode not in MODES:
        raise UserError("unknown mode", got=mode, expected=" or ".join(MODES))
    check_display()
    store = Store.open(store_path)
    scene = read_baked(store)
    state = ViewerState.of(scene.record, CHOICES, MODES[mode], folder=folder or Path.cwd(), missing=scene.missing)
    state.views = SavedViews(scene.record, store.folder, state.say)
    fault = state.views.load()
    if fault is not None:
        state.missing = (*state.missing, fault)  # stays in sight: a message is gone before the window is there
    state.comparison, state.film, state.notes = Comparison(), FilmOptions(), light_map_notes(store)
    state.light_map_noise = scene.noise is not None
    geometry = Geometry(scene.positions, scene.faces, scene.record.objects)
    pictures = Pictures(Renderer(open_device(device_needs(scene)), scene))
    window = Window(state, geometry, pictures, size=size, frames=frames)
    with kept(state, end=lambda: pictures.close(state)):
        try:
            window.run()
        finally:
            pictures.close(state)
    keep_walk(state)
    if state.unsaved:
        sys.stderr.write(f"lambent: note: {', '.join(state.unsaved)} changed and not saved\n")


def light_map_notes(store: Store) -> tuple[str, ...]:
    """What the bake says of its light map: its noise and samples, per side."""
    notes = []
    for name in ("light_map/irradiance", "light_map/irradiance_back"):
        meta = store.artefact(name).meta if name in store else {}
        if isinstance(meta.get("noise"), float) and isinstance(meta.get("samples"), float):
            side = "far side" if name.endswith("back") else "light map"
            notes.append(
                f"{side}: noise {100 * meta['noise']:.1f} % before denoising, {meta['samples']:.0f} samples a texel"
            )
    return tuple(notes)


def check_display(hint: str = "use `lambent render`, or `lambent demo --headless`") -> None:
    """`UserError` where no window can be opened; `hint` says what to do instead."""
    import glfw

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", glfw.GLFWError)
        if not glfw.init():
            raise UserError("no display", hint=hint)


class Drawing(Protocol):
    """What the window shows a state by: `Picture`, or the editor's `Stage`."""

    device: Any

    @property
    def views(self) -> tuple[Any, ...]: ...

    @property
    def images(self) -> Mapping[str, np.ndarray[Any, np.dtype[np.uint8]]]: ...

    def update(self, state: ViewerState, rect: Rect, pixel_ratio: float) -> None: ...

    def wait_s(self, state: ViewerState) -> float | None: ...

    @property
    def under_way(self) -> bool: ...

    def work(self, state: ViewerState) -> bool: ...

    def save(self, state: ViewerState) -> object: ...


class FirstError:
    """Keeps the first error raised inside it and calls `then`; the event loop would log it and go on."""

    def __init__(self, then: Callable[[], None]) -> None:
        self._then = then
        self.error: Exception | None = None

    def __enter__(self) -> None:
        return None

    def __exit__(self, _: object, error: BaseException | None, __: object) -> bool:
        if not isinstance(error, Exception):
            return False
        self.error = self.error or error
        self._then()
        return True


class Window:
    """One window of rendercanvas with Dear ImGui. `run` shows it until it is closed."""

    def __init__(
        self,
        state: ViewerState,
        geometry: Geometry,
        picture: Drawing,
        *,
        size: tuple[int, int],
        frames: int | None = None,
    ) -> None:
        # Imported here: they need a display.
        from rendercanvas.glfw import RenderCanvas, loop
        from wgpu.utils.imgui import ImguiRenderer

        from lambent.viewer import layout

        self.state, self._picture, self._frames = state, picture, frames
        self._loop, self._layout, self._device = loop, layout, picture.device
        self.canvas = RenderCanvas(size=size, title=f"Lambent: {state.scene.name}", max_fps=MAX_FPS)
        context = self.canvas.get_wgpu_context()
        # Not an sRGB format: Dear ImGui's colours are meant to be blended as they are, and the picture comes encoded.
        surface = context.get_preferred_format(picture.device.adapter).removesuffix("-srgb")
        context.configure(device=picture.device, format=surface)
        self._imgui = ImguiRenderer(picture.device, self.canvas)
        self._imgui.set_gui(self._gui)
        layout.set_style()
        self._context = context
        self._textures: dict[str, Any] = {}  # what Dear ImGui knows, by the names that the layout uses
        self._made_of: dict[str, Any] = {}  # name -> the view or the array that its texture shows
        self._input = Input(geometry, layout.picture_rect(state, *size))
        self._popup_open = False
        self._extra_frames = 0
        self._drawn_s = state.clock()
        self._moving = False  # between this frame and the next
        self._wake_at_s: float | None = None
        self._working = False  # between two parts of a frame at rest
        self._failed = FirstError(then=lambda: loop.call_soon(self.canvas.close))
        self.canvas.add_event_handler(self._on_event, *EVENTS, order=BEFORE_IMGUI)
        self._take_dropped_files()

    def run(self) -> None:
        """Show the window until it is closed; raises what went wrong meanwhile."""
        self.canvas.request_draw(self._draw)
        self._loop.run()
        self.state.close_editor()
        if self._failed.error is not None:
            raise self._failed.error

    def _on_event(self, event: dict[str, Any]) -> None:
        self._extra_frames, self.state.touched_s = SETTLE_FRAMES, self.state.clock()
        self.canvas.request_draw()
        if event["event_type"] == "pointer_leave":
            self.state.meter.cursor = None
        if event["event_type"] in FOR_IMGUI_ONLY:
            return
        with self._failed:
            io = self._imgui.backend.io
            has_keys = io.want_text_input or io.want_capture_keyboard
            self._input.handle(
                self.state,
                event,
                ui_has_mouse=self._popup_open,
                ui_has_keys=has_keys,
            )

    def _draw(self) -> None:
        with self._failed:
            self._advance()
            self._show()
            self._schedule()

    def _advance(self) -> None:
        """Bring the state to this moment: walk, go on along the path, forget old messages."""
        state, now_s = self.state, self.state.clock()
        since_last_s, self._drawn_s = now_s - self._drawn_s, now_s
        dt_s = since_last_s if self._moving else 0.0  # the sleep before a first step is not walked through
        self._input.walk(state, dt_s)
        state.play(dt_s)
        if state.recorder.take(state.camera, now_s):
            state.record()
        state.drop_old_messages()
        if state.editor is not None:
            state.editor.tick()
        self._imgui.backend.io.delta_time = min(max(since_last_s, 1e-4), 1.0)

    def _show(self) -> None:
        """Draw the picture where it is out of date, then the interface over it."""
        state = self.state
        state.answering = self._extra_frames > 0
        self._input.picture = self._layout.picture_rect(state, *self.canvas.get_logical_size())
        self._picture.update(state, self._input.picture, self.canvas.get_pixel_ratio())
        self._register()
        if state.screenshot_wanted:
            state.screenshot_wanted = False
            self._picture.save(state)
        self._clear()
        self._imgui.render()

    def _register(self) -> None:
        """Tell Dear ImGui of the pictures' textures, and of the editor's, where they are new ones."""
        wanted: dict[str, Any] = {f"picture {'AB'[i]}": view for i, view in enumerate(self._picture.views)}
        wanted |= self._picture.images
        if self.state.editor is not None:
            wanted |= self.state.editor.shown.images
        for name in [name for name in self._textures if self._made_of[name] is not wanted.get(name)]:
            self._imgui.backend.unregister_texture(self._textures.pop(name))
            del self._made_of[name]
        for name, source in wanted.items():
            if name not in self._textures:
                view = self._uploaded(source) if isinstance(source, np.ndarray) else source
                self._textures[name], self._made_of[name] = self._imgui.backend.register_texture(view), source

    def _uploaded(self, image: np.ndarray[Any, np.dtype[np.uint8]]) -> Any:
        """View of a texture that holds an RGBA picture (H, W, 4)."""
        height, width = image.shape[:2]
        usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
        texture = self._device.create_texture(size=(width, height, 1), format="rgba8unorm", usage=usage)
        layout = {"bytes_per_row": 4 * width, "rows_per_image": height}
        self._device.queue.write_texture({"texture": texture}, image, layout, (width, height, 1))
        return texture.create_view()

    def _take_dropped_files(self) -> None:
        """Files dropped onto the window are for the editor; the canvas has no event for that."""
        import glfw

        def dropped(_: object, paths: Any) -> None:
            with self._failed:
                for path in paths:
                    if self.state.editor is not None:
                        self.state.editor.open(path)
            self._extra_frames = SETTLE_FRAMES
            self.canvas.request_draw()

        glfw.set_drop_callback(self.canvas._window, dropped)  # type: ignore[arg-type]

    def _gui(self) -> None:
        self._popup_open = self._layout.draw(self.state, self._textures)

    def _clear(self) -> None:
        encoder = self._device.create_command_encoder()
        view = self._context.get_current_texture().create_view()
        attachment = {"view": view, "load_op": "clear", "store_op": "store", "clear_value": (0, 0, 0, 1)}
        encoder.begin_render_pass(color_attachments=[attachment]).end()
        self._device.queue.submit([encoder.finish()])

    def _schedule(self) -> None:
        """Ask for the next frame where there will be something new; otherwise sleep."""
        if self._frames is not None:
            self._frames -= 1
            if self._frames <= 0:
                self._loop.call_soon(self.canvas.close)
        # Dear ImGui takes quick typing and clicking up one by one, a frame each.
        unread = len(self._imgui.imgui_context.input_events_queue) > 0
        self._extra_frames = SETTLE_FRAMES if unread else max(0, self._extra_frames - 1)
        self._moving = self._input.walking or self.state.playing
        if self._moving or self._extra_frames or self._frames is not None:
            self.canvas.request_draw()
        if self._picture.under_way and not self._working:
            self._working = True
            self._loop.call_later(0, self._work)
        waits = [m.until_s - self.state.clock() for m in self.state.messages]
        if self.state.editor is not None and self.state.editor.busy:
            waits.append(POLL_S)
        if self.state.recorder.on:
            waits.append(POLL_S)  # its clock is shown
        due = self._picture.wait_s(self.state)
        if due is not None:
            waits.append(due)
        if waits:
            self._wake_in(max(0.0, min(waits)))

    def _work(self) -> None:
        """Draw a part of a frame at rest; the loop looks at the events before the next one."""
        self._working = False
        if self.canvas.get_closed():
            return
        with self._failed:
            if self._picture.work(self.state):
                self.canvas.request_draw()
            elif self._picture.under_way:
                self._working = True
                self._loop.call_later(0, self._work)

    def _wake_in(self, seconds: float) -> None:
        at_s = self.state.clock() + seconds
        if self._wake_at_s is not None and self._wake_at_s <= at_s:
            return  # an earlier frame will look again
        self._wake_at_s = at_s

        def wake() -> None:
            if self._wake_at_s == at_s:
                self._wake_at_s = None
                self.canvas.request_draw()

        if seconds > 0:
            self._loop.call_later(seconds, wake)
        else:
            wake()
