"""The Light field panel: points of the selected object's light field, and the map of one of them."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.mode import Textures
from lambent.viewer.modes.walk.light.light_fields import SHOWS, FieldView, distances_m
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.panels.widgets import AMBER, check, choice, explain, rows, shadowed, wrapped
from lambent.viewer.screen import Rect

MARGIN_PX = 12
MAP_SHARE = 0.4  # side of the map, as a share of the picture's shorter side


def draw(state: WalkState) -> None:
    view, name = state.fields, state.selection.name
    view.follow(state.selected_parts)
    light_field = view.chosen
    if light_field is None:
        imgui.text_wrapped(without(name, tuple(view.fields), state.store_name))
        return
    count, side = light_field.inverse_distance.shape[:2]
    view.points_on = check("points", view.points_on, "marks each point of the light field; click one to choose it")
    imgui.same_line()
    view.map_on = check("map", view.map_on, "shows the chosen point's map over the picture")
    changed, point = imgui.slider_int("point", view.point, 0, count - 1)
    explain("number of the chosen point")
    if changed:
        view.point = min(max(point, 0), count - 1)
    view.shows = choice("show", view.shows, SHOWS, "light, or distances: red near, blue far, black sky")
    x, y, z = light_field.points[view.point]
    far, near = distances_m(light_field, view.point)
    table = [
        ("light field of", str(view.owner)),
        ("points", str(count)),
        ("maps", f"{side} x {side} texels"),
        ("offset", f"{1e3 * light_field.offset_m:.1f} mm"),
        ("position", f"{x:.3f}, {y:.3f}, {z:.3f} m"),
        ("distances", f"{near:.3g} to {far:.3g} m"),
    ]
    rows(table, "light field")


def without(name: str | None, others: tuple[str, ...], store: str) -> str:
    """Text for a selection without a light field."""
    has = f" Objects with a light field: {', '.join(others)}." if others else ""
    if name is None:
        return f"Select an object.{has}"
    return f"{name} has no light field; `lambent bake SCENE -o {store} --light-fields {name}` adds one.{has}"


def warn_of_look_up(state: WalkState) -> None:
    """Warn if a light field is chosen as the look-up of an object without one."""
    name, parts = state.selection.name, state.selected_parts
    wanted = state.look.lookups.get(name or "", state.look.lookup)
    if name is not None and wanted.startswith("light_field") and not any(part in state.fields.fields for part in parts):
        wrapped([without(name, (), state.store_name)])


def draw_over(view: FieldView, picture: Rect, textures: Textures) -> None:
    """Draw discs over the picture, and the map in its upper left corner."""
    draw_list = imgui.get_background_draw_list()
    if (discs := textures.get("points")) is not None:
        draw_list.add_image(discs, picture.point(0, 0), picture.point(1, 1))
    if (square := textures.get("map")) is None:
        return
    size = MAP_SHARE * min(picture.width, picture.height)
    (x, y), line = picture.point(0, 0), imgui.get_text_line_height()
    x, y = x + MARGIN_PX, y + MARGIN_PX + line
    draw_list.add_image(square, (x, y), (x + size, y + size))
    draw_list.add_rect((x - 1, y - 1), (x + size + 1, y + size + 1), imgui.get_color_u32(AMBER))
    shadowed(draw_list, (x, y - line - 2), f"point {view.point}: {view.shows}", AMBER, 1.0)
