"""The preview's pictures, drawn by the real-time renderer: A and, in a comparison, B."""

from __future__ import annotations

from typing import Any

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.materials.document import Material
from lambent.realtime.objects.unbaked import unbaked_scene, with_diffuse_light
from lambent.realtime.renderer import Renderer
from lambent.viewer.mode import Divider
from lambent.viewer.modes.material.mode import MaterialState
from lambent.viewer.modes.material.preview import OBJECT, SHAPES, with_lamp
from lambent.viewer.picture import Pair, Picture, size_px
from lambent.viewer.screen import Rect

KEPT = 4  # cached pictures
LAMP_SHAPE = "sheet before a lamp"


class Stage(Pair):
    """Draws a preview's shape and environment with the materials of its editor."""

    def __init__(self, device: Any, state: MaterialState) -> None:
        super().__init__(device)
        self._state = state
        self._lights: dict[str, Floats] = {}
        self._pictures: dict[tuple[str, str, str], Picture] = {}
        self._lit_by: str | None = None  # the last environment that was loaded

    @property
    def divider(self) -> Divider | None:
        return self._state.preview.divider if len(self.shown) == 2 else None

    def update(self, place: Rect, pixel_ratio: float) -> None:
        """Draw the due frames."""
        state, subject = self._state, self._state.editor.subject
        self._have_light()
        materials = {"A": subject.material}
        if subject.compared is not None:
            materials["B"] = subject.compared
        pictures = [self._picture(which) for which in materials]
        self.shown = tuple(pictures)
        size, camera = size_px(place, pixel_ratio), state.navigation.camera
        # A comes last: the window shows its statistics.
        for picture, material in reversed(list(zip(pictures, materials.values(), strict=True))):
            picture.update(state.look.frame(camera, size, {subject.name: material}))

    def save(self) -> None:
        """Write the picture of A, and of B if there is one."""
        for picture in self.shown:
            assert isinstance(picture, Picture), "as `update` made them"
            picture.save(self._state.editor.subject.name)

    def _have_light(self) -> None:
        """Load the chosen environment; on failure say so and keep the previous one."""
        preview = self._state.preview
        if preview.environment not in self._lights:
            try:
                self._lights[preview.environment] = preview.light(preview.environment)
            except UserError as error:
                self._state.screen.say(f"environment not loaded: {error}")
                preview.files.pop(preview.environment, None)
                preview.environment = self._lit_by or "studio"
                self._have_light()
        self._lit_by = preview.environment

    def _picture(self, which: str) -> Picture:
        preview = self._state.preview
        key = (which, preview.shape, preview.environment)
        picture = self._pictures.pop(key, None) or self._made(preview.shape, preview.environment)
        self._pictures[key] = picture  # most recently shown last
        while len(self._pictures) > KEPT:
            del self._pictures[next(iter(self._pictures))]
        return picture

    def _made(self, shape: str, environment: str) -> Picture:
        cube, name = self._lights[environment], self._state.editor.subject.name
        light = with_lamp(cube) if shape == LAMP_SHAPE else cube
        scene = unbaked_scene({OBJECT: SHAPES[shape]()}, Material(name=name), light, name=name)
        return Picture(Renderer(self.device, with_diffuse_light(scene)), self._state.screen)
