"""The Curves panel: the selected material's curves, whose nodes are pulled while the room answers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from imgui_bundle import imgui, implot

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.editing.curves.nodes import (
    LEAST,
    TITLES,
    Which,
    angles_deg,
    copied,
    curves_of,
    pulled,
    smoothed,
    titled,
    values_of,
    with_lobe,
    with_values,
)
from lambent.materials.document import Material
from lambent.viewer.background.fitting import Fitting
from lambent.viewer.editor.files import typed_path
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.panels.plots import BLUE, GREEN, MEASURED, MODEL, RED
from lambent.viewer.panels.widgets import buttons, choice, explain, path_field, px
from lambent.viewer.screen import Screen

Tool = Literal["pull", "pull softly", "draw"]
TOOLS: tuple[Tool, ...] = get_args(Tool)
CHANNELS = {"together": (0, 1, 2), "red": (0,), "green": (1,), "blue": (2,)}
ANGLES = {"shape": "theta_h", "fresnel": "theta_d", "diffuse": "theta of light and eye"}
TICKS_DEG = (0.0, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 60.0, 85.0)
HEIGHT_PX, NODE_PX, NEAR_PX = 190.0, 3.5, 18.0
APART = 3.0  # nodes between two ticks, whose texts would overlap
DECADES, HEADROOM = 7, 4.0  # of the axis of a highlight, below and above its largest value
_PLOT = implot.Flags_.no_menus | implot.Flags_.no_box_select | implot.Flags_.no_mouse_text | implot.Flags_.no_legend
_X, _Y = implot.ImAxis_.x1, implot.ImAxis_.y1


@dataclass
class CurvesPanel:
    """The panel's choices, and the node under the mouse; `open_view`, if any, opens the view under exact light."""

    selected: Callable[[], str | None]  # name of the material
    edits: MaterialEdits
    change: Callable[[str, Material], None]
    screen: Screen
    fitting: Fitting
    open_view: Callable[[], None] | None = None
    can_open: Callable[[], bool] = lambda: True
    title: str = ""  # of the curve
    typed: str = ""  # path of a measurement
    channels: str = "together"
    tool: Tool = "pull"
    node: int | None = None  # held
    limits: tuple[float, float] = (0.0, 1.0)  # of the values; fixed while a node is held

    def draw(self) -> None:
        """Draw the panel of the selected material."""
        if (name := self.selected()) is None:
            imgui.text_wrapped("Click an object in the picture.")
            return
        material = self.edits.current(name)
        found = titled(material)
        if not found:
            imgui.text_wrapped("Black: nothing to pull. Give the material a colour or a lobe first.")
            return
        self.title = choice("curve", self.title if self.title in found else next(iter(found)), list(found), MEANING)
        which = found[self.title]
        if which.kind == "fresnel":
            self.channels = choice("channels", self.channels, list(CHANNELS), "pulled together, or one of them")
        self.tool = choice("tool", self.tool, TOOLS, "one node, with its neighbours, or along the mouse")
        edited = self._plot(material, self.edits.scene[name], which)
        edited = self._actions(name, edited, which)
        if edited != material:
            self.change(name, edited)

    def _actions(self, name: str, material: Material, which: Which) -> Material:
        """Draw the buttons; return the material after them."""
        asked: list[Material] = []
        values, scene = values_of(material, which), self.edits.scene[name]
        smooth = lambda: asked.append(with_values(material, which, smoothed(values)))  # noqa: E731
        reset = lambda: asked.append(_reset(material, scene, which))  # noqa: E731
        buttons([
            ("smooth", True, smooth, "averages each node with its neighbours"),
            ("reset curve", material != scene, reset, "restores the curve as baked"),
            *self._exact_here,
        ])  # fmt: skip
        others = [other for other in self.edits.scene if other != name]
        chosen = choice("copy from", "", ["", *others], "takes this curve of another material of the scene")
        if chosen and (taken := copied(material, which, self.edits.current(chosen))) is not None:
            asked.append(taken)
        elif chosen:
            self.screen.say(f"{chosen} has no {TITLES[which.kind]} of this kind")
        meaning = "takes this curve of a measured file, to which a lobe of curves is fitted first"
        self.typed, wanted = path_field("curve of", self.typed, "copy", "or from a measured file...", meaning)
        if wanted:
            self._copy_measured(name, which)
        if self.fitting.busy:
            imgui.text_disabled(self.fitting.doing)
        return asked[-1] if asked else material

    def _copy_measured(self, name: str, which: Which) -> None:
        """Fit a lobe of curves to the typed file, and take its curve, as a step of its own."""

        def done(found: Material) -> None:
            taken = copied(self.edits.current(name), which, found)
            if taken is None:
                self.screen.say(f"{file.name} has no {TITLES[which.kind]} of this kind")
                return
            self.edits.end_stroke()
            self.change(name, taken)
            self.edits.end_stroke()
            self.screen.say(f"{name} has the {TITLES[which.kind]} of {file.name}")

        try:
            file = typed_path(self.typed)
            self.fitting.begin(file, "curve", done)
        except UserError as error:
            self.screen.say(f"not loaded: {error}")

    @property
    def _exact_here(self) -> list[tuple[str, bool, Callable[[], None], str]]:
        meaning = "opens this view under exact direct light"
        return [] if self.open_view is None else [("exact here", self.can_open(), self.open_view, meaning)]

    def _plot(self, material: Material, scene: Material, which: Which) -> Material:
        """Draw the curve; return the material after a pull."""
        places, ticks = _places(material, which)
        values = values_of(material, which)
        if self.node is None:
            self.limits = _limits(values, which)
        size = imgui.ImVec2(imgui.get_content_region_avail().x, px(HEIGHT_PX))
        if size.x < 60 or not implot.begin_plot("##nodes", size, _PLOT | implot.Flags_.no_inputs):
            return material
        self._axes(which, places, ticks)
        if which in curves_of(scene):
            _lines(places, values_of(scene, which), (*MEASURED[:3], 0.4), dots=False)
        _lines(places, values, MODEL, dots=True)
        edited = self._mouse(material, which, places, values)
        implot.end_plot()
        explain(f"{TITLES[which.kind]} over {ANGLES[which.kind]}; grey: as baked")
        return edited

    def _axes(self, which: Which, places: Floats, ticks: list[tuple[float, str]]) -> None:
        implot.setup_axis(_X, ANGLES[which.kind])
        implot.setup_axis(_Y, None)
        margin = 0.03 * float(np.ptp(places))
        implot.setup_axis_limits(_X, float(places.min()) - margin, float(places.max()) + margin, implot.Cond_.always)
        implot.setup_axis_ticks(_X, [place for place, _ in ticks], [text for _, text in ticks])
        if which.kind == "shape":
            implot.setup_axis_scale(_Y, implot.Scale_.log10)
        implot.setup_axis_limits(_Y, *self.limits, implot.Cond_.always)
        implot.setup_finish()

    def _mouse(self, material: Material, which: Which, places: Floats, values: Floats) -> Material:
        place, extent, before = implot.get_plot_pos(), implot.get_plot_size(), imgui.get_cursor_screen_pos()
        imgui.set_cursor_screen_pos(place)
        imgui.invisible_button("##pull", extent)
        held, mouse = imgui.is_item_active(), imgui.get_io().mouse_pos
        imgui.set_cursor_screen_pos(before)
        if not held:
            self.node = None
            return material
        across = np.array([implot.plot_to_pixels(float(x), self.limits[1]).x for x in places])
        nearest = int(np.argmin(np.abs(across - mouse.x)))
        if self.node is None and abs(across[nearest] - mouse.x) > max(px(NEAR_PX), extent.x / len(places)):
            return material
        self.node = nearest if self.tool == "draw" or self.node is None else self.node
        to = float(np.clip(implot.pixels_to_plot(mouse).y, *self.limits))
        channels = CHANNELS[self.channels] if values.shape[1] == 3 else (0,)
        return with_values(material, which, pulled(values, self.node, to, channels, soft=self.tool == "pull softly"))


MEANING = "highlight: brightness about the mirror direction; reflectance: Fresnel's rise to grazing; diffuse: the base"


def _reset(material: Material, scene: Material, which: Which) -> Material:
    """The material with the scene's curve, if that has it."""
    if which.kind == "diffuse":
        found: Material = _like(material, scene, ("kd", "kd_coupled", "kd_curve"))
        return found
    if which.lobe >= len(scene.lobes):
        return material
    names = ("distribution", "shape", "mx", "my", "k") if which.kind == "shape" else ("fresnel", "r0", "k")
    return with_lobe(material, which.lobe, _like(material.lobes[which.lobe], scene.lobes[which.lobe], names))


def _like(one: Any, other: Any, names: tuple[str, ...]) -> Any:
    """The document `one` with these fields of the other."""
    return one.model_copy(update={name: getattr(other, name) for name in names})


def _places(material: Material, which: Which) -> tuple[Floats, list[tuple[float, str]]]:
    """Where the nodes stand along the axis (K,), and its ticks: a highlight's nodes are evenly apart."""
    angles = angles_deg(material, which)
    if which.kind != "shape":
        return angles, [(float(tick), f"{tick:g}°") for tick in range(0, 91, 15)]
    places = np.arange(len(angles), dtype=float)
    ticks: list[tuple[float, str]] = []
    for tick in TICKS_DEG:
        place = float(np.interp(tick, angles, places))
        if tick <= angles[-1] and (not ticks or place - ticks[-1][0] >= APART):
            ticks.append((place, f"{tick:g}°"))
    return places, ticks


def _limits(values: Floats, which: Which) -> tuple[float, float]:
    most = float(values.max())
    if which.kind == "shape":
        return most * 10.0**-DECADES, most * HEADROOM
    return 0.0, max(1.05, 1.3 * most)


def _lines(places: Floats, values: Floats, colour: tuple[float, float, float, float], dots: bool) -> None:
    grey = values.shape[1] == 1 or np.allclose(values, values[:, :1])
    for c in range(1 if grey else 3):
        own = colour if grey else (*(RED, GREEN, BLUE)[c][:3], colour[3])
        y = np.ascontiguousarray(np.maximum(values[:, c], LEAST * values.max()))
        order = np.argsort(places)
        x, y = np.ascontiguousarray(places[order]), np.ascontiguousarray(y[order])
        implot.plot_line(f"##line {c} {dots}", x, y, implot.Spec(line_color=own, line_weight=2.0 if dots else 1.2))
        if dots:
            spec = implot.Spec(marker=implot.Marker_.circle, marker_size=px(NODE_PX), marker_fill_color=own)
            implot.plot_scatter(f"##nodes {c}", x, y, spec)
