"""The bar of the size *show*: variants, light, views and films over the lower edge of the picture."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.modes.walk import offers
from lambent.viewer.modes.walk.offers import Offers
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.panels.widgets import choice, press, px
from lambent.viewer.sizes import draw_control

BAR_PX, LIST_PX, LEAST_PX, PLAY_PX, CONTROL_PX, MARGIN_PX = 40, 190, 70, 60, 220, 10
FRAME = (1.0, 1.0, 1.0, 0.14)  # of a list, over the dark bar
FLAGS = imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_saved_settings


def height_px(state: WalkState, *, moving: bool, dragging: bool) -> float:
    """Height of the bar in this frame; 0 in other sizes, while the mouse drags, and while the camera is `moving`.

    It stays under the mouse, and while its controls have the keys.
    """
    screen = state.screen
    if screen.size != "show" or not screen.panels_shown:
        return 0.0
    high, mouse = px(BAR_PX), imgui.get_io().mouse_pos
    in_use = screen.by_keys or mouse.y >= imgui.get_io().display_size.y - high or screen.list_open
    return 0.0 if dragging or (moving and not in_use) else high


def draw(state: WalkState, high: float) -> None:
    """Draw the bar, this high."""
    width, bottom = imgui.get_io().display_size
    margin, control = px(MARGIN_PX), min(px(CONTROL_PX), width / 3)
    imgui.set_next_window_pos((0, bottom - high))
    imgui.set_next_window_size((width, high))
    imgui.set_next_window_bg_alpha(0.8)
    imgui.push_style_var(imgui.StyleVar_.window_padding, (margin, (high - imgui.get_frame_height()) / 2))
    imgui.push_style_color(imgui.Col_.frame_bg, FRAME)
    imgui.begin("bar", None, FLAGS)
    _lists(state, width - control - 3 * margin)
    imgui.same_line(width - control - margin)
    draw_control(state.screen, control)
    imgui.end()
    imgui.pop_style_color()
    imgui.pop_style_var()


def _lists(state: WalkState, room_px: float) -> None:
    """Draw the lists that have something to choose, and the button that plays a film, in this width."""
    films, gap = offers.films(state), imgui.get_style().item_spacing.x
    first = [one for one in (offers.variants(state.states), offers.lights(state.states)) if len(one.acts) > 1]
    lists = [one for one in (*first, offers.views(state), films) if one.acts]
    play = px(PLAY_PX) + gap if films.acts else 0.0
    each = min(px(LIST_PX), (room_px - play) / max(len(lists), 1) - gap)
    for one in lists:
        _list(one, each)
        imgui.same_line()
    playing = state.navigation.playing
    if films.acts and press("pause" if playing else "play", "plays or pauses the film", px(PLAY_PX)):
        state.navigation.toggle(next(path for path in state.recordings.paths if path.name == films.now))


def _list(offered: Offers, width: float) -> None:
    """Draw a list in this width, with its title where there is room."""
    gap = imgui.get_style().item_inner_spacing.x
    label = imgui.calc_text_size(offered.title).x + gap
    if width - label < px(LEAST_PX):
        label = 0.0
    else:
        imgui.align_text_to_frame_padding()
        imgui.text_disabled(offered.title)
        imgui.same_line(0, gap)
    names = list(offered.acts) if offered.now in offered.acts else [offered.now, *offered.acts]
    chosen = choice(
        f"##{offered.title}", offered.now, names, f"{offered.title}: {offered.meaning}", max(width - label, 1.0)
    )
    if chosen != offered.now:
        offered.acts[chosen]()
