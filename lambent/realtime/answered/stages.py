"""Compute shaders of the answer and their buffers, within WebGPU's default limits."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.core.answer import MOST_EXCESS, MOST_RATIO
from lambent.core.answer_loops import NO_LIGHT
from lambent.core.answer_rays import WEIGHT_ONE, WEIGHT_STEPS
from lambent.core.colour import HALF_MAX
from lambent.realtime.device import adapter_info
from lambent.realtime.layouts import Layouts
from lambent.realtime.shader_source import assemble
from lambent.realtime.uploads import whole_words

GROUP = 256  # threads of a workgroup, as in the shaders
READ, WRITTEN = "storage", "written storage"
BINDINGS = {
    "solve": ("uniform", READ, READ, READ, READ, READ, WRITTEN, WRITTEN, WRITTEN),
    "exitance": ("uniform", READ, READ, READ, READ, READ, READ, WRITTEN),
    "gather": ("uniform", READ, READ, READ, READ, READ, WRITTEN),
    "smooth": ("uniform", READ, READ, WRITTEN),
    "texels": ("uniform", READ, READ, READ, READ, READ, WRITTEN),
    "show": ("uniform", READ, READ, "written half layers"),
}
CONSTANTS = f"""const MOST_RATIO = {MOST_RATIO:.9g}f;
const MOST_EXCESS = {MOST_EXCESS:.9g}f;
const NO_LIGHT = {float(NO_LIGHT):.9g}f;
const WEIGHT_ONE = {WEIGHT_ONE:.9g}f;
const WEIGHT_STEPS = {WEIGHT_STEPS:.9g}f;
const HALF_MAX = {HALF_MAX:.9g}f;
"""


class NoRoom(Exception):
    """The adapter cannot hold an answer, or an array exceeds a shader's binding."""


def computes(device: Any) -> bool:
    """Whether a device computes answers faster than the CPU, as hardware GPUs do."""
    return not adapter_info(device).is_software


@dataclass(frozen=True)
class Call:
    """One dispatch of a stage with its bindings."""

    stage: str
    group: Any
    workgroups: int


class Stages:
    """The stages on one device. Threads may submit concurrently."""

    def __init__(self, device: Any) -> None:
        self.device, self._layouts = device, Layouts(device)
        visible = wgpu.ShaderStage.COMPUTE
        self._bindings = {name: self._layouts.of(*kinds, visibility=visible) for name, kinds in BINDINGS.items()}
        self._pipelines = {name: self._pipeline(name, layout) for name, layout in self._bindings.items()}

    def buffer(self, data: NDArray[Any]) -> Any:
        """A buffer that holds an array, padded to whole words.

        Raises
        ------
        NoRoom
            If the adapter has no room, or the array exceeds a shader's binding.
        """
        made = self.empty(data.nbytes)
        self.write(made, data)
        return made

    def empty(self, size: int) -> Any:
        """A buffer of `size` zero bytes; raises like `buffer`."""
        limits = self.device.limits
        if size > min(limits["max-storage-buffer-binding-size"], limits["max-buffer-size"]):
            raise NoRoom
        usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_DST | wgpu.BufferUsage.COPY_SRC
        try:
            return self.device.create_buffer(size=max(16, size + -size % 4), usage=usage)
        except wgpu.GPUOutOfMemoryError as error:
            raise NoRoom from error

    def write(self, buffer: Any, data: NDArray[Any]) -> None:
        """Send an array to the beginning of a buffer."""
        if data.size == 0:
            return
        try:
            self.device.queue.write_buffer(buffer, 0, whole_words(data))
        except wgpu.GPUOutOfMemoryError as error:  # the staging copy needs memory, too
            raise NoRoom from error

    def read(self, buffer: Any, dtype: type, count: int) -> NDArray[Any]:
        """The first `count` elements of a buffer as an array (count,); waits for the GPU."""
        size = count * np.dtype(dtype).itemsize
        if count == 0:
            return np.zeros(0, dtype)
        return np.frombuffer(self.device.queue.read_buffer(buffer, size=size), dtype)

    def call(self, stage: str, parameters: tuple[int | float, ...], *resources: Any, threads: int) -> Call:
        """A dispatch over `threads`; `parameters` begin the stage's uniform, `resources` are in binding order."""
        words = [np.float32(one).view(np.uint32) if isinstance(one, float) else np.uint32(one) for one in parameters]
        uniform = self._layouts.buffer("UNIFORM", np.array([*words, *[0] * (4 - len(words))], np.uint32))
        workgroups = -(-threads // GROUP)
        if workgroups > self.device.limits["max-compute-workgroups-per-dimension"]:
            raise NoRoom
        return Call(stage, self._layouts.group(self._bindings[stage], uniform, *resources), workgroups)

    def submit(self, calls: Iterable[Call]) -> None:
        """Submit calls together, in order: each may read the results of earlier ones."""
        encoder = self.device.create_command_encoder()
        compute = encoder.begin_compute_pass()
        for call in calls:
            if call.workgroups:
                compute.set_pipeline(self._pipelines[call.stage])
                compute.set_bind_group(0, call.group)
                compute.dispatch_workgroups(call.workgroups)
        compute.end()
        self.device.queue.submit([encoder.finish()])

    def _pipeline(self, name: str, layout: Any) -> Any:
        code = assemble(f"answer_{name}.wgsl", given={"answer_constants.wgsl": CONSTANTS})
        return self.device.create_compute_pipeline(
            layout=self.device.create_pipeline_layout(bind_group_layouts=[layout]),
            compute={"module": self.device.create_shader_module(code=code), "entry_point": f"{name}_main"},
        )
