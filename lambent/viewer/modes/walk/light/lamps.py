"""Lamps of the scene in the window: chosen, moved, aimed and exchanged, as edits of the room."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.plain import Triple, triple
from lambent.core.views.camera import Camera, image_plane
from lambent.realtime.lamps.changed import as_baked
from lambent.scenes.lamp_edits import DOWN, LampEdit, photometry_of
from lambent.store.lamps import LampRecord
from lambent.viewer.editor.files import typed_path
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.modes.walk.markers import NEAR_M, projected

REACH_PX = 12.0  # from a lamp's mark to where it can be grabbed
Size = tuple[int, int]


@dataclass
class Lamps:
    """Lamps that are drawn by pixel; their edits belong to the `edits` and share their undo.

    Attributes
    ----------
    chosen : int or None
        Number of the chosen lamp among the scene's lights.
    shown, aiming : bool
        Whether marks are over the picture, and whether the next click aims the chosen lamp.
    """

    edits: MaterialEdits = field(default_factory=lambda: MaterialEdits({}))
    records: Sequence[LampRecord] = ()
    chosen: int | None = None
    shown: bool = False
    wanted: bool = False  # whether the panel has asked for marks since the last ones
    aiming: bool = False
    typed: str = ""
    say: Callable[[str], None] = print

    def of(self, number: int) -> LampEdit:
        """A lamp as it is now."""
        baked = next(record for record in self.records if record.number == number)
        return self.edits.room.lamps.get(number) or as_baked(baked)

    @property
    def places(self) -> Floats:
        """(n, 3) positions of all lamps, m."""
        return np.array([self.of(record.number).position for record in self.records]).reshape(-1, 3)

    def pick(self, camera: Camera, at_px: tuple[float, float], size: Size, reach_px: float | None = None) -> int | None:
        """Choose the lamp whose mark is at a point of a picture of this size; return its number, None for none.

        Within `reach_px`, a lamp is found whose mark is not shown, too.
        """
        if not (self.shown or reach_px) or not self.records:
            return None
        at, depths_m = projected(camera, self.places, size)
        off_px = np.where(depths_m > NEAR_M, np.linalg.norm(at * size - at_px, axis=1), np.inf)
        if off_px.min() > (reach_px or REACH_PX):
            return None
        self.chosen = self.records[int(np.argmin(off_px))].number
        return self.chosen

    def drag(self, number: int, camera: Camera, dx: float, dy: float, size: Size) -> None:
        """Move a lamp by pixels in the plane of the view, within the present stroke."""
        lamp = self.of(number)
        across, up, forward = image_plane(camera, *size)
        _, (depth_m,) = projected(camera, np.array([lamp.position]), size)
        step = 2 * (dx / size[0] * across - dy / size[1] * up) * depth_m / np.linalg.norm(forward)
        self.edits.edit_lamp(number, replace(lamp, position=triple(np.array(lamp.position) + step)))

    def aim_at(self, target: Triple) -> None:
        """Aim the chosen lamp at a point, as one stroke."""
        self.aiming = False
        if self.chosen is not None and target != (lamp := self.of(self.chosen)).position:
            self._set(replace(lamp, aim=triple(np.subtract(target, lamp.position))))

    def exchange(self, text: str) -> None:
        """Give the chosen lamp the light of an IES or EULUMDAT file, as one stroke."""
        if self.chosen is None:
            self.say("drop it onto a lamp, or choose one in the Lamps panel: the file becomes its luminaire")
            return
        try:
            file = typed_path(text).absolute()
            photometry_of(file)
        except UserError as error:
            self.say(f"luminaire not shown: {error}")
            return
        self._set(replace(self.of(self.chosen), file=str(file)))
        self.say(f"{file.name} is the luminaire of {self.name(self.chosen)}")

    def reset(self) -> None:
        """Show the chosen lamp as baked, as one stroke."""
        self._set(None)

    def _set(self, edit: LampEdit | None) -> None:
        assert self.chosen is not None, "asked for with one alone"
        self.edits.end_stroke()
        self.edits.edit_lamp(self.chosen, edit)
        self.edits.end_stroke()

    @staticmethod
    def name(number: int) -> str:
        return f"lamp {number + 1}"


def tilt_and_bearing_deg(aim: Triple) -> tuple[float, float]:
    """Angle of a direction from straight down, and its bearing: from -z towards +x."""
    x, y, z = aim
    level = float(np.hypot(x, z))
    return float(np.degrees(np.arctan2(level, -y))), float(np.degrees(np.arctan2(x, -z))) if level > 0 else 0.0


def aim_of(tilt_deg: float, bearing_deg: float) -> Triple:
    """The direction of a tilt and a bearing."""
    tilt, bearing = np.radians((tilt_deg, bearing_deg))
    level = np.sin(tilt)
    return DOWN if tilt_deg == 0 else triple((level * np.sin(bearing), -np.cos(tilt), -level * np.cos(bearing)))
