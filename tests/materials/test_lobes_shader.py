"""lobes.wgsl agrees with lobes.py.

Inputs are float32 and go to numpy as float32 values in float64. Where float32 itself cannot do better than 1e-5 (the
hazards named in lobes.wgsl: the foot of a narrow lobe amplifies the rounding of h by tan(theta_h)/m^2), the tolerance
says so from that formula instead of the inputs avoiding it.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from lambent.core.directions import direction
from lambent.materials import lobes
from lambent.materials.bsdf import components, under_fresnel
from lambent.materials.document import Lobe
from lambent.materials.shader_layout import LOBE_DTYPE, packed_lobes
from tests.tools.shader_parity import assert_parity, run_wgsl

SHADER = Path(lobes.__file__).with_suffix(".wgsl").read_text(encoding="utf-8")
COUNT = 5000
LOBES = [
    Lobe(side=side, distribution=distribution, k=(0.9, 0.5, 0.2), r0=(0.9, 0.5, 0.03), mx=mx, my=my, alpha=alpha)
    for side in ("reflection", "transmission")
    for distribution in ("beckmann", "ggx")
    for mx, my, alpha in ((0.3, 0.3, 0.0), (0.11, 0.5, 0.43), (1.4, 0.8, 1.0))
]
LOBES += [
    Lobe(retro=True, distribution=distribution, k=(0.9, 0.5, 0.2), r0=(0.9, 0.5, 0.03), mx=0.11, my=0.2, alpha=alpha)
    for distribution, alpha in (("beckmann", -4.0), ("ggx", 0.5))
]


def name_of(lobe: Lobe) -> str:
    return f"{'retro' if lobe.retro else lobe.side}-{lobe.distribution}-{lobe.mx}-{lobe.my}-{lobe.alpha}"


def declared(lobe: Lobe) -> str:
    k, r0 = (f"vec3f({','.join(map(str, v))})" for v in (lobe.k, lobe.r0))
    row = packed_lobes([lobe])[0]
    return (
        f"const LOBE = LambentLobe({k}, {lobe.mx}, {r0}, {lobe.my}, {lobe.alpha}, "
        f"{row['side']}u, {row['distribution']}u, {row['retro']}u);"
    )


def pairs(lobe: Lobe, seed: int = 0):
    """wo anywhere on the sphere and wi on the lobe, both unit to float32."""
    rng = np.random.default_rng(seed)
    cosine = rng.uniform(0.1, 1, COUNT) * rng.choice([-1, 1], COUNT)
    wo = direction(np.arccos(cosine), rng.uniform(0, 2 * np.pi, COUNT)).astype(np.float32)
    u = rng.uniform(0.001, 0.999, (COUNT, 2)).astype(np.float32)  # log(1 - u) in float32 is absolute near u = 0
    wi = np.stack(lobes.sample(components(wo), *u.T.astype(float), lobe), axis=-1).astype(np.float32)
    seen = np.abs(wi[:, 2]) > 0.01
    return wi[seen], wo[seen], u[seen]


@pytest.mark.parametrize("lobe", LOBES, ids=name_of)
@pytest.mark.parametrize("function", ["evaluate", "pdf", "weight"])
def test_functions_of_two_directions(lobe, function):
    wi, wo, _ = pairs(lobe)
    expected = getattr(lobes, function)(components(wi), components(wo), lobe)
    expected = np.stack(expected, axis=-1) if isinstance(expected, tuple) else expected
    call = f"lambent_{function}(wi, wo, LOBE)"
    width = expected.shape[1] if expected.ndim == 2 else 1
    got = run_wgsl(SHADER, call, {"wi": wi, "wo": wo}, components=width, declarations=declared(lobe))
    assert_parity(got, expected, rtol=1e-5, atol=1e-6 * expected.max())


@pytest.mark.parametrize("lobe", LOBES, ids=name_of)
def test_sample(lobe):
    _, wo, u = pairs(lobe)
    expected = np.stack(lobes.sample(components(wo), *u.T.astype(float), lobe), axis=-1)
    inputs = {"wo": wo, "u": u}
    got = run_wgsl(SHADER, "lambent_sample(wo, u, LOBE)", inputs, components=3, declarations=declared(lobe))
    assert_parity(got, expected, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("distribution", ["beckmann", "ggx"])
def test_distribution_of_narrow_lobes(distribution):
    lobe = Lobe(mx=0.0068, my=0.0297, distribution=distribution)
    u = np.random.default_rng(3).random((COUNT, 2))
    h = np.stack(lobes.sample_half_vector(*u.T, lobe), axis=-1).astype(np.float32)
    got = run_wgsl(SHADER, "lambent_distribution(h, LOBE)", {"h": h}, declarations=declared(lobe))
    assert_parity(got, lobes.distribution(components(h), lobe), rtol=1e-5)


def test_fresnel():
    cosine = np.linspace(0, 1, COUNT, dtype=np.float32)
    expected = np.stack([lobes.fresnel(cosine.astype(float), r0) for r0 in (0.03, 0.5, 1.0)], axis=-1)
    call = "lambent_fresnel(cosine, vec3f(.03, .5, 1.))"
    assert_parity(run_wgsl(SHADER, call, {"cosine": cosine}, components=3), expected, rtol=1e-5)


def test_under_fresnel():
    cosine = np.geomspace(1e-4, 1, COUNT, dtype=np.float32)
    got = run_wgsl(SHADER, "lambent_under_fresnel(cosine)", {"cosine": cosine})
    assert_parity(got, under_fresnel(cosine.astype(float)), rtol=1e-5)


@pytest.mark.parametrize("lobe", [LOBES[0], LOBES[-1]], ids=name_of)
def test_pairs_outside_a_lobe_are_zero(lobe):
    wi, wo, _ = pairs(lobe)
    seen = lobes.pdf(components(wi), components(wo), lobe) > 0
    wi, wo = wi[seen], wo[seen]
    wi = wi * np.array([1, 1, -1], np.float32)
    for function in ("evaluate", "weight"):
        call = f"lambent_{function}(wi, wo, LOBE)"
        got = run_wgsl(SHADER, call, {"wi": wi, "wo": wo}, components=3, declarations=declared(lobe))
        assert (got == 0).all()


def test_layout_is_the_shaders():
    """Name and offset of every field, by WGSL's rules of alignment."""
    body = re.search(r"struct LambentLobe \{(.*?)\}", SHADER, re.DOTALL)[1]
    align, size = {"f32": 4, "u32": 4, "vec3f": 16}, {"f32": 4, "u32": 4, "vec3f": 12}
    offsets, end = {}, 0
    for name, kind in re.findall(r"^\s*(\w+): (\w+),", body, re.MULTILINE):
        offsets[name] = -(-end // align[kind]) * align[kind]
        end = offsets[name] + size[kind]
    assert {name: offset for name, (_, offset, *_) in LOBE_DTYPE.fields.items()} == offsets
    assert LOBE_DTYPE.itemsize == -(-end // 16) * 16 == 48
    row = packed_lobes([Lobe(side="transmission", distribution="ggx", mx=0.1, my=0.2, k=0.5)])[0]
    assert (row["side"], row["distribution"]) == (1, 1) and row["k"].tolist() == [0.5] * 3
