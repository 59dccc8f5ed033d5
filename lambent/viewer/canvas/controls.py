"""The controls below a view in a notebook: what the window's panels change, as ipywidgets."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from html import escape
from typing import Any

import ipywidgets
import numpy as np

from lambent.core.light.colour import hex_colour, hex_of
from lambent.materials.document import Material
from lambent.materials.models.model import Parameter
from lambent.viewer.edits import in_words
from lambent.viewer.look import MOST_EV
from lambent.viewer.modes.walk import offers
from lambent.viewer.modes.walk.light.lights import Lights
from lambent.viewer.modes.walk.state import WalkState

MOST_TIMES = 4.0  # of a group's baked light, of a slider
HINT = "Click a thing in the picture to change its material."


class Control:
    """A widget that shows a value, and sets the value that its user chooses."""

    def __init__(self, widget: Any, get: Callable[[], Any], set: Callable[[Any], None]) -> None:
        self.widget, self._get, self._set, self._follows = widget, get, set, False
        self.touched: Callable[[], None] = lambda: None  # called after a choice
        widget.style, widget.layout.width = {"description_width": "100px"}, "340px"
        widget.observe(self._changed, "value")

    def follow(self) -> None:
        """Show the present value."""
        self._follows = True
        value = self._get()
        if self.widget.value != value:
            self.widget.value = value
        self._follows = False

    def _changed(self, change: dict[str, Any]) -> None:
        if not self._follows:
            self._set(change["new"])
            self.touched()


class Choice(Control):
    """A list of names to choose from."""

    def __init__(self, offered: Callable[[], offers.Offers]) -> None:
        self._offered = offered
        title = offered().title
        super().__init__(ipywidgets.Dropdown(description=title), lambda: offered().now, self._choose)

    def follow(self) -> None:
        now, names = self._offered().now, tuple(self._offered().acts)
        names = names if now in names else (now, *names)
        self._follows = True
        if self.widget.options != names:
            self.widget.options = names
        super().follow()

    def _choose(self, name: str) -> None:
        self._offered().acts.get(name, lambda: None)()  # "as edited" is no act


class Controls:
    """The controls of a walk. `touched` is called after each change by their user."""

    def __init__(self, state: WalkState, touched: Callable[[], None]) -> None:
        self._state, self._touched = state, touched
        self._line, self._box = ipywidgets.HTML(), ipywidgets.VBox()
        self._room = self._ready(of_room(state))
        self._selected: str | None = None  # whose controls `_material` are
        self._material: list[Control] = []
        self._tabs = ipywidgets.Tab([_grid(self._room), self._box], titles=["Room", "Material"])
        self.widget = ipywidgets.VBox([self._line, self._tabs])
        self.follow()

    def say(self, lines: Sequence[str]) -> None:
        """Show lines of text between the picture and the controls."""
        self._line.value = "<br>".join(map(escape, lines))

    def follow(self) -> None:
        """Show what keys, clicks and other controls have changed."""
        state, screen = self._state, self._state.screen
        resting = [screen.at_rest] if screen.at_rest else []
        self.say([*state.missing, *(message.text for message in screen.messages), *resting])
        self._tabs.layout.display = "" if screen.panels_shown else "none"
        if state.selection.name != self._selected or not self._box.children:
            self._select(state.selection.name)
        for control in (*self._room, *self._material):
            control.follow()

    def _ready(self, controls: Iterator[Control]) -> list[Control]:
        made = list(controls)
        for control in made:
            control.touched = self._touched
        return made

    def _select(self, thing: str | None) -> None:
        """Show the controls of an object's material; without one, a hint."""
        self._selected, name, edits = thing, self._state.selection.material, self._state.materials.edits
        if name is None:
            self._material, self._box.children = [], [ipywidgets.HTML(HINT)]
            return

        def reset(_: Any) -> None:
            edits.reset(name)
            self._touched()

        button = ipywidgets.Button(description="reset", tooltip="restores the store's material")
        button.on_click(reset)
        title = ipywidgets.HTML(f"<b>{escape(str(thing))}</b>, {escape(name)}")
        self._material = self._ready(of_material(self._state, name))
        self._box.children = [ipywidgets.HBox([title, button]), _grid(self._material)]
        self._tabs.selected_index = 1


def of_room(state: WalkState) -> Iterator[Control]:
    """Variants, cameras, the exposure, and each group of lamps."""
    for offered in (partial(offers.variants, state.states), partial(offers.views, state)):
        if len(offered().acts) > 1:
            yield Choice(offered)
    slider = ipywidgets.FloatSlider(min=-MOST_EV, max=MOST_EV, step=0.01, description="exposure, EV")
    yield Control(slider, lambda: state.look.exposure_ev, partial(setattr, state.look, "exposure_ev"))
    for group in state.lights.groups:
        slider = ipywidgets.FloatSlider(max=MOST_TIMES, step=0.01, description=group.name, tooltip="times as baked")
        yield Control(slider, partial(_times, state.lights, group.name), partial(_set_times, state.lights, group.name))


def _times(lights: Lights, group: str) -> float:
    mix = lights.mix.of(group)
    return mix.intensity if mix.on else 0.0


def _set_times(lights: Lights, group: str, times: float) -> None:
    mix = lights.mix.of(group)
    lights.mix = lights.mix.changed(group, replace(mix, on=times > 0, intensity=times or mix.intensity))


def of_material(state: WalkState, name: str) -> Iterator[Control]:
    """Colour, shine and roughness, then each number of each lobe."""
    edits = state.materials.edits
    first = edits.scene[name]

    def control(widget: Any, get: Callable[[Material], Any], changed: Callable[[Material, Any], Material]) -> Control:
        return Control(
            widget,
            lambda: get(edits.current(name)),
            lambda value: edits.change(name, changed(edits.current(name), value)),
        )

    yield control(
        ipywidgets.ColorPicker(description="colour"),
        lambda one: hex_of(np.array(one.kd)),
        lambda one, text: one.model_copy(update={"kd": hex_colour(text) or one.kd}),
    )
    if not first.lobes:
        return
    yield control(
        ipywidgets.FloatSlider(max=in_words.MOST_SHINE, description="shine, %"),
        lambda one: in_words.shine_percent(one, first),
        lambda one, percent: in_words.with_shine(one, first, percent),
    )
    low, high = in_words.ROUGH
    rough = ipywidgets.FloatSlider(min=low, max=high, description="roughness, %")
    yield control(rough, in_words.rough_percent, in_words.with_roughness)
    for number, lobe in enumerate(first.lobes):
        for key, parameter in in_words.parameters_of(lobe).items():
            if not parameter.rgb:
                slider = _slider(f"{number + 1}: {key}", parameter)
                yield control(slider, partial(_number, number, key), partial(_with_number, number, key))


def _slider(title: str, parameter: Parameter) -> Any:
    about = {"description": title, "tooltip": parameter.meaning, "step": 0.01}
    if parameter.scale == "linear":
        return ipywidgets.FloatSlider(min=parameter.low, max=parameter.high, **about)
    low, high = np.log10([parameter.low, parameter.high])
    return ipywidgets.FloatLogSlider(parameter.default, min=low, max=high, **about)


def _number(lobe: int, key: str, material: Material) -> Any:
    return getattr(material.lobes[lobe], key)


def _with_number(lobe: int, key: str, material: Material, value: float) -> Material:
    lobes = list(material.lobes)
    lobes[lobe] = lobes[lobe].model_copy(update={key: value})
    return material.model_copy(update={"lobes": tuple(lobes)})


def _grid(controls: Sequence[Control]) -> Any:
    return ipywidgets.Box([one.widget for one in controls], layout=ipywidgets.Layout(flex_flow="row wrap"))
