"""Run a WGSL function over arrays by a compute pass, and compare what it says with numpy.

got = run_wgsl(source, "lambent_pdf(wi, wo, LOBE)", {"wi": wi, "wo": wo}, declarations="const LOBE = ...;")
assert_parity(got, expected, rtol=1e-5)
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

GROUP = 64
TYPES = {1: "f32", 2: "vec2f", 3: "vec3f", 4: "vec4f"}


@functools.cache
def gpu_device() -> Any:
    """The default GPU device (a software one will do); skips the test where there is none."""
    import wgpu

    try:
        return wgpu.gpu.request_adapter_sync(power_preference="high-performance").request_device_sync()
    except RuntimeError as error:
        pytest.skip(f"no GPU adapter: {error}")


def run_wgsl(
    source: str,
    expression: str,
    inputs: Mapping[str, np.ndarray],
    *,
    components: int = 1,
    declarations: str = "",
    tables: Mapping[str, np.ndarray] | None = None,
) -> np.ndarray:
    """Value of a WGSL expression for every row of the inputs.

    Parameters
    ----------
    source : str
        WGSL without bindings or entry points.
    expression : str
        WGSL of type f32, or vecNf with `components` = N; each input stands in it under its name.
    inputs : mapping of name to (N,) or (N, 2..4) array
        Sent as float32.
    declarations : str
        More WGSL at module scope, such as constants.
    tables : mapping of name to (rows, 4) array
        Storage buffers `array<vec4f>` of that name, the same for every row of the inputs.

    Returns
    -------
    (N,) or (N, components) float32
    """
    arrays = {name: np.ascontiguousarray(value, np.float32) for name, value in inputs.items()}
    (count,) = {len(value) for value in arrays.values()}
    bindings, reads = [], []
    for slot, (name, value) in enumerate(arrays.items()):
        width = 1 if value.ndim == 1 else value.shape[1]
        parts = ", ".join(f"in_{name}[row * {width}u + {c}u]" for c in range(width))
        bindings.append(f"@group(0) @binding({slot}) var<storage, read> in_{name}: array<f32>;")
        reads.append(f"let {name} = {TYPES[width]}({parts});")
    rows = {name: np.ascontiguousarray(value, np.float32) for name, value in (tables or {}).items()}
    bindings += [
        f"@group(0) @binding({len(arrays) + slot}) var<storage, read> {name}: array<vec4f>;"
        for slot, name in enumerate(rows)
    ]
    out = len(arrays) + len(rows)
    stores = [
        f"out[row * {components}u + {c}u] = value{f'[{c}]' if components > 1 else ''};" for c in range(components)
    ]
    shader = f"""{source}
{declarations}
{chr(10).join(bindings)}
@group(0) @binding({out}) var<storage, read_write> out: array<f32>;
@compute @workgroup_size({GROUP})
fn main(@builtin(global_invocation_id) id: vec3u) {{
    let row = id.x;
    if row >= {count}u {{ return; }}
    {chr(10).join(reads)}
    let value: {TYPES[components]} = {expression};
    {chr(10).join(stores)}
}}"""
    values = dispatched(shader, [*arrays.values(), *rows.values()], count * components, -(-count // GROUP))
    return values if components == 1 else values.reshape(count, components)


def dispatched(shader: str, arrays: list[np.ndarray], size: int, groups: int) -> np.ndarray:
    """(size,) float32 that a compute shader writes to its last binding; `arrays` are those before."""
    import wgpu

    device = gpu_device()
    use = wgpu.BufferUsage
    buffers = [device.create_buffer_with_data(data=array.ravel(), usage=use.STORAGE | use.UNIFORM) for array in arrays]
    result = device.create_buffer(size=size * 4, usage=use.STORAGE | use.COPY_SRC)
    pipeline = device.create_compute_pipeline(
        layout="auto", compute={"module": device.create_shader_module(code=shader), "entry_point": "main"}
    )
    entries = [{"binding": i, "resource": {"buffer": b}} for i, b in enumerate([*buffers, result])]
    group = device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries)
    encoder = device.create_command_encoder()
    compute = encoder.begin_compute_pass()
    compute.set_pipeline(pipeline)
    compute.set_bind_group(0, group)
    compute.dispatch_workgroups(groups)
    compute.end()
    device.queue.submit([encoder.finish()])
    return np.frombuffer(device.queue.read_buffer(result), np.float32).copy()


def assert_parity(got: np.ndarray, expected: np.ndarray, *, rtol: float = 1e-5, atol: float = 0.0) -> None:
    """Fail where shader and numpy differ, naming the worst row; fails too where there is nothing to compare."""
    assert got.shape == expected.shape and got.size, f"shapes {got.shape} and {expected.shape}"
    assert np.isfinite(got).all(), f"{np.count_nonzero(~np.isfinite(got))} values of the shader are not finite"
    assert np.any(expected != 0), "numpy says 0 everywhere: nothing is compared"
    excess = np.abs(got - expected) - (atol + rtol * np.abs(expected))
    worst = np.unravel_index(np.argmax(excess), got.shape)
    assert excess[worst] <= 0, f"row {worst}: shader {got[worst]!r}, numpy {expected[worst]!r}"
