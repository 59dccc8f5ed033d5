"""The GPU: choice of the adapter and of its limits."""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from typing import Any

import wgpu
from wgpu.backends.wgpu_native import extras

from lambent.core.errors import UserError
from lambent.realtime.gpu.foreign_types import parse_quickly

MEND = "install a Vulkan driver (Debian: apt-get install mesa-vulkan-drivers libvulkan1)"

# Limits that every WebGPU implementation grants (WebGPU, section 3.6.2). A device requested without limits gets the
# adapter's own; code that exceeds the defaults would then fail only on other machines. So we always request these.
WEBGPU_LIMITS: Mapping[str, int] = {
    "max-texture-dimension-1d": 8192,
    "max-texture-dimension-2d": 8192,
    "max-texture-dimension-3d": 2048,
    "max-texture-array-layers": 256,
    "max-bind-groups": 4,
    "max-bindings-per-bind-group": 1000,
    "max-sampled-textures-per-shader-stage": 16,
    "max-samplers-per-shader-stage": 16,
    "max-storage-buffers-per-shader-stage": 8,
    "max-storage-textures-per-shader-stage": 4,
    "max-uniform-buffers-per-shader-stage": 12,
    "max-uniform-buffer-binding-size": 64 << 10,
    "max-storage-buffer-binding-size": 128 << 20,
    "max-vertex-buffers": 8,
    "max-buffer-size": 256 << 20,
    "max-vertex-attributes": 16,
    "max-vertex-buffer-array-stride": 2048,
    "max-color-attachments": 8,
    "max-color-attachment-bytes-per-sample": 32,
    "max-dynamic-storage-buffers-per-pipeline-layout": 4,
    "max-compute-workgroup-storage-size": 16 << 10,
    "max-compute-invocations-per-workgroup": 256,
    "max-compute-workgroup-size-x": 256,
    "max-compute-workgroup-size-y": 256,
    "max-compute-workgroup-size-z": 64,
    "max-compute-workgroups-per-dimension": 65535,
}
BACKENDS = ("Vulkan", "Metal", "DX12")
BLOCKS = "texture-compression-bc"
OF_ROOMS = ("max-buffer-size", "max-texture-dimension-2d", "max-storage-buffer-binding-size")
OPTIONAL_FEATURES = ("timestamp-query", BLOCKS)


@dataclass(frozen=True)
class AdapterInfo:
    """Description of the GPU for users, reports and benches."""

    name: str
    type: str  # "DiscreteGPU", "IntegratedGPU", "CPU"...
    backend: str
    driver: str

    @property
    def is_software(self) -> bool:
        return self.type == "CPU"


def adapter_info(device_or_adapter: Any) -> AdapterInfo:
    """Name, type, backend and driver of a wgpu adapter or of a device's adapter."""
    adapter = getattr(device_or_adapter, "adapter", device_or_adapter)
    info = adapter.info
    return AdapterInfo(
        info.get("device", ""), info.get("adapter_type", ""), info.get("backend_type", ""), info.get("description", "")
    )


def choose_adapter() -> Any:
    """The fastest adapter of Vulkan, Metal or DX12: a real GPU before a software one.

    Raises
    ------
    UserError
        If this machine has no adapter; names the package to install.
    """
    _have_runtime_folder()
    _leave_out_opengl()
    parse_quickly()
    adapters = [a for a in wgpu.gpu.enumerate_adapters_sync() if a.info.get("backend_type") != "OpenGL"]
    if not adapters:
        raise UserError("no graphics adapter found", expected="Vulkan, Metal or Direct3D 12", hint=MEND)
    order = ["DiscreteGPU", "IntegratedGPU", "VirtualGPU", "Unknown", "CPU"]
    return min(adapters, key=lambda a: order.index(a.info["adapter_type"]) if a.info["adapter_type"] in order else 3)


@cache
def _leave_out_opengl() -> None:
    """Keep wgpu from starting EGL to list OpenGL adapters, which can abort the process on a loaded machine."""
    with suppress(RuntimeError):  # wgpu has started already, with backends that the calling program chose
        extras.set_instance_extras(backends=BACKENDS)


def _have_runtime_folder() -> None:
    """Make a private runtime folder: drivers complain on stderr if no login manager has made one."""
    if sys.platform.startswith("linux") and not os.environ.get("XDG_RUNTIME_DIR"):
        folder = tempfile.mkdtemp(prefix="lambent-")
        os.environ["XDG_RUNTIME_DIR"] = folder
        atexit.register(shutil.rmtree, folder, ignore_errors=True)


def open_device(needs: Mapping[str, int] | None = None) -> Any:
    """A wgpu device with WebGPU's default limits, raised only as `needs` says.

    Parameters
    ----------
    needs : mapping, optional
        Limit name -> least value, for example ``{"max-buffer-size": 1 << 30}`` for a large scene.

    Raises
    ------
    UserError
        If there is no adapter, or it cannot grant a limit.
    """
    adapter = choose_adapter()
    limits = dict(WEBGPU_LIMITS)
    for name, value in (needs or {}).items():
        if value > adapter.limits[name]:
            raise UserError(
                "scene exceeds the limits of this graphics adapter",
                field=name,
                got=adapter.limits[name],
                expected=value,
            )
        limits[name] = max(limits.get(name, 0), value)
    features = [name for name in OPTIONAL_FEATURES if name in adapter.features]
    return adapter.request_device_sync(required_limits=limits, required_features=features)


def is_lost(error: BaseException) -> bool:
    """Whether an error says that a device is gone; wgpu has no class for that."""
    return isinstance(error, wgpu.GPUError) and "device is lost" in str(error)


def open_room_device() -> Any:
    """A device that serves any room: with the adapter's own limits where rooms need more than is usual."""
    limits = choose_adapter().limits
    return open_device({name: limits[name] for name in OF_ROOMS})
