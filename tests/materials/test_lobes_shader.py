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


@pytest.mark.parametrize("lobe", LOBES, ids=name_of)
def test_distribution_and_sampled_half_vectors(lobe):
    u = np.random.default_rng(0).uniform(0.001, 0.999, (COUNT, 2)).astype(np.float32)  # near 0, log(1 - u) is absolute
    h = np.stack(lobes.sample_half_vector(*u.T.astype(float), lobe), axis=-1)
    got = run_wgsl(SHADER, "lambent_sample_half_vector(u, LOBE)", {"u": u}, components=3, declarations=declared(lobe))
    assert_parity(got, h, rtol=1e-5, atol=1e-5)
    h = h.astype(np.float32)
    expected = lobes.distribution(components(h), lobe)
    got = run_wgsl(SHADER, "lambent_distribution(h, LOBE)", {"h": h}, declarations=declared(lobe))
    assert_parity(got, expected, rtol=1e-5, atol=1e-6 * expected.max())


@pytest.mark.parametrize("lobe", LOBES, ids=name_of)
def test_tint_and_cosines(lobe):
    cosine = np.random.default_rng(1).uniform(0.1, 1, (COUNT, 2)).astype(np.float32)
    i, o = cosine.T.astype(float)
    expected = np.stack([lobes.tint(i, lobe, c) for c in range(3)], axis=-1) * ((i * o) ** lobe.alpha)[:, None]
    call = "lambent_tint(c.x, LOBE) * lambent_cosine_power(vec3f(0., 0., c.x), vec3f(0., 0., c.y), LOBE)"
    got = run_wgsl(SHADER, call, {"c": cosine}, components=3, declarations=declared(lobe))
    assert_parity(got, expected, rtol=1e-5, atol=1e-6 * expected.max())


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
