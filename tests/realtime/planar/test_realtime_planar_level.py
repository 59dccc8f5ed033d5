"""The MIP level of a look-up in a planar reflection buffer: as many texels as the sample's solid angle covers there."""

from __future__ import annotations

import re

import numpy as np

from lambent.core.geometry.directions import basis, normalize
from lambent.realtime.gpu.shader_source import assemble
from tests.tools.shader_parity import run_wgsl

FOCAL_PX = 300.0


def part(kind: str, name: str) -> str:
    """A function or a struct of planar.wgsl."""
    source = assemble("planar.wgsl", given={"look_up.wgsl": ""})
    found = re.search(rf"^{kind} {name}\b.*?^}}\n", source, re.MULTILINE | re.DOTALL)
    assert found, name
    return found[0]


def test_level_is_that_of_the_projected_solid_angle() -> None:
    """By the determinant of the projection to texels, from differences: also far off the axis and on leaning planes."""
    rng = np.random.default_rng(5)
    count = 3000
    right, up, forward = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    view = rng.uniform(-1.2, 1.2, (count, 2))  # up to 60 degrees off the axis
    rays = forward + view[:, :1] * right + view[:, 1:] * up
    hit = rays * rng.uniform(2, 6, (count, 1))
    start = hit + rng.normal(size=(count, 3))  # of the sample's ray, on the reflector
    w, t = normalize(hit - start), np.linalg.norm(hit - start, axis=1)
    plane = normalize(rng.normal(size=(count, 3)))
    plane *= -np.sign((plane * hit).sum(axis=1, keepdims=True))

    def texels(w: np.ndarray) -> np.ndarray:
        """Where rays along w (count, 3) meet the planes, in texels from the middle of the buffer."""
        q = start + w * (((hit - start) * plane).sum(axis=1) / (w * plane).sum(axis=1))[:, None]
        return FOCAL_PX * np.stack([q @ right, -(q @ up)], axis=-1) / (q @ forward)[:, None]

    step = 1e-6
    first, second = (
        (texels(w + step * side) - texels(w - step * side)) / (2 * step) for side in basis(w)
    )  # texels per radian across the ray
    area = np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    d = np.linalg.norm(hit, axis=1)
    turned = np.abs((plane * hit).sum(axis=1)) / d / np.abs((plane * w).sum(axis=1))
    kept = (turned > 0.1) & (turned < 4)  # between the bounds of the shader
    assert kept.mean() > 0.5 and np.quantile(np.linalg.norm(view, axis=1), 0.9) > 1
    omega = rng.uniform(1e-4, 1e-1, count)
    source = part("struct", "Hit") + part("fn", "level_of")
    declared = (
        "struct View { row_w: vec4f, focal_px: f32 }\n"
        f"const mirrored = View(vec4f({', '.join(map(str, forward))}, 0.0), {FOCAL_PX});\n"
    )
    given = {"q": hit, "t": t, "n": plane, "w": w, "omega": 0.5 * np.log2(omega)}
    call = "level_of(Hit(q, t, vec4f(n, dot(n, q)), vec2f(0.0), 1.0), w, omega)"
    level = run_wgsl(source, call, given, declarations=declared)
    np.testing.assert_allclose(level[kept], 0.5 * np.log2(omega * area)[kept], atol=2e-3)
