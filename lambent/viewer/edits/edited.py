"""The GPU canvas of edited pictures, which reads the transport of a store."""

from __future__ import annotations

from typing import Any

from lambent.core.arrays import Floats, Indices
from lambent.editing.products import Products
from lambent.editing.rows import PairTransport
from lambent.editing.stored import StoredPairs
from lambent.realtime.edited.canvas import GpuCanvas
from lambent.realtime.edited.layer import GpuLayer
from lambent.realtime.gpu.device import adapter_info


class _ShadedLayer(GpuLayer):
    """A layer on the GPU that reads the transport of a store."""

    def fold(self, pairs: PairTransport, idle: int, means: Floats) -> tuple[Products, float]:
        if not isinstance(pairs, StoredPairs):
            rows = pairs.fold(idle, means)
            return self.hold(rows.values), rows.unit
        edited = 1 - idle
        products, scale = self.fold_pairs(pairs.spans, pairs.steps, pairs.values, means, edited, pairs.counts[edited])
        return products, pairs.unit * scale


class ShadedCanvas(GpuCanvas):
    """Canvas of compute shaders, which draw into `texture`."""

    def layer(self, pixel: Indices, theta_o: Floats) -> _ShadedLayer:
        return _ShadedLayer(self._commands, self._texels(pixel), theta_o, self._image)


def sums(device: Any) -> bool:
    """Whether a device sums faster than numba on the CPU, as hardware GPUs do (docs/editing.md)."""
    return not adapter_info(device).is_software
