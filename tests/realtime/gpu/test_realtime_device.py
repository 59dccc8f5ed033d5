"""Devices and their limits."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import wgpu

import lambent
from lambent.core.errors import UserError
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import WEBGPU_LIMITS, choose_adapter
from lambent.realtime.gpu.shader_source import PACKAGE, shader_files
from lambent.realtime.gpu.targets import Targets
from lambent.realtime.objects.unbaked import CAMERA
from lambent.realtime.renderer import Renderer
from tests.realtime.lit_wall import wall_scene

GLOSS = Material(name="m", kd=0.5, lobes=(Lobe(mx=0.1, my=0.1), Lobe(mx=0.2, my=0.2, side="transmission")))


def test_all_of_a_frame_fits_the_default_limits(device) -> None:
    """A device of WebGPU's default limits and no features draws everything."""
    bare = choose_adapter().request_device_sync(required_limits=dict(WEBGPU_LIMITS))
    assert bare.limits["max-bind-groups"] in (4, device.limits["max-bind-groups"])
    assert not bare.features
    renderer = Renderer(bare, wall_scene(GLOSS, np.ones((6, 16, 16, 3))))
    for name in ("rings", "split-sum", "lobe-4.25"):
        assert renderer.display_image(FrameState(CAMERA, 16, 16, integrator=name)).min() > 10
    assert renderer.converged(FrameState(CAMERA, 16, 16), 16).min() > 0.01
    assert renderer.statistics["gpu_ms"] == {}


def test_a_real_gpu_comes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    class Adapter:
        def __init__(self, type: str, backend: str = "Vulkan") -> None:
            self.info = {"adapter_type": type, "backend_type": backend}

    found: list[Any] = [Adapter("CPU"), Adapter("DiscreteGPU", "OpenGL"), Adapter("IntegratedGPU")]
    monkeypatch.setattr(wgpu.gpu, "enumerate_adapters_sync", lambda: found)
    assert choose_adapter().info["adapter_type"] == "IntegratedGPU"
    found[:] = []
    with pytest.raises(UserError, match="apt-get install mesa-vulkan-drivers libvulkan1"):
        choose_adapter()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_opengl_is_not_started() -> None:
    """Listing its adapters starts EGL, which aborts the process at times."""
    code = "from lambent.realtime.gpu.device import open_device; open_device(); print(open('/proc/self/maps').read())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "vulkan" in done.stdout and "libEGL" not in done.stdout


def test_no_two_shaders_have_one_name() -> None:
    """They are included by name, from any room."""
    assert len(shader_files()) == len(list(PACKAGE.rglob("*.wgsl"))) and Path(lambent.__file__).parent == PACKAGE


def test_a_target_stays_until_the_size_changes(device) -> None:
    targets = Targets(device)
    first = targets.display("a", (8, 4))
    assert targets.display("a", (8, 4)) is first
    assert targets.display("a", (4, 8)).size[:2] == (4, 8)
