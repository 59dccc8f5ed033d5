"""lobes.wgsl agrees with lobes.py.

Inputs are float32 and go to numpy as float32 values in float64. Where float32 itself cannot do better than 1e-5 (the
hazards named in lobes.wgsl: the foot of a narrow lobe amplifies the rounding of h by tan(theta_h)/m^2), the tolerance
says so from that formula instead of the inputs avoiding it.

Clear glass: what it passes straight on is the albedo of its lobes of transmission.

A lobe under one small lamp: the shader's closed form against quadrature over the lamp.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from lambent.core.geometry.directions import normalize
from lambent.materials import lobes
from lambent.materials.bsdf import MaterialBSDF, components, under_fresnel
from lambent.materials.clear import MOST, MOST_TERMS, STRAIGHT, clear_terms, transmittance
from lambent.materials.document import COSINE_NODES, Lobe, Material
from lambent.materials.shader_layout import LOBE_DTYPE, packed_lobes
from lambent.materials.slope_curve import NODES_RHO, curve_rows
from lambent.realtime.gpu.shader_source import assemble
from tests.tools.shader_parity import assert_parity, run_wgsl

STRUCT = Path(lobes.__file__).with_suffix(".wgsl").read_text(encoding="utf-8")
SHADER = assemble("lobes.wgsl", "scattering.wgsl", "lamp_light.wgsl").replace(
    "override LAMBENT_CURVES: bool = false", "const LAMBENT_CURVES = true"
)
RHO2 = NODES_RHO**2
TWO_WIDTHS = tuple((0.7 * np.exp(-np.minimum(2 * RHO2, 700)) + 0.3 * (1 + RHO2) ** -1.6).tolist())
RING = tuple(np.exp(-(((np.sqrt(RHO2) - 1) / 0.4) ** 2).clip(0, 60)).tolist())
ENDS = ((1, 0.9, 1), (1, 0.5, 2), (0.9, 0.0, 3))
FRESNEL = tuple(tuple((np.linspace(high, low, COSINE_NODES) ** power).tolist()) for high, low, power in ENDS)


def declared(lobe: Lobe, rows: tuple[int, int] = (0, 0)) -> str:
    """The constant LOBE of a shader; the lobe's curves are in the table of `lambent_row` from `rows` on."""
    k, r0 = (f"vec3f({','.join(map(str, v))})" for v in (lobe.k, lobe.r0))
    row = packed_lobes([lobe], [rows])[0]
    numbers = ", ".join(f"{row[name]}u" for name in ("side", "distribution", "retro", "shape_row", "fresnel_row"))
    rest = f"{numbers}, {row['widening']}, {row['spread']}"
    return f"const LOBE = LambentLobe({k}, {lobe.mx}, {r0}, {lobe.my}, {lobe.alpha}, {rest});"


def run(call: str, lobe: Lobe, inputs: dict[str, np.ndarray], components: int = 1) -> np.ndarray:
    """Value of a WGSL expression with LOBE for every row of the inputs."""
    curves, ((shape, fresnel),), _ = curve_rows(Material(lobes=(lobe,)))
    declarations = declared(lobe, (shape + 1, fresnel + 1)) + "fn lambent_row(i: u32) -> vec4f { return rows[i]; }"
    tables = {"rows": np.concatenate([np.zeros((1, 4)), curves])}
    return run_wgsl(SHADER, call, inputs, components=components, declarations=declarations, tables=tables)


SHEET = Lobe(side="transmission", mx=0.003, my=0.003, r0=0.04, k=(0.9, 0.5, 0.2), alpha=0.52, distribution="ggx")
MIRRORED = Lobe(mx=0.003, my=0.003, r0=0.08)


def passed(material: Material, degrees: float) -> np.ndarray:
    terms = clear_terms(material)
    assert terms is not None
    return np.array(transmittance(np.cos(np.radians(degrees)), terms))


@pytest.mark.parametrize("degrees", [0.0, 35.0, 60.0, 75.0])
@pytest.mark.parametrize(
    "lobes", [(SHEET, MIRRORED), (SHEET.model_copy(update={"alpha": 0.2, "distribution": "beckmann"}), SHEET)]
)
def test_passes_the_albedo_of_its_lobes(degrees: float, lobes: tuple[Lobe, ...]) -> None:
    through = Material(lobes=tuple(lobe for lobe in lobes if lobe.side == "transmission"))
    wo = np.array([np.sin(np.radians(degrees)), 0.0, np.cos(np.radians(degrees))])
    expected = MaterialBSDF(through).albedo(wo, 1 << 16)
    assert np.allclose(passed(Material(lobes=lobes), degrees), np.minimum(expected, MOST), rtol=0.01)


def test_bright_and_grazing_glass_stays_within_bounds() -> None:
    steep = Material(lobes=(SHEET.model_copy(update={"alpha": 1.0, "k": (1e3, 1.0, 0.0)}),))
    for degrees in (0.0, 89.0, 90.0, 180.0):
        value = passed(steep, degrees)
        assert np.isfinite(value).all() and value[0] == MOST and (value >= 0).all() and value[2] == 0


@pytest.mark.parametrize(
    "material",
    [
        Material(kd=0.5),
        Material(lobes=(MIRRORED,)),
        Material(lobes=(SHEET, SHEET.model_copy(update={"my": 2 * STRAIGHT}))),
        Material(lobes=(SHEET.model_copy(update={"k": (0.0, 0.0, 0.0)}),)),
        Material(kt_d=0.1, lobes=(SHEET,)),
        Material(lobes=(SHEET,) * 5),
    ],
)
def test_what_spreads_light_or_passes_none_is_not_clear(material: Material) -> None:
    assert clear_terms(material) is None


def test_shader_is_the_twin() -> None:
    lobes = tuple(SHEET.model_copy(update={"alpha": alpha, "k": (0.4, alpha, 0.1)}) for alpha in (0.0, 0.48, 0.52, 0.9))
    terms = clear_terms(Material(lobes=lobes))
    assert terms is not None
    cosine = np.append(np.linspace(0, 1, 200), 1e-6).astype(np.float32)
    rows = ", ".join(f"vec4f({', '.join(f'{x:.9g}' for x in row)})" for row in terms)
    got = run_wgsl(
        assemble("lobes.wgsl", "clear.wgsl"), "lambent_clear(cosine, TERMS)", {"cosine": cosine}, components=3,
        declarations=f"const TERMS = array<vec4f, {MOST_TERMS}>({rows});",
    )  # fmt: skip
    assert_parity(got, np.stack(transmittance(cosine.astype(float), terms), axis=-1).astype(np.float32), rtol=1e-4)


LIT = {
    "satin": Lobe(mx=0.1, my=0.1, r0=(0.9, 0.7, 0.4), alpha=0.4),
    "rough": Lobe(mx=0.4, my=0.4, r0=0.7, alpha=0.5),
    "brushed": Lobe(mx=0.3, my=0.1, r0=0.8, alpha=0.5),
    "ggx": Lobe(mx=0.2, my=0.15, r0=0.5, distribution="ggx"),
    "two widths": Lobe(mx=0.2, my=0.15, fresnel=FRESNEL, distribution="curve", shape=TWO_WIDTHS),
    "transmission": Lobe(mx=0.2, my=0.2, r0=0.1, k=(0.8, 0.7, 0.6), side="transmission"),
    "retro": Lobe(mx=0.15, my=0.2, r0=1.0, k=0.7, retro=True, alpha=-1.5),
}
TOLERANCE = {"ggx": 0.04, "two widths": 0.04}  # of the largest value; a lobe without a variance is widened by a fit


def disc(w: np.ndarray, a: np.ndarray, b: np.ndarray, steps: int = 41) -> np.ndarray:
    """Unit directions (K, 3) spread evenly over an elliptic lamp with the deviations a, b."""
    grid = (np.arange(steps) + 0.5) / steps * 2 - 1
    x, y = np.meshgrid(grid, grid)
    inside = x * x + y * y < 1
    return normalize(w + 2 * (x[inside][:, None] * a + y[inside][:, None] * b))


def viewers(lobe: Lobe, w: np.ndarray, count: int) -> np.ndarray:
    """Directions wo about the middle of the lobe that a lamp at w fills, at least .25 high."""
    turn = np.array([1, 1, -1]) if lobe.side == "transmission" else 1
    mirror = np.array([1, 1, 1]) if lobe.retro else np.array([-1, -1, 1])
    rng = np.random.default_rng(1)
    wo = normalize(w * turn * mirror + rng.normal(size=(4 * count, 3)) * 2 * max(lobe.mx, lobe.my))
    return wo[wo[:, 2] > 0.25][:count]


def response(lobe: Lobe, wo: np.ndarray, w: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """What the shader says of lamps at w (N, 3) with deviations (N, 2, 3), in the frame of the mirror direction."""
    turned = np.array([-1, -1, 1] if lobe.retro else [1, 1, 1]) * ([1, 1, -1] if lobe.side == "transmission" else 1)
    w, axes = np.broadcast_to(w * turned, wo.shape), np.broadcast_to(axes * turned, (len(wo), 2, 3))
    inputs = {"wo": wo, "wi": w, "a": axes[:, 0], "b": axes[:, 1]}
    return run("lambent_lamp_response(LOBE, wo, wi, a, b)", lobe, inputs, 3)


@pytest.mark.parametrize("name", LIT)
@pytest.mark.parametrize("length", [1.0, 4.0])
def test_the_mean_over_a_lamp(name: str, length: float) -> None:
    """Round lamps of .6 of the lobe's width, and others of four times the length."""
    lobe = LIT[name]
    narrow = 0.6 * np.sqrt(lobe.mx * lobe.my) / np.sqrt(2 * length)
    w = normalize(np.array([0.3, 0.2, 0.8])) * ([1, 1, -1] if lobe.side == "transmission" else 1)
    u = normalize(np.cross([0.7, 0.7, 0.2], w))
    axes = np.stack([u * narrow * np.sqrt(length), np.cross(w, u) * narrow / np.sqrt(length)])
    wo = viewers(lobe, w, 40)
    bsdf, wi = MaterialBSDF(Material(name="m", lobes=(lobe,))), disc(w, *axes)
    expected = np.array([(bsdf.eval(wi, np.broadcast_to(o, wi.shape)) * np.abs(wi[:, 2:])).mean(axis=0) for o in wo])
    got = response(lobe, wo, w, axes)
    assert np.abs(got - expected).max() < TOLERANCE.get(name, 0.02) * expected.max()


def test_a_lamp_sets_smoothly() -> None:
    lobe = LIT["rough"]
    height = np.linspace(-0.4, 0.4, 400)
    w = np.stack([np.sqrt(1 - height**2), 0 * height, height], axis=-1)
    up = np.stack([-height, 0 * height, np.sqrt(1 - height**2)], axis=-1)
    side = np.broadcast_to([0.0, 1.0, 0.0], w.shape)
    wo = np.broadcast_to(normalize(np.array([-1, 0, 0.5])), w.shape)
    light = response(lobe, wo, w, 0.08 * np.stack([up, side], 1))[:, 0]
    assert light[height < -0.12].max() == 0
    assert (np.diff(light[height < 0.1]) >= 0).all()
    assert np.diff(light).max() < 0.05 * light.max()


@pytest.mark.parametrize("name", LIT)
def test_a_lamp_without_size_shows_the_lobe(name: str) -> None:
    lobe = LIT[name]
    above = [0, 0, 0.02]  # the shader holds cosines above .001
    wi, wo = normalize(np.abs(np.random.default_rng(3).normal(size=(2, 4000, 3))) + above)
    wi = wi * ([1, 1, -1] if lobe.side == "transmission" else 1)
    wo[:2000, :2] *= -1
    expected = MaterialBSDF(Material(lobes=(lobe,))).eval(wi, wo) * np.abs(wi[:, 2:])
    got = response(lobe, wo, wi, np.zeros((len(wo), 2, 3)))
    assert_parity(got, expected.astype(np.float32), rtol=2e-3, atol=1e-4 * float(expected.max()))


COUNT = 5000
LOBES = [
    Lobe(side=side, distribution=distribution, k=(0.9, 0.5, 0.2), r0=(0.9, 0.5, 0.03), mx=mx, my=my, alpha=alpha)
    for side in ("reflection", "transmission")
    for distribution in ("beckmann", "ggx")
    for mx, my, alpha in ((0.3, 0.3, 0.0), (0.11, 0.5, 0.43), (1.4, 0.8, 1.0))
]
LOBES += [
    Lobe(side=side, distribution="curve", shape=shape, fresnel=fresnel, k=(0.9, 0.5, 0.2), mx=mx, my=my, alpha=0.3)
    for side, shape, fresnel, mx, my in (
        ("reflection", TWO_WIDTHS, FRESNEL, 0.3, 0.3), ("transmission", TWO_WIDTHS, FRESNEL, 0.11, 0.5),
        ("reflection", RING, None, 0.2, 0.2),
    )
]  # fmt: skip
LOBES += [
    Lobe(retro=True, distribution=distribution, k=(0.9, 0.5, 0.2), r0=(0.9, 0.5, 0.03), mx=0.11, my=0.2, alpha=alpha)
    for distribution, alpha in (("beckmann", -4.0), ("ggx", 0.5))
]


def name_of(lobe: Lobe) -> str:
    return f"{'retro' if lobe.retro else lobe.side}-{lobe.distribution}-{lobe.mx}-{lobe.my}-{lobe.alpha}"


@pytest.mark.parametrize("lobe", LOBES, ids=name_of)
def test_distribution_and_sampled_half_vectors(lobe):
    u = np.random.default_rng(0).uniform(0.001, 0.999, (COUNT, 2)).astype(np.float32)  # near 0, log(1 - u) is absolute
    h = np.stack(lobes.sample_half_vector(*u.T.astype(float), lobe), axis=-1)
    got = run("lambent_sample_half_vector(u, LOBE)", lobe, {"u": u}, 3)
    assert_parity(got, h, rtol=1e-5, atol=1e-5)
    h = h.astype(np.float32)
    expected = lobes.distribution(components(h), lobe)
    got = run("lambent_distribution(h, LOBE)", lobe, {"h": h})
    assert_parity(got, expected, rtol=1e-5, atol=1e-6 * expected.max())


@pytest.mark.parametrize("lobe", LOBES, ids=name_of)
def test_tint_and_cosines(lobe):
    cosine = np.random.default_rng(1).uniform(0.1, 1, (COUNT, 2)).astype(np.float32)
    i, o = cosine.T.astype(float)
    expected = np.stack([lobes.tint(i, lobe, c) for c in range(3)], axis=-1) * ((i * o) ** lobe.alpha)[:, None]
    call = "lambent_tint(c.x, LOBE) * lambent_cosine_power(vec3f(0., 0., c.x), vec3f(0., 0., c.y), LOBE)"
    got = run(call, lobe, {"c": cosine}, 3)
    assert_parity(got, expected, rtol=1e-5, atol=1e-6 * expected.max())


@pytest.mark.parametrize("distribution", ["beckmann", "ggx"])
def test_distribution_of_narrow_lobes(distribution):
    lobe = Lobe(mx=0.0068, my=0.0297, distribution=distribution)
    u = np.random.default_rng(3).random((COUNT, 2))
    h = np.stack(lobes.sample_half_vector(*u.T, lobe), axis=-1).astype(np.float32)
    got = run("lambent_distribution(h, LOBE)", lobe, {"h": h})
    assert_parity(got, lobes.distribution(components(h), lobe), rtol=1e-5)


def test_fresnel():
    cosine = np.linspace(0, 1, COUNT, dtype=np.float32)
    expected = np.stack([lobes.fresnel(cosine.astype(float), r0) for r0 in (0.03, 0.5, 1.0)], axis=-1)
    call = "lambent_fresnel(cosine, vec3f(.03, .5, 1.))"
    assert_parity(run_wgsl(STRUCT, call, {"cosine": cosine}, components=3), expected, rtol=1e-5)


def test_under_fresnel():
    cosine = np.geomspace(1e-4, 1, COUNT, dtype=np.float32)
    got = run_wgsl(STRUCT, "lambent_under_fresnel(cosine)", {"cosine": cosine})
    assert_parity(got, under_fresnel(cosine.astype(float)), rtol=1e-5)


def test_layout_is_the_shaders():
    """Name and offset of every field, by WGSL's rules of alignment."""
    body = re.search(r"struct LambentLobe \{(.*?)\}", STRUCT, re.DOTALL)[1]
    align, size = {"f32": 4, "u32": 4, "vec3f": 16}, {"f32": 4, "u32": 4, "vec3f": 12}
    offsets, end = {}, 0
    for name, kind in re.findall(r"^\s*(\w+): (\w+),", body, re.MULTILINE):
        offsets[name] = -(-end // align[kind]) * align[kind]
        end = offsets[name] + size[kind]
    assert {name: offset for name, (_, offset, *_) in LOBE_DTYPE.fields.items()} == offsets
    assert LOBE_DTYPE.itemsize == -(-end // 16) * 16 == 64
    row = packed_lobes([Lobe(side="transmission", distribution="ggx", mx=0.1, my=0.2, k=0.5)])[0]
    assert (row["side"], row["distribution"]) == (1, 1) and row["k"].tolist() == [0.5] * 3
