"""Probes and reflectors over the picture."""

from __future__ import annotations

from collections.abc import Collection

from imgui_bundle import imgui

from lambent.viewer.mode import Textures
from lambent.viewer.modes.walk.markers import Marks
from lambent.viewer.panels.widgets import AMBER, shadowed
from lambent.viewer.screen import Rect

LINE = (0.35, 0.8, 1.0, 1.0)


def draw(marks: Marks, selected: Collection[str], picture: Rect, textures: Textures) -> None:
    """Draw mirror balls and outlines, behind the panels."""
    draw_list = imgui.get_background_draw_list()
    draw_list.push_clip_rect((picture.x, picture.y), (picture.x + picture.width, picture.y + picture.height), True)
    for line in marks.lines:
        points: list[imgui.ImVec2Like] = [picture.point(x, y) for x, y in line]
        draw_list.add_polyline(points, col=imgui.get_color_u32(LINE), thickness=2.0, flags=imgui.ImDrawFlags_.closed)
    for ball in marks.balls:
        texture = textures.get(f"probe {ball.name}")
        x, y = picture.point(ball.x, ball.y)
        r = ball.radius * picture.height
        if texture is not None:
            draw_list.add_image(texture, (x - r, y - r), (x + r, y + r))
        draw_list.add_circle((x, y), r + 1, imgui.get_color_u32(AMBER), 0, 1.5)
        if ball.name in selected or r > 14:
            shadowed(draw_list, (x - imgui.calc_text_size(ball.name).x / 2, y + r + 4), ball.name, AMBER, 1.0)
    draw_list.pop_clip_rect()
