"""The prefiltered cube map of split-sum: light averaged over an isotropic lobe about each texel, by roughness."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.geometry.cubemap import directions_at
from lambent.materials.document import Lobe
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.pipelines import cover, screen_pipeline
from lambent.realtime.gpu.structs import PREFILTER_DTYPE
from lambent.realtime.gpu.targets import target_texture
from lambent.realtime.integrators.albedo import LEVELS
from lambent.realtime.integrators.patterns import density, lobe_points

FORMAT = "rgba16float"
SAMPLES = 64


def prefiltered_cube(layouts: Layouts, source: Any, sampler: Any) -> Any:
    """Cube texture of at most LEVELS levels: the light of the cube texture `source` blurred for each roughness."""
    device, n = layouts.device, source.size[0]
    levels = min(LEVELS, n.bit_length())
    target = target_texture(device, (n, n, 6), FORMAT, levels)
    layout = layouts.of("uniform", "sampler", "storage", "cube")
    pipeline = screen_pipeline(device, "prefilter", [layout], [FORMAT])
    samples = layouts.buffer("STORAGE", _samples())
    # Columns of each face for clip coordinates (y up): direction = s x + t y + axis.
    corners = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
    axis, right, below = (directions_at(np.arange(6), np.full(6, s), np.full(6, t)) for s, t in corners)
    columns = {"s": right - axis, "t": axis - below, "axis": axis}
    encoder = device.create_command_encoder()
    for level, face in np.ndindex(levels, 6):
        record = np.zeros((), PREFILTER_DTYPE)
        for name, column in columns.items():
            record[name][:3] = column[face]
        record["m"] = (level / (LEVELS - 1)) ** 2
        record["texels"] = np.log2(n / 2)
        uniform = layouts.buffer("UNIFORM", record)
        group = layouts.group(layout, uniform, sampler, samples, source.create_view(dimension="cube"))
        view = target.create_view(
            dimension="2d", base_mip_level=level, mip_level_count=1, base_array_layer=face, array_layer_count=1
        )
        cover(encoder, [view], pipeline, [group], {})
    device.queue.submit([encoder.finish()])
    return target


def _samples() -> NDArray[np.float32]:
    """(SAMPLES, 4): slopes in units of m, and half the log2 of 4 pi/(n density)."""
    round_lobe = Lobe(mx=1.0, my=1.0)
    slopes = lobe_points(SAMPLES, round_lobe)
    half_log2 = 0.5 * np.log2(4 * np.pi / (SAMPLES * density(slopes, round_lobe)))
    return np.column_stack([slopes, half_log2, np.zeros(SAMPLES)]).astype(np.float32)
