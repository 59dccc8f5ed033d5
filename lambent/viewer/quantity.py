"""What the numbers of the window's picture are: luminance, illuminance, or the noise of the light map."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lambent.core.false_colour import Range
from lambent.core.photometry import Quantity
from lambent.realtime.frame_state import FALSE_COLOUR, LIGHT_MAP_NOISE, quantity_of

if TYPE_CHECKING:
    from lambent.viewer.state import ViewerState


def shown_quantity(state: ViewerState) -> Quantity:
    """Of what the picture shows."""
    return quantity_of(state.show)


def shows_noise(state: ViewerState) -> bool:
    """Whether the picture is the noise of the light map, which is in false colours under every view transform."""
    return state.show == LIGHT_MAP_NOISE


def is_false_coloured(state: ViewerState) -> bool:
    """Whether the picture is in false colours, so that it needs a scale."""
    return shows_noise(state) or state.view_transform == FALSE_COLOUR


def shown_scale(state: ViewerState) -> Range:
    """Of the false colours: noise has a range of its own, in percent."""
    return state.noise_scale if shows_noise(state) else state.scale


def set_shown_scale(state: ViewerState, scale: Range) -> None:
    """Take another range for what is shown."""
    if shows_noise(state):
        state.noise_scale = scale
    else:
        state.scale = scale
