"""A live view of a store in a notebook."""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING, Any

from lambent.api.materials import Material
from lambent.api.pictures import Picture, jpeg_of
from lambent.core.errors import UserError
from lambent.core.light.light_mix import in_words
from lambent.core.views.camera import Camera

if TYPE_CHECKING:
    from lambent.viewer.canvas.cell import Cell


class View:
    """A live view of a store, see `Store.view`. A still has the same room with
    `store.render(view.camera, light=view.light, edits=view.edits, exposure_ev=view.exposure_ev)`.
    """

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self._state = cell.mode.state

    @property
    def camera(self) -> Camera:
        """Where the view stands and looks; set it to go there."""
        return self._state.navigation.camera

    @camera.setter
    def camera(self, camera: Camera) -> None:
        self._state.navigation.jump(camera)
        self._cell.touched()

    @property
    def edits(self) -> dict[str, Material]:
        """Materials that differ from the baked ones, by name."""
        return {name: Material(one) for name, one in self._state.materials.edits.edited.items()}

    @property
    def light(self) -> dict[str, str]:
        """Light groups that differ from the bake, in the words of `render`."""
        return {name: in_words(mix) for name, mix in self._state.lights.mix.groups.items()}

    @property
    def exposure_ev(self) -> float:
        """Stops."""
        return self._state.look.exposure_ev

    @property
    def picture(self) -> Picture:
        """The picture as it is now: drawn in motion, traced at rest; a closed view raises `UserError`."""
        if self._cell.closed:
            raise UserError("is closed", field="view", hint="open another with `store.view()`")
        return Picture(self._cell.radiance, self.exposure_ev, self._state.look.display_transform)

    def close(self) -> None:
        """End the view, and free its graphics device; may be called again."""
        self._cell.close()

    def __repr__(self) -> str:
        name = self._state.scene.name
        return f"View({name!r}, closed)" if self._cell.closed else f"View({name!r}, {self.camera.name!r})"

    def _repr_mimebundle_(self, **options: Any) -> dict[str, Any]:
        """The widget; for what cannot show widgets, a picture."""
        if self._cell.closed:
            return {"text/plain": repr(self)}
        picture = base64.b64encode(jpeg_of(self._cell.image)).decode()
        return {**self._cell.widget._repr_mimebundle_(**options), "image/jpeg": picture, "text/plain": repr(self)}
