"""Split-sum, as today's engines do it (Karis 2013): a cube prefiltered per roughness, and a table of albedos.

Kept for comparison. It is isotropic and knows no view dependence of the lobe's shape.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.core.sequences import hammersley
from lambent.materials.document import Lobe
from lambent.realtime.passes.screen import cover
from lambent.realtime.patterns import radius, relative_density
from lambent.realtime.shader_source import assemble

Floats = NDArray[np.floating]
TABLE_ROWS = 32
LEVELS = 7  # roughness m of level l is (l/(LEVELS - 1))^2: finer steps where they show
SAMPLES = 64
PREFILTER_DTYPE = np.dtype(
    [("s", "f4", 4), ("t", "f4", 4), ("axis", "f4", 4), ("m", "f4"), ("texels", "f4"), ("level", "f4"), ("_", "f4")]
)
# Columns of each cube face for clip coordinates (y up): direction = s x + t y + axis, as in core.cubemap.
_FACES = np.array(
    [
        [(0, 0, -1), (0, 1, 0), (1, 0, 0)],
        [(0, 0, 1), (0, 1, 0), (-1, 0, 0)],
        [(1, 0, 0), (0, 0, -1), (0, 1, 0)],
        [(1, 0, 0), (0, 0, 1), (0, -1, 0)],
        [(1, 0, 0), (0, 1, 0), (0, 0, 1)],
        [(-1, 0, 0), (0, 1, 0), (0, 0, -1)],
    ],
    dtype=np.float32,
)


def roughness_level(lobe: Lobe) -> float:
    """Level of the prefiltered cube for the lobe's mean roughness sqrt(mx my)."""
    return float(min(1.0, (lobe.mx * lobe.my) ** 0.25) * (LEVELS - 1))


def albedo_table(lobe: Lobe, samples: int = 1024) -> Floats:
    """(TABLE_ROWS, 4) float32 rows (A, B, 0, 0) at cos_o = (row + 1/2)/TABLE_ROWS, of the isotropic stand-in.

    With g the lobe's f cos/pdf without k and Fresnel, A = E[(1 - (1 - wo.h)^5) g] and B = E[(1 - wo.h)^5 g]: the
    reflected albedo is k (r0 A + B), the transmitted k (1 - r0) A.
    """
    m = np.sqrt(lobe.mx * lobe.my)
    u1, u2 = hammersley(samples).T
    r, phi = m * radius(u1, lobe.distribution == "ggx"), 2 * np.pi * u2
    h = np.stack([r * np.cos(phi), r * np.sin(phi), np.ones(samples)], axis=-1)
    h /= np.linalg.norm(h, axis=-1, keepdims=True)
    cos_o = (np.arange(TABLE_ROWS)[:, None] + 0.5) / TABLE_ROWS
    cos_d = np.sqrt(1 - cos_o**2) * h[:, 0] + cos_o * h[:, 2]
    cos_i = 2 * cos_d * h[:, 2] - cos_o
    seen = (cos_d > 1e-4) & (cos_i > 1e-4)
    safe = np.where(seen, cos_i, 1.0)
    g = np.where(seen, safe / ((safe * cos_o) ** lobe.alpha * h[:, 2]), 0.0)
    schlick = (1 - np.clip(cos_d, 0, 1)) ** 5
    a, b = ((1 - schlick) * g).mean(axis=1), (schlick * g).mean(axis=1)
    return np.column_stack([a, b, np.zeros((TABLE_ROWS, 2))]).astype(np.float32)


def prefiltered_cube(device: Any, source: Any, sampler: Any) -> Any:
    """A cube texture of LEVELS levels, each the light of the cube texture `source` blurred for its roughness."""
    n = source.size[0]
    levels = min(LEVELS, n.bit_length())
    usage = wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.TEXTURE_BINDING
    target = device.create_texture(size=(n, n, 6), format="rgba16float", mip_level_count=levels, usage=usage)
    module = device.create_shader_module(code=assemble("prefilter.wgsl"))
    pipeline = device.create_render_pipeline(
        layout="auto",
        vertex={"module": module, "entry_point": "screen_main"},
        fragment={"module": module, "entry_point": "prefilter_main", "targets": [{"format": "rgba16float"}]},
        primitive={"topology": "triangle-list"},
    )
    samples = device.create_buffer_with_data(data=_samples(), usage=wgpu.BufferUsage.STORAGE)
    encoder = device.create_command_encoder()
    for level in range(levels):
        for face in range(6):
            uniform = np.zeros((), PREFILTER_DTYPE)
            for name, column in zip(("s", "t", "axis"), _FACES[face], strict=True):
                uniform[name][:3] = column
            uniform["m"] = (level / (LEVELS - 1)) ** 2
            uniform["texels"] = np.log2(n / 2)
            buffer = device.create_buffer_with_data(data=uniform.tobytes(), usage=wgpu.BufferUsage.UNIFORM)
            bindings = [{"buffer": buffer}, sampler, {"buffer": samples}, source.create_view(dimension="cube")]
            group = device.create_bind_group(
                layout=pipeline.get_bind_group_layout(0),
                entries=[{"binding": i, "resource": resource} for i, resource in enumerate(bindings)],
            )
            view = target.create_view(
                dimension="2d", base_mip_level=level, mip_level_count=1, base_array_layer=face, array_layer_count=1
            )
            cover(encoder, view, pipeline, [group], {})
    device.queue.submit([encoder.finish()])
    return target


def _samples() -> Floats:
    """(SAMPLES, 4) float32: slopes in units of m, and half the log2 of 4 pi/(n density)."""
    u1, u2 = hammersley(SAMPLES).T
    slopes = radius(u1)[:, None] * np.stack([np.cos(2 * np.pi * u2), np.sin(2 * np.pi * u2)], axis=-1)
    half_log2 = 0.5 * np.log2(4 * np.pi / (SAMPLES * relative_density(slopes)))
    return np.column_stack([slopes, half_log2, np.zeros(SAMPLES)]).astype(np.float32)
