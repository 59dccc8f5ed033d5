"""The edited picture as textures: A and B, fitted into the window or at one pixel per pixel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import wgpu

from lambent.core.errors import UserError
from lambent.core.light.false_colour import with_scale
from lambent.core.light.photometry import LUMINANCE
from lambent.core.pictures.images import write_image, write_shown
from lambent.core.plain import plain_name
from lambent.realtime.gpu.device import adapter_info
from lambent.viewer.edits.edits import unused
from lambent.viewer.mode import Divider, Drawing, Image
from lambent.viewer.modes.edit.painter import Frame
from lambent.viewer.modes.edit.shown import Shown
from lambent.viewer.modes.edit.state import EditState
from lambent.viewer.modes.edit.tone import Bytes
from lambent.viewer.screen import Rect, Statistics

FORMAT = "rgba8unorm"  # values are encoded


class EditDrawing(Drawing):
    """Uploads the painter's frames."""

    def __init__(self, device: Any, state: EditState) -> None:
        super().__init__(device)
        self._state, self._ratio = state, 1.0
        width, height = state.session.document.size
        self._textures = [self._texture(width, height) for _ in "AB"]
        self._pair = [texture.create_view() for texture in self._textures]
        # A second view of B: Dear ImGui's backend drops a view one frame after its name changes.
        self._alone = [self._textures[1].create_view()]
        self._put: list[Shown | None] = [None, None]
        self._outline: tuple[object, Image] | None = None
        self._frame: Frame | None = None
        self._adapter = adapter_info(device).name if device is not None else ""

    @property
    def views(self) -> list[Any]:
        """A and B in a comparison, else only the picture."""
        return self._pair if self.divider is not None else self._alone

    @property
    def divider(self) -> Divider | None:
        frame = self._frame
        return self._state.compared.divider if frame is not None and frame.compared is not None else None

    @property
    def images(self) -> Mapping[str, Image]:
        """The outline of the object under the mouse and, for a moment, of a new selection."""
        view, wanted = self._state.loading.view, self._state.outlined
        if view is None or not wanted:
            return {}
        if self._outline is None or self._outline[0] != wanted:
            self._outline = wanted, view.outline(set(wanted))
        return {"outline": self._outline[1]}

    def within(self, place: Rect) -> Rect:
        """The largest centred place of the picture's aspect, or a place of its pixel size."""
        width, height = self._state.session.document.size
        scale = min(place.width / width, place.height / height)
        if self._state.pixel_exact:
            scale = 1 / self._ratio
        wide, high = max(1, round(scale * width)), max(1, round(scale * height))
        return Rect(place.x + (place.width - wide) // 2, place.y + (place.height - high) // 2, wide, high)

    def update(self, place: Rect, pixel_ratio: float) -> None:
        """Upload the changes of the last frame."""
        self._ratio = pixel_ratio
        frame = self._state.painter.take()
        if frame is None or frame is self._frame:
            return
        self._frame = frame
        for k, shown in enumerate((frame.compared, frame.shown)):
            if shown is not None and shown is not self._put[k]:
                shown.put(self._textures[k])
                self._put[k] = shown
        size = self._state.session.document.size
        self._state.screen.statistics = Statistics(self._adapter, frame_ms=1e3 * frame.seconds, resolution=size)

    def save(self) -> None:
        """Write the picture as shown (PNG) and as radiance (EXR); in a comparison also the picture A."""
        frame, screen = self._frame, self._state.screen
        if frame is None:
            screen.say("picture not saved: nothing is drawn yet")
            return
        stem = unused(screen.folder, plain_name(self._state.subject.name, "scene"), ".png", ".exr", "-A.png", "-A.exr")
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
        self._state.close()

    def _with_scale(self, shown: Bytes) -> Bytes:
        scale = self._state.scale
        return with_scale(shown, scale, LUMINANCE.unit) if scale is not None else shown

    def _texture(self, width: int, height: int) -> Any:
        usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
        return self.device.create_texture(size=(width, height, 1), format=FORMAT, usage=usage)
