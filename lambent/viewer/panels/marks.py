"""Probes and reflectors over the picture."""

from __future__ import annotations

from collections.abc import Mapping

from imgui_bundle import imgui

from lambent.viewer.input import Rect
from lambent.viewer.state import ViewerState

RING, LINE = (1.0, 0.75, 0.35, 1.0), (0.35, 0.8, 1.0, 1.0)


def draw(state: ViewerState, picture: Rect, textures: Mapping[str, imgui.ImTextureRef]) -> None:
    """Mirror balls and outlines, behind the panels."""
    behind = imgui.get_background_draw_list()
    behind.push_clip_rect((picture.x, picture.y), (picture.x + picture.width, picture.y + picture.height), True)
    for line in state.marks.lines:
        points: list[imgui.ImVec2Like] = [
            imgui.ImVec2(picture.x + x * picture.width, picture.y + y * picture.height) for x, y in line.points
        ]
        behind.add_polyline(points, col=imgui.get_color_u32(LINE), thickness=2.0, flags=imgui.ImDrawFlags_.closed)
    for ball in state.marks.balls:
        texture = textures.get(f"probe {ball.name}")
        x, y = picture.x + ball.x * picture.width, picture.y + ball.y * picture.height
        r = ball.radius * picture.height
        if texture is not None:
            behind.add_image(texture, (x - r, y - r), (x + r, y + r))
        behind.add_circle((x, y), r + 1, imgui.get_color_u32(RING), 0, 1.5)
        if ball.name == state.selected or r > 14:
            size = imgui.calc_text_size(ball.name)
            behind.add_text((x - size.x / 2 + 1, y + r + 5), imgui.get_color_u32((0, 0, 0, 1)), ball.name)
            behind.add_text((x - size.x / 2, y + r + 4), imgui.get_color_u32(RING), ball.name)
    behind.pop_clip_rect()
