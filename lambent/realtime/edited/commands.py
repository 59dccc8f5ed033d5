"""Compute passes of a frame: recorded, then submitted together with all their parameters."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.baked.transport.wavelets import TAPS
from lambent.core.errors import UserError
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.shader_source import assemble
from lambent.realtime.gpu.targets import PassTimer
from lambent.realtime.gpu.uploads import whole_words

GROUP = 256  # threads of a workgroup, as in the shaders
REACH = 64 << 10  # bytes of parameters visible to a dispatch
ROOM = 1 << 20  # bytes of parameters of one submission
ALIGNED = 256  # bytes; alignment of dynamic offsets in WebGPU's default limits
BINDINGS = {
    "sum": ("uniform", "storage", "written storage"),
    "fold": ("uniform", "storage", "storage", "storage", "written storage"),
    "compose": ("uniform", "storage", "storage", "storage", "written storage"),
}


class OutOfGpuMemory(UserError):
    """The adapter cannot hold the transport of a picture; main memory and the CPU may."""

    def __init__(self, bytes_wanted: int) -> None:
        super().__init__(
            f"the graphics adapter has no room for another {bytes_wanted / 1e6:.0f} MB of an edited picture",
            hint="bake the view for editing with fewer pixels, or edit without this adapter",
        )  # fmt: skip


@dataclass(frozen=True)
class _Dispatch:
    shader: str
    offset: int  # of its parameters
    group: Any
    workgroups: tuple[int, int]


class Commands:
    """Recorded commands of one canvas. Threads may record and submit concurrently."""

    def __init__(self, device: Any) -> None:
        self._lock = threading.RLock()
        self.device, self._layouts = device, Layouts(device)
        self.timer = PassTimer(device)
        self._recorded: list[_Dispatch | Callable[[Any], None]] = []
        self._bytes = bytearray()
        visible = wgpu.ShaderStage.COMPUTE
        step = self._layouts.of("moving storage", visibility=visible)
        self._bindings = {name: self._layouts.of(*kinds, visibility=visible) for name, kinds in BINDINGS.items()}
        self._pipelines = {name: self._pipeline(name, [step, layout]) for name, layout in self._bindings.items()}
        self._parameters = self.empty(ROOM + REACH)
        self._step = self._layouts.group(step, {"buffer": self._parameters, "offset": 0, "size": REACH})

    @property
    def largest(self) -> int:
        """Largest binding of a buffer, bytes."""
        return int(min(self.device.limits["max-storage-buffer-binding-size"], self.device.limits["max-buffer-size"]))

    def buffer(self, data: NDArray[Any], usage: str = "STORAGE") -> Any:
        """A writable and copyable buffer that holds `data`, of at least one word.

        Raises
        ------
        OutOfGpuMemory
            If the adapter has no room, or the data exceed a shader's binding.
        """
        made = self.empty(data.nbytes, usage)
        self.write(made, data)
        return made

    def write(self, buffer: Any, data: NDArray[Any]) -> None:
        """Send `data` to the beginning of a buffer, after all that was recorded."""
        self.submit()
        if data.size == 0:
            return
        try:
            self.device.queue.write_buffer(buffer, 0, whole_words(data))
        except wgpu.GPUOutOfMemoryError as error:  # the staging copy needs memory, too
            raise OutOfGpuMemory(data.nbytes) from error

    def empty(self, size: int, usage: str = "STORAGE") -> Any:
        """A buffer of `size` zero bytes; raises like `buffer`."""
        if size > self.largest:
            raise OutOfGpuMemory(size)
        flags = wgpu.BufferUsage[usage] | wgpu.BufferUsage.COPY_DST | wgpu.BufferUsage.COPY_SRC
        try:
            return self.device.create_buffer(size=max(16, size + -size % 4), usage=flags)
        except wgpu.GPUOutOfMemoryError as error:
            raise OutOfGpuMemory(size) from error

    def group(self, shader: str, *buffers: Any) -> Any:
        """Bind group 1 of a shader of `BINDINGS`."""
        return self._layouts.group(self._bindings[shader], *buffers)

    def dispatch(self, shader: str, parameters: bytes, work: list[tuple[Any, int, int]]) -> None:
        """Record a dispatch of a shader for each bind group in `work`, with its numbers of workgroups in x and y."""
        assert len(parameters) <= REACH
        with self._lock:
            if len(self._bytes) + len(parameters) > ROOM:
                self.submit()
            offset = len(self._bytes)
            self._bytes += parameters.ljust(len(parameters) + -len(parameters) % ALIGNED, b"\0")
            self._recorded += [_Dispatch(shader, offset, group, (x, y)) for group, x, y in work if x > 0]

    def copy(self, encode: Callable[[Any], None]) -> None:
        """Record a copy between buffers and textures; `encode` receives the command encoder."""
        with self._lock:
            self._recorded.append(encode)

    def submit(self) -> None:
        """Submit all recorded commands."""
        with self._lock:
            self._submit()

    def _submit(self) -> None:
        if not self._recorded:
            return
        if self._bytes:
            self.device.queue.write_buffer(self._parameters, 0, self._bytes)
        encoder = self.device.create_command_encoder()
        compute: Any = None
        for one in self._recorded:
            if not isinstance(one, _Dispatch):
                if compute is not None:
                    compute.end()
                    compute = None
                one(encoder)
                continue
            if compute is None:
                compute = encoder.begin_compute_pass(**self.timer.writes("edit"))
            compute.set_pipeline(self._pipelines[one.shader])
            compute.set_bind_group(0, self._step, [one.offset])
            compute.set_bind_group(1, one.group)
            compute.dispatch_workgroups(*one.workgroups)
        if compute is not None:
            compute.end()
        self.timer.resolve(encoder)
        self.device.queue.submit([encoder.finish()])
        self._recorded, self._bytes = [], bytearray()

    def read(self, buffer: Any, dtype: Any, size: int | None = None) -> NDArray[Any]:
        """The content of a buffer, or its first `size` bytes, after all recorded commands; waits for the GPU."""
        self.submit()
        return np.frombuffer(self.device.queue.read_buffer(buffer, size=size), dtype)

    def _pipeline(self, name: str, layouts: list[Any]) -> Any:
        taps = f"const TAPS = vec4f({', '.join(f'{tap:.9f}' for tap in TAPS)});\n"
        code = assemble(f"edited_{name}.wgsl", given={"wavelet_taps.wgsl": taps})
        return self.device.create_compute_pipeline(
            layout=self.device.create_pipeline_layout(bind_group_layouts=layouts),
            compute={"module": self.device.create_shader_module(code=code), "entry_point": f"{name}_main"},
        )
