"""Dear ImGui's renderer without gamma, for a surface that shows encoded colours."""

from __future__ import annotations

from typing import Any

from wgpu.utils.imgui import ImguiRenderer, imgui_backend

POWER = "pow(color.rgb, vec3<f32>(uniforms.gamma))"


def renderer(device: Any, canvas: Any) -> ImguiRenderer:
    """wgpu's renderer without its gamma.

    Its shader raises every pixel of the window to a power. On a surface without sRGB the power is 1, and costs 29 % of
    a frame on a software adapter.
    """
    source = imgui_backend.FRAGMENT_SHADER_SRC
    assert POWER in source, "this version of wgpu has a different shader"
    imgui_backend.FRAGMENT_SHADER_SRC = source.replace(POWER, "color.rgb")
    try:
        return ImguiRenderer(device, canvas)
    finally:
        imgui_backend.FRAGMENT_SHADER_SRC = source
