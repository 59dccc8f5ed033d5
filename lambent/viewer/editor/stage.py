"""The preview's pictures: A, and beside it B where two materials are compared; drawn by the renderer of the window."""

from __future__ import annotations

from typing import Any

from lambent.core.errors import UserError
from lambent.materials.document import Material
from lambent.realtime.renderer import Renderer
from lambent.realtime.unbaked import unbaked_scene, with_diffuse_light
from lambent.viewer.editor.preview import OBJECT, SHAPES, Floats, with_lamp
from lambent.viewer.input import Rect
from lambent.viewer.picture import Picture
from lambent.viewer.state import ViewerState

KEPT = 4  # pictures that were shown last are kept ready
LAMP_SHAPE = "sheet before a lamp"


class Stage:
    """Draws the preview of a state that has one; takes the place of `Picture` in the window."""

    def __init__(self, device: Any) -> None:
        self.device = device
        self._lights: dict[str, Floats] = {}
        self._pictures: dict[tuple[str, str, str], Picture] = {}
        self._shown: list[Picture] = []
        self._lit_by: str | None = None  # the environment that could be loaded last

    @property
    def images(self) -> dict[str, Any]:
        """None besides the pictures."""
        return {}

    @property
    def views(self) -> tuple[Any, ...]:
        """Views of the pictures A and, where there is one, B."""
        return tuple(picture.view for picture in self._shown)

    def update(self, state: ViewerState, rect: Rect, pixel_ratio: float) -> None:
        """Draw what is due."""
        preview, editor = state.preview, state.editor
        assert preview is not None and editor is not None, "a stage needs a preview"
        self._have_light(state)
        material, other = editor.material, editor.compared
        pictures = [(self._picture(state, "A"), material)]
        if other is not None:
            pictures.append((self._picture(state, "B"), other))
        for picture, shown in reversed(pictures):  # A last: its figures are the window's
            picture.update(state, rect, pixel_ratio, {editor.name: shown})
        self._shown = [picture for picture, _ in pictures]

    def wait_s(self, state: ViewerState) -> float | None:
        waits = [due for picture in self._shown if (due := picture.wait_s(state)) is not None]
        return min(waits, default=None)

    @property
    def under_way(self) -> bool:
        """Whether a frame at rest is being drawn in parts."""
        return any(picture.under_way for picture in self._shown)

    def work(self, state: ViewerState) -> bool:
        """Draw a part of it; whether there is a new picture to show."""
        busy = next((picture for picture in self._shown if picture.under_way), None)
        return busy is not None and busy.work(state)

    def save(self, state: ViewerState) -> None:
        """Write the picture of A, and of B where there is one."""
        for picture in self._shown:
            picture.save(state)

    def _have_light(self, state: ViewerState) -> None:
        """Load the chosen environment; where that cannot be, say so and keep the one before."""
        preview = state.preview
        assert preview is not None
        if preview.environment in self._lights:
            self._lit_by = preview.environment
            return
        try:
            self._lights[preview.environment] = preview.light(preview.environment)
        except UserError as error:
            state.say(f"environment not loaded: {error}")
            preview.files.pop(preview.environment, None)
            preview.environment = self._lit_by or "studio"
            self._have_light(state)

    def _picture(self, state: ViewerState, which: str) -> Picture:
        preview, editor = state.preview, state.editor
        assert preview is not None and editor is not None
        key = (which, preview.shape, preview.environment)
        picture = self._pictures.pop(key, None) or self._made(preview.shape, preview.environment, editor.name)
        self._pictures[key] = picture  # the last one shown is the last one in
        while len(self._pictures) > KEPT:
            del self._pictures[next(iter(self._pictures))]
        return picture

    def _made(self, shape: str, environment: str, name: str) -> Picture:
        cube = self._lights[environment]
        light = with_lamp(cube) if shape == LAMP_SHAPE else cube
        scene = unbaked_scene({OBJECT: SHAPES[shape]()}, Material(name=name), light, name=name)
        return Picture(Renderer(self.device, with_diffuse_light(scene)))
