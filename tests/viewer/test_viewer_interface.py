"""Dear ImGui's colours reach the surface as they are."""

from wgpu.utils.imgui import imgui_backend

from lambent.realtime.gpu.device import open_device
from lambent.viewer import interface


def test_the_shader_takes_no_pixel_to_a_power(adapter, monkeypatch):
    before, seen = imgui_backend.FRAGMENT_SHADER_SRC, []
    assert interface.POWER in before, "the pinned version of wgpu"
    monkeypatch.setattr(interface, "ImguiRenderer", lambda *_: seen.append(imgui_backend.FRAGMENT_SHADER_SRC))
    interface.renderer(None, None)
    assert "pow(" not in seen[0] and "color.rgb" in seen[0] and before == imgui_backend.FRAGMENT_SHADER_SRC
    open_device().create_shader_module(code=seen[0])
