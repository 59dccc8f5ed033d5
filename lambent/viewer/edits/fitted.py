"""Pictures of one size as textures: A and B, fitted into the window or at one pixel per pixel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import wgpu

from lambent.core.errors import UserError
from lambent.core.light.false_colour import Range, with_scale
from lambent.core.light.photometry import LUMINANCE
from lambent.core.pictures.images import write_image, write_shown
from lambent.core.plain import plain_name
from lambent.realtime.gpu.device import adapter_info
from lambent.viewer.edits.edits import unused
from lambent.viewer.edits.shown import Shown
from lambent.viewer.edits.tone import Bytes
from lambent.viewer.look import Look
from lambent.viewer.mode import Drawing
from lambent.viewer.screen import Rect, Screen, Statistics

FORMAT = "rgba8unorm"  # values are encoded


class FittedFrame(Protocol):
    """A picture, the picture A that it is compared with, if any, and the time that it took."""

    @property
    def shown(self) -> Shown: ...
    @property
    def compared(self) -> Shown | None: ...
    @property
    def seconds(self) -> float: ...


class Fitted(Protocol):
    """State of a mode with pictures of a fixed `size` (width, height); `scale` is that of their false colours."""

    screen: Screen
    look: Look
    pixel_exact: bool

    @property
    def name(self) -> str: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def scale(self) -> Range | None: ...
    def take(self) -> FittedFrame | None: ...
    def close(self) -> None: ...


class FittedDrawing(Drawing):
    """Uploads the last frame."""

    def __init__(self, device: Any, state: Fitted) -> None:
        super().__init__(device)
        self._fitted, self._ratio = state, 1.0
        self._textures = [self._texture(*state.size) for _ in "AB"]
        self._pair = [texture.create_view() for texture in self._textures]
        # A second view of B: Dear ImGui's backend drops a view one frame after its name changes.
        self._alone = [self._textures[1].create_view()]
        self._put: list[Shown | None] = [None, None]
        self._frame: FittedFrame | None = None
        self._adapter = adapter_info(device).name if device is not None else ""

    @property
    def views(self) -> Sequence[Any]:
        """A and B in a comparison, else only the picture."""
        return self._pair if self.divider is not None else self._alone

    def within(self, place: Rect) -> Rect:
        """The largest centred place of the picture's aspect, or a place of its pixel size."""
        width, height = self._fitted.size
        scale = min(place.width / width, place.height / height)
        if self._fitted.pixel_exact:
            scale = 1 / self._ratio
        wide, high = max(1, round(scale * width)), max(1, round(scale * height))
        return Rect(place.x + (place.width - wide) // 2, place.y + (place.height - high) // 2, wide, high)

    def update(self, place: Rect, pixel_ratio: float) -> None:
        """Upload the changes of the last frame."""
        self._ratio, state = pixel_ratio, self._fitted
        frame = state.take()
        if frame is None or frame is self._frame:
            return
        self._frame = frame
        for k, shown in enumerate((frame.compared, frame.shown)):
            if shown is not None and shown is not self._put[k]:
                shown.put(self._textures[k])
                self._put[k] = shown
        state.screen.statistics = Statistics(self._adapter, frame_ms=1e3 * frame.seconds, resolution=state.size)

    def save(self) -> None:
        """Write the picture as shown (PNG) and as radiance (EXR); in a comparison also the picture A."""
        frame, screen = self._frame, self._fitted.screen
        if frame is None:
            screen.say("picture not saved: nothing is drawn yet")
            return
        stem = unused(screen.folder, plain_name(self._fitted.name, "scene"), ".png", ".exr", "-A.png", "-A.exr")
        pictures = [("", frame.shown)] + ([("-A", frame.compared)] if frame.compared is not None else [])
        try:
            for ending, shown in pictures:
                write_image(screen.folder / f"{stem}{ending}.exr", shown.radiance)
                write_shown(screen.folder / f"{stem}{ending}.png", self._with_scale(shown.bytes[..., :3]))
        except (UserError, OSError) as error:
            screen.say(f"picture not saved: {error}")
        else:
            screen.say(f"saved {stem}.png and {stem}.exr")

    def close(self) -> None:
        """Stop background work."""
        self._fitted.close()

    def _with_scale(self, shown: Bytes) -> Bytes:
        scale = self._fitted.scale
        return with_scale(shown, scale, LUMINANCE.unit) if scale is not None else shown

    def _texture(self, width: int, height: int) -> Any:
        usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
        return self.device.create_texture(size=(width, height, 1), format=FORMAT, usage=usage)
