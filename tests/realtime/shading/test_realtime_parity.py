"""Maths that stands in WGSL and in numpy says the same in both."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lambent.core.geometry.directions import normalize, reflect
from lambent.core.geometry.octahedral import from_square
from lambent.core.light import colour
from lambent.core.light.false_colour import STOPS, Range, false_colour
from lambent.core.light.photometry import LM_PER_W
from lambent.materials.shader_layout import lobe_shader
from lambent.realtime.gpu.shader_source import assemble
from lambent.realtime.integrators import albedo, patterns
from lambent.realtime.planar import planar_pass as planar
from lambent.store import contract
from tests.tools.shader_parity import assert_parity, run_wgsl

RNG = np.random.default_rng(7)
RADIANCE = RNG.gamma(0.5, 2.0, (4000, 3))
UNIT = normalize(RNG.normal(size=(4000, 3)))


@pytest.mark.parametrize(
    ("expression", "numpy", "given"),
    [
        ("luminance(c)", colour.luminance, RADIANCE),
        ("clamp(filmic(c), vec3f(0.0), vec3f(1.0))", colour.filmic, RADIANCE),
        ("clamp(neutral(c), vec3f(0.0), vec3f(1.0))", colour.neutral, RADIANCE),
        ("srgb_encode(c)", colour.srgb_encode, np.clip(RADIANCE, 0, 1)),
    ],
    ids=["luminance", "filmic", "neutral", "srgb"],
)
def test_colour(expression: str, numpy: Any, given: np.ndarray) -> None:
    expected = numpy(given)
    got = run_wgsl(assemble("colour.wgsl"), expression, {"c": given}, components=expected[0].size)
    assert_parity(got, expected.astype(np.float32), rtol=2e-5, atol=2e-6)


def test_the_largest_half_float() -> None:
    assert run_wgsl(assemble("colour.wgsl"), "x * HALF_MAX", {"x": np.ones(1)})[0] == colour.HALF_MAX


@pytest.mark.parametrize("log", [True, False])
def test_false_colours(log: bool) -> None:
    scale = Range(20.0, 900.0, log)
    source = assemble("false_colour.wgsl").replace("@group(0) @binding(0) var<uniform> frame: Frame;", "")
    source = source.replace("@group(0) @binding(1) var linear_sampler: sampler;", "")
    numbers = f"vec4f({scale.low}, {scale.high}, {float(log)}, {LM_PER_W})"
    declarations = (
        "var<private> frame = Frame();\n"
        f"fn shown(c: vec3f) -> vec3f {{ frame.scale = {numbers}; return false_colour(c); }}"
    )
    got = run_wgsl(source, "shown(c)", {"c": RADIANCE}, components=3, declarations=declarations)
    expected = false_colour(LM_PER_W * colour.luminance(RADIANCE), scale)
    assert_parity(got, expected.astype(np.float32), atol=1e-3 * float(np.ptp(STOPS)))
    assert len(np.unique(got, axis=0)) > 1000


def test_directions_mirrored_about_a_half_vector() -> None:
    about = UNIT[::-1].copy()
    got = run_wgsl(lobe_shader(), "lambent_mirrored(w, h)", {"w": UNIT, "h": about}, components=3)
    assert_parity(got, reflect(UNIT, about).astype(np.float32), atol=1e-6)


def test_perpendiculars_and_octahedral_coordinates() -> None:
    source = assemble("directions.wgsl")
    w = np.concatenate([UNIT, np.eye(3), -np.eye(3)])
    t = run_wgsl(source, "perpendicular(w)", {"w": w}, components=3)
    np.testing.assert_allclose((t * w).sum(axis=-1), 0, atol=1e-6)
    assert np.linalg.norm(t, axis=-1).min() > 0.7
    there = run_wgsl(source, "octahedral(w)", {"w": w}, components=2)
    np.testing.assert_allclose(from_square(0.5 * there.astype(float) + 0.5), w, atol=1e-6)
    got = run_wgsl(source, "max_norm(w)", {"w": w})
    np.testing.assert_allclose(got, np.abs(w).max(axis=-1), rtol=1e-6)


@pytest.mark.parametrize(
    ("shader", "declared"),
    [
        ("albedo_factor", f"const FACTOR_ROWS = {albedo.FACTORS // 4}u;"),
        ("split_sum", f"const LAST_LEVEL = {albedo.LEVELS - 1}.0;"),
        ("lobes", f"const LAMBENT_COS_MIN: f32 = {patterns.COS_MIN:.0e};".replace("e-0", "e-")),
        ("planar_buffer_sky", f"const FAR = {contract.FAR:.0e};".replace("e+0", "e")),
        ("planar_layers", f"const PLANAR_NARROW = {planar.FOUND};"),
        ("planar_layers", f"const PLANAR_LEAST = {planar.FOUND + planar.CLEANED - 1};"),
    ],
)
def test_constants_that_stand_in_both(shader: str, declared: str) -> None:
    assert declared in assemble(f"{shader}.wgsl", given={"look_up.wgsl": ""})
