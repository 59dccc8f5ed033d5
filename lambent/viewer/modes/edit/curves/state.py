"""State of the curve editor beside the session: tool, regions, shown ranges, and the present drag.

Positions are pixels of the window. Every move repeats a drag from its start (`Strokes.replace`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from lambent.core.arrays import Floats
from lambent.editing.curves.operators import Operator, Region
from lambent.editing.session.document import CurveEdit, EditedMaterial, OfModel
from lambent.editing.session.session import Session
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.of_models import same_quotients
from lambent.materials.factored.terms import Editable
from lambent.materials.models import model_named
from lambent.materials.models.model import Model
from lambent.viewer.modes.edit.curves import regions
from lambent.viewer.modes.edit.curves.axes import END_DEG, Axes, Axis, within_curve
from lambent.viewer.modes.edit.curves.drags import Channels, Direction, Drag, Point, Tool, locked, painted
from lambent.viewer.modes.edit.curves.lines import fitted_x, fitted_y
from lambent.viewer.modes.edit.curves.regions import Grip
from lambent.viewer.modes.edit.curves.strokes import Strokes

ALL: Channels = (0, 1, 2)


@dataclass
class View:
    """Shown range and region of one curve; `base` stays in place when the curve is amplified."""

    region: Region
    x: Axis
    y: Axis
    base: Point = (0.0, 0.0)

    @classmethod
    def of(cls, values: Floats) -> View:
        x = fitted_x(values)
        return cls(regions.first(values), x, fitted_y(values, x, log=False))

    def fit(self, values: Floats, x: Axis | None = None) -> None:
        """Fit all values within a range of angles; by default, where the curve changes."""
        self.x = x or fitted_x(values)
        self.y = fitted_y(values, self.x, self.y.log)

    def set_log(self, values: Floats, log: bool) -> None:
        self.y = fitted_y(values, self.x, log)

    def zoom(self, axes: Axes, at: Point, steps: float, *, values: bool) -> None:
        """Zoom angles or values by steps of the wheel, about a pixel."""
        factor = 0.85**steps
        if values:
            below = (axes.place.y + axes.place.height - at[1]) / axes.place.height
            self.y = self.y.zoomed(below if self.y.log or self.y.low else 0.0, factor)
        else:
            self.x = within_curve(self.x.zoomed((at[0] - axes.place.x) / axes.place.width, factor))

    def pan(self, axes: Axes, dx: float, dy: float) -> None:
        """Pan the plot's content by pixels."""
        self.x = within_curve(self.x.panned(-dx / axes.place.width))
        self.y = self.y.panned(dy / axes.place.height)


@dataclass(frozen=True)
class Shown:
    """A material with and without its edits; `serves`: whether its transport still applies.

    `model` has the present parameters of a material whose original is a model."""

    document: EditedMaterial
    editable: Editable
    original: Editable
    serves: bool
    model: Model | None

    def edit(self, curve: str) -> CurveEdit:
        return self.document.curves.get(curve, CurveEdit())


@dataclass
class Hold:
    """What the mouse holds from press to release; `layers` are the present layers of the drag."""

    material: str
    curve: str
    grip: Grip | Literal["new", "paint"]
    axes: Axes
    begin: Point
    drag: Drag
    painted: Floats
    last: Point
    layers: tuple[Operator, ...] = ()
    seen: tuple[float, float, bool, bool] | None = None  # mouse position and modifier keys of the last move


@dataclass
class CurveState:
    """Tool, channels and views of the curve editor; edits go to the given session."""

    strokes: Strokes = field(default_factory=Strokes)
    tool: Tool = "translate"
    direction: Direction = "x and y"
    channels: Channels = ALL
    ghost: bool = True  # whether the original curve is drawn
    linked_roughness: bool = True
    hold: Hold | None = None
    chosen: dict[str, str] = field(default_factory=dict)  # curve by material
    views: dict[tuple[str, str], View] = field(default_factory=dict)
    _shown: dict[str, tuple[Session, Shown]] = field(default_factory=dict)
    _served: dict[str, Editable] = field(default_factory=dict)

    @property
    def active_curve(self) -> str | None:
        """The curve that is being dragged or drawn."""
        return self.hold.curve if self.hold is not None and self.hold.grip in ("curve", "paint") else None

    def shown(self, session: Session, material: str) -> Shown:
        """The session's material as it is now; computed again only after a change."""
        document = session.document.materials[material]
        kept = self._shown.get(material)
        if kept is not None and kept[0] is not session:
            del self._served[material]
        if kept is None or kept[0] is not session or kept[1].document is not document:
            original = session.original(material)
            served = self._served.setdefault(material, original)
            source = document.source
            model = model_named(source.model)(**source.parameters) if isinstance(source, OfModel) else None
            made = Shown(document, session.editable(material), original, same_quotients(served, original), model)
            kept = self._shown[material] = session, made
        return kept[1]

    def transported(self, session: Session, material: str) -> None:
        """Note that transport was baked for the material as it is now."""
        self._shown.pop(material, None)
        self._served[material] = session.original(material)

    def curve(self, material: str, shown: Shown) -> str:
        """The chosen curve of a material; at first the one that changes most, its highlight."""
        curves = shown.editable.curves
        name = self.chosen.get(material)
        if name is None or name not in curves:
            name = self.chosen[material] = max(curves, key=lambda one: float(np.ptp(curves[one].values)))
        return name

    def view(self, material: str, name: str, curve: Curve) -> View:
        key = material, name
        if key not in self.views:
            self.views[key] = View.of(curve.values)
        return self.views[key]

    def toggle(self, channel: Literal[0, 1, 2]) -> None:
        """Toggle whether edits act on a channel; if none would be left, edits act on all."""
        kept: Channels = tuple(one for one in ALL if (one in self.channels) != (one == channel))
        self.channels = kept or ALL

    def press(self, session: Session, material: str, axes: Axes, x: float, y: float) -> None:
        """Grab the item under the mouse: a handle, the curve, or an end of a new region."""
        shown = self.shown(session, material)
        name = self.curve(material, shown)
        curve = shown.editable.curves[name]
        view = self.view(material, name, curve)
        at = axes.at(x, y)
        grip: Grip | Literal["new", "paint"]
        grip = "paint" if self.tool == "draw" else regions.grip_at(view.region, axes, x, y) or "new"
        drag = Drag(self.tool, view.region, self.channels, at, axes.y, axes.x, view.base)
        self.strokes.end(session)
        self.hold = Hold(material, name, grip, axes, at, drag, curve.values, at)
        if grip == "paint":
            self.move(session, x, y)

    def move(self, session: Session, x: float, y: float, *, shift: bool = False, ctrl: bool = False) -> None:
        """Drag the held item to this pixel."""
        hold = self.hold
        if hold is None or hold.seen == (x, y, shift, ctrl):
            return
        hold.seen = x, y, shift, ctrl
        end, view = hold.axes.at(x, y), self.views[hold.material, hold.curve]
        if hold.grip == "paint":
            self._paint(session, hold, end)
        elif hold.grip == "curve":
            self._pull(session, hold, end, locked(self.direction, shift=shift, ctrl=ctrl))
        elif hold.grip == "new":
            view.region = regions.spanned(hold.begin[0], end[0]) or hold.drag.region
        elif hold.grip == "bar":
            view.region = regions.moved(hold.drag.region, end[0] - hold.begin[0])
        else:
            view.region = regions.with_edge(hold.drag.region, hold.grip, end[0])

    def release(self, session: Session) -> None:
        """Release the mouse; the region follows a curve moved along the angles."""
        hold, self.hold = self.hold, None
        if hold is None:
            return
        for layer in hold.layers:
            if layer.kind == "translate_x":
                by_deg = float(np.degrees(layer.size))
                self.views[hold.material, hold.curve].region = regions.moved(hold.drag.region, by_deg)
        self.strokes.end(session)

    def cancel(self, session: Session) -> None:
        """Cancel the drag and restore the state before it."""
        if self.hold is not None:
            if self.strokes.is_open(session):
                self.strokes.replace(session, lambda: None)
            self.views[self.hold.material, self.hold.curve].region = self.hold.drag.region
            self.hold.layers = ()
            self.release(session)

    def _pull(self, session: Session, hold: Hold, end: Point, direction: Direction) -> None:
        layers = hold.drag.operators(end, direction)
        if self._edited(session, lambda: session.apply(hold.material, hold.curve, *layers) if layers else None):
            hold.layers = layers

    def _paint(self, session: Session, hold: Hold, end: Point) -> None:
        values = painted(hold.painted, hold.last, end, self.channels, hold.axes.y.log)
        if self._edited(session, lambda: session.draw(hold.material, hold.curve, Curve(values))):
            hold.painted, hold.last = values, end

    def _edited(self, session: Session, act: Callable[[], object]) -> bool:
        """Edit within the stroke, or release it after an undo. Return whether the edit was made."""
        if self.strokes.has_left(session):
            self.hold = None
            self.strokes.end(session)
            return False
        self.strokes.replace(session, act)
        return not self.strokes.message


def whole_x() -> Axis:
    return Axis(0.0, END_DEG)
