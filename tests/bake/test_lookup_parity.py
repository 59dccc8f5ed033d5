"""Look-ups in probes: numpy's version, by which a bake judges its probes, is the renderer's shader."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import wgpu

import lambent
from lambent.core.cubemap import face_directions
from lambent.core.directions import normalize
from lambent.core.probe_lookups import (
    FIRST,
    GROWTH,
    PLANE_ACTIVE_M,
    SECANTS,
    STEPS,
    distance_lookup,
    inverse_depth,
    planes_lookup,
)
from tests.tools.shader_parity import gpu_device

SHADERS = Path(lambent.__file__).parent / "realtime"
RAYS, TEXELS = 512, 32
OURS = """
struct Ray { x: vec4f, w: vec4f }
@group(0) @binding(0) var<storage, read> rays: array<Ray>;
@group(0) @binding(1) var<storage, read_write> found: array<vec4f>;
@group(0) @binding(2) var<storage, read> planes: array<vec4f>;
@group(0) @binding(3) var inverse_depth_cube: texture_cube<f32>;
@group(0) @binding(4) var linear_sampler: sampler;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3u) {
    let ray = rays[id.x];
    let seen = NAME(ray.x.xyz, ray.w.xyz);
    found[id.x] = vec4f(seen.direction, planes[0].w * 0.0 + inverse_depth_cube_is_used());
}
fn inverse_depth_cube_is_used() -> f32 {
    return textureSampleLevel(inverse_depth_cube, linear_sampler, vec3f(1.0), 0.0).r * 0.0;
}
"""


def shader_of(look_up: str) -> tuple[str, str]:
    """The function of a look-up, and its shader with all that it uses but bindings."""
    own = SHADERS / "incident" / f"{look_up}.wgsl"
    name = "incident_look_up" if own.exists() else f"{look_up}_lookup"
    files = [own] if own.exists() else []
    text = "\n".join(path.read_text() for path in [*files, *sorted((SHADERS / "shaders").glob("*.wgsl"))])
    text = re.sub(r"//.*", "", text)
    wanted, code = [name], {}
    while wanted:
        one = wanted.pop()
        pattern = rf"^(fn {one}\(.*?^}}|struct {one} {{.*?^}}|const {one}\b[^;]*;|override {one}\b[^;]*;)"
        found = re.search(pattern, text, re.M | re.S)
        if found and one not in code:
            code[one] = found[0]
            wanted += re.findall(r"[A-Za-z_]\w*", found[0])
    return name, "\n".join(code.values())


def on_gpu(look_up: str, x: np.ndarray, w: np.ndarray, planes: np.ndarray, inverse: np.ndarray) -> np.ndarray:
    """Directions (n, 3) that the shader finds, for bounding planes (P, 4) and the cube of `inverse_depth`."""
    name, code = shader_of(look_up)
    device: Any = gpu_device()
    use, data = wgpu.BufferUsage, np.zeros((len(x), 2, 4), np.float32)
    data[:, 0, :3], data[:, 1, :3] = x, w
    given = device.create_buffer_with_data(data=data, usage=use.STORAGE)
    out = device.create_buffer(size=16 * len(x), usage=use.STORAGE | use.COPY_SRC)
    of_planes = device.create_buffer_with_data(data=planes.astype(np.float32), usage=use.STORAGE)
    usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
    cube = device.create_texture(size=(TEXELS, TEXELS, 6), format="r16float", usage=usage)
    layout, size = {"bytes_per_row": 2 * TEXELS, "rows_per_image": TEXELS}, (TEXELS, TEXELS, 6)
    device.queue.write_texture({"texture": cube}, np.ascontiguousarray(inverse, np.float16), layout, size)
    module = device.create_shader_module(code=code + OURS.replace("NAME", name))
    constants = {"PLANES": len(planes)} if "override PLANES" in code else {}
    compute = {"module": module, "entry_point": "main", "constants": constants}
    pipeline = device.create_compute_pipeline(layout="auto", compute=compute)
    sampler = device.create_sampler(mag_filter="linear", min_filter="linear")
    resources = [*({"buffer": b} for b in (given, out, of_planes)), cube.create_view(dimension="cube"), sampler]
    entries = [{"binding": i, "resource": resource} for i, resource in enumerate(resources)]
    group = device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries)
    encoder = device.create_command_encoder()
    run = encoder.begin_compute_pass()
    run.set_pipeline(pipeline)
    run.set_bind_group(0, group)
    run.dispatch_workgroups(len(x) // 64)
    run.end()
    device.queue.submit([encoder.finish()])
    return np.frombuffer(device.queue.read_buffer(out), np.float32).reshape(-1, 4)[:, :3]


@pytest.fixture(scope="module")
def rays() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(2)
    return rng.uniform(-0.6, 0.6, (RAYS, 3)), normalize(rng.normal(size=(RAYS, 3)))


def room() -> tuple[np.ndarray, np.ndarray]:
    """A room about the probe, as planes and as distances (6, N, N), and a low wall that only the distances have."""
    planes = np.array([[-1, 0, 0, 1.5], [1, 0, 0, 1.0], [0, -1, 0, 1.2], [0, 1, 0, 0.9], [0, 0, 1, 2.0]], float)
    w = normalize(face_directions(TEXELS))
    inverse = np.maximum((-(w @ planes[:, :3].T) / planes[:, 3]).max(axis=-1), 1e-3)
    pillar = (np.abs(w[..., 0]) < 0.2) & (w[..., 2] < -0.7)
    return planes, np.where(pillar, 1 / 1.4, 1 / inverse)


def test_planes_are_looked_up_alike(adapter: None, rays: tuple[np.ndarray, np.ndarray]) -> None:
    planes, distance = room()
    found = on_gpu("planes", *rays, planes, inverse_depth(distance))
    expected = planes_lookup(*rays, planes)
    np.testing.assert_allclose(normalize(found), normalize(expected), atol=2e-5)
    assert (np.abs(normalize(expected) - rays[1]).max(axis=1) > 0.05).mean() > 0.5, "planes turn the look-up"


def test_distances_are_marched_alike(adapter: None, rays: tuple[np.ndarray, np.ndarray]) -> None:
    """But for rays that graze the pillar, where a rounding decides which step is the first behind it."""
    planes, distance = room()
    inverse = inverse_depth(distance).astype(np.float16).astype(float)
    found = on_gpu("distance", *rays, planes, inverse)
    expected = distance_lookup(*rays, inverse)
    off = np.linalg.norm(normalize(found) - normalize(expected), axis=1)
    assert np.quantile(off, 0.95) < 2e-3, np.quantile(off, [0.5, 0.9, 0.95, 0.99])
    assert (np.linalg.norm(normalize(expected) - rays[1], axis=1) > 0.05).mean() > 0.5


def test_constants_are_those_of_the_shader() -> None:
    march, planes = shader_of("distance")[1], shader_of("planes")[1]
    bounds = {tuple(map(float, pair)) for pair in re.findall(r"-1e-9\), ([\d.]+), ([\d.]+)\)", march)}
    assert f"const STEPS = {STEPS}u;" in march and f"far *= {GROWTH};" in march and f"{FIRST} * reach" in march
    assert bounds == set(SECANTS) and len(SECANTS) == 4 and f"i < {len(SECANTS) - 1}u" in march
    assert float(re.search(r"PLANE_ACTIVE_M = ([\de.-]+);", planes)[1]) == PLANE_ACTIVE_M
