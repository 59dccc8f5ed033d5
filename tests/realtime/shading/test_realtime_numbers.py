"""Numbers of the shaders that few pictures show: solid angles, MIP levels, widths of lobes, sides of sheets."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.baked.probes.irradiance import basis_of
from lambent.core.geometry.directions import normalize, reflect
from lambent.core.light.colour import luminance
from lambent.core.views.camera import Camera, pixel_rays
from lambent.materials.bsdf import diffuse_seen
from lambent.materials.document import Lobe, Material
from lambent.materials.shader_layout import lobe_shader
from lambent.materials.slope_curve import curve_rows
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.shader_source import assemble
from lambent.realtime.light.baked import Probe
from lambent.realtime.light.probe_light import ProbeLight
from lambent.realtime.objects.unbaked import irradiance, unbaked_scene, with_diffuse_light
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import patch
from lambent.scenes.scene import MaterialTextures, Texture
from tests.realtime.lit_wall import cube_of, smooth_light, wall_scene
from tests.tools.shader_parity import run_wgsl

RNG = np.random.default_rng(11)
BEHIND = Camera(name="behind", position=(0.3, 0.2, -2.0), target=(0.1, 0.0, 0.0), fov_y_deg=30.0)
FROM_BEHIND = FrameState(BEHIND, 8, 8, antialias=False, lookup="plain")


def part(file: str, kind: str, name: str) -> str:
    """A function or a struct of a shader."""
    found = re.search(
        rf"^{kind} {name}\b.*?^}}\n", assemble(file, given={"look_up.wgsl": ""}), re.MULTILINE | re.DOTALL
    )
    assert found, name
    return found[0]


def test_a_sample_stands_for_the_solid_angle_of_its_patch_of_slopes() -> None:
    """A patch of area a about a slope turns into directions by the determinant of their map, from differences."""
    count = 2000
    wo = normalize(np.column_stack([RNG.uniform(-1, 1, (count, 2)), RNG.uniform(0.2, 1.5, count)]))
    slopes = RNG.uniform(-0.8, 0.8, (count, 2))

    def mirrored(slopes: np.ndarray) -> np.ndarray:
        return reflect(wo, normalize(np.column_stack([slopes, np.ones(count)])))

    step = 1e-6
    sides = [(mirrored(slopes + d) - mirrored(slopes - d)) / (2 * step) for d in step * np.eye(2)]
    h = normalize(np.column_stack([slopes, np.ones(count)]))
    cos_d = (h * wo).sum(axis=1)
    kept = cos_d > 0.1
    per_slope = np.linalg.norm(np.cross(*sides), axis=1)
    area, growth = RNG.uniform(1e-3, 1e-1, count), RNG.uniform(0.5, 2, (count, 2))
    source = "".join(
        part("surface.wgsl", kind, name) for kind, name in (("struct", "Sample"), ("fn", "half_log2_omega"))
    )
    source = "struct LobeHere { half_log2_growth: f32 }\n" + source
    call = "half_log2_omega(vec4f(0.0, 0.0, z, 1.0), Sample(h, cos_d, h, true), LobeHere(grown))"
    given = {"z": 0.5 * np.log2(4 * area), "h": h, "cos_d": cos_d, "grown": 0.5 * np.log2(growth.prod(axis=1))}
    found = run_wgsl(source, call, given)
    expected = 0.5 * np.log2(area * growth.prod(axis=1) * per_slope)
    np.testing.assert_allclose(found[kept], expected[kept], atol=2e-3)


def test_level_of_a_look_up_in_a_probe() -> None:
    """omega t^2/d^2 seen from the probe, d away, stretched by 1/cos b^3 on a face of n^2 texels over [-1, 1]^2."""
    count, n = 1000, 128
    p, t = RNG.normal(size=(count, 3)) * 3, RNG.uniform(0.2, 5, count)
    omega = RNG.uniform(1e-3, 0.5, count)
    source = part("surface.wgsl", "fn", "level_of_look_up")
    declared = """struct Object { centre: vec4f }
struct LookUp { direction: vec3f, t: f32 }
const object = Object(vec4f(0.0, 0.0, 0.0, 6.0));
"""
    source = assemble("directions.wgsl") + source
    call = "level_of_look_up(LookUp(p, t), half_omega)"
    found = run_wgsl(source, call, {"p": p, "t": t, "half_omega": 0.5 * np.log2(omega)}, declarations=declared)
    d = np.linalg.norm(p, axis=1)
    cos_b = np.abs(p).max(axis=1) / d
    expected = np.maximum(0.5 * np.log2(omega * t**2 / d**2 / cos_b**3 * (n / 2) ** 2), 0)
    assert 0.1 < (expected > 0).mean() < 1
    np.testing.assert_allclose(found, expected, atol=2e-3)


def test_the_probes_irradiance_is_that_of_the_bake() -> None:
    """Nine numbers and a normal: numpy's sum of harmonics, and the share of it that a light map has."""
    count = 500
    n = normalize(RNG.normal(size=(count, 3)))
    numbers = np.array([3.0, 0.4, -0.3, 0.5, 0.2, -0.25, 0.15, 0.3, -0.2])
    e = RNG.uniform(0, 1.5, (count, 3))
    rows = ", ".join(f"vec4f({', '.join(map(str, np.pad(numbers, (0, 3))[i : i + 4]))})" for i in (0, 4, 8))
    declared = f"struct Object {{ irradiance: array<vec4f, 3> }}\nconst object = Object(array<vec4f, 3>({rows}));\n"
    source = assemble("colour.wgsl") + part("surface.wgsl", "fn", "specular_occlusion")
    found = run_wgsl(source, "specular_occlusion(n, e)", {"n": n, "e": e}, declarations=declared)
    np.testing.assert_allclose(found, np.clip(luminance(e) / (basis_of(n) @ numbers), 0, 1), rtol=1e-4)


@pytest.mark.parametrize("even", [0.0, 1.0])
def test_light_in_niches_is_that_of_the_bake(even: float) -> None:
    count = 200
    n = normalize(RNG.normal(size=(count, 3)))
    e = RNG.uniform(0, 3.0, (count, 3))
    declared = f"""struct Object {{ irradiance: array<vec4f, 3> }}
const object = Object(array<vec4f, 3>(vec4f(4.0, 0.0, 0.0, 0.0), vec4f(0.0), vec4f(0.0, {even}, 0.0, 0.0)));
const LAMBENT_PI = 3.14159265;
struct Surface {{ n: vec3f, shares: vec4f, niche: vec3f }}
"""
    source = assemble("colour.wgsl") + "".join(
        part("surface.wgsl", "fn", name) for name in ("specular_occlusion", "in_niche")
    )
    inputs = {"n": n, "e": e}
    call = "in_niche(Surface(n, vec4f(0.0, 0.0, 0.0, 1.0), vec3f(0.0)), e)"
    occlusion = run_wgsl(source, f"{call}.shares.w", inputs, declarations=declared)
    niche = run_wgsl(source, f"{call}.niche", inputs, components=3, declarations=declared)
    share = np.clip(luminance(e) / 4, 0, 1)
    np.testing.assert_allclose(occlusion, share**2 if even else share, rtol=1e-4)
    np.testing.assert_allclose(niche, even * ((1 - share) / np.pi)[:, None] * e, rtol=1e-4, atol=1e-6)


def test_widths_of_a_lobe_about_its_mirror_direction() -> None:
    """2 m in the plane of incidence and 2 m cos_o across it; a brushed lobe has its axes there."""
    theta = np.radians(60)
    wo = np.array([[np.sin(theta), 0, np.cos(theta)], [0, np.sin(theta), np.cos(theta)]])
    source = lobe_shader() + part("lobe_width.wgsl", "fn", "lobe_half_widths")
    for mx, my, expected in (
        (0.1, 0.1, [(0.1, 0.2), (0.1, 0.2)]),
        (0.1, 0.3, [(0.2, 0.3), (0.1, 0.6)]),  # along x: .2 and .6 cos; along y: .6 and .2 cos
    ):
        declared = f"""fn widths(wo: vec3f) -> vec2f {{
    var lobe: LambentLobe;
    lobe.mx = {2 * mx};
    lobe.my = {2 * my};
    lobe.spread = 0.5; // a curve as wide as a Beckmann lobe of half the slopes
    return lobe_half_widths(lobe, wo);
}}"""
        found = run_wgsl(source, "widths(wo)", {"wo": wo}, components=2, declarations=declared)
        np.testing.assert_allclose(found, expected, rtol=1e-4)


@pytest.mark.parametrize("kind", [{}, {"kd_coupled": True}, {"kd_curve": (0.3, 1.4, 1.2, 1.0, 0.9, 1.1, 1.0, 0.8)}])
def test_diffuse_light_of_both_sides(kind: dict[str, Any]) -> None:
    """(kd E of this side, times what is seen of it towards cos_o, + kt_d E of the other)/pi."""
    material = Material(kd=(0.2, 0.4, 0.6), kt_d=(0.3, 0.1, 0.05), **kind)
    rows, _, of_kd = curve_rows(material)
    cos_o = np.linspace(0.1, 1, 50)
    here, beyond = RNG.uniform(0, 3, (2, 50, 3))
    declared = f"""struct Material {{ kd: vec4f, kt_d: vec4f }}
const material = Material(vec4f(0.2, 0.4, 0.6, {float(material.kd_coupled)}), vec4f(0.3, 0.1, 0.05, {of_kd + 1.0}));
struct Painted {{ diffuse: vec3f }}
fn lambent_row(i: u32) -> vec4f {{ return rows[i]; }}
"""
    tables = {"rows": np.concatenate([np.zeros((1, 4)), rows])}
    curved = assemble("lobes.wgsl", "scattering.wgsl").replace("CURVES: bool = false", "CURVES: bool = true")
    source = curved + part("surface.wgsl", "fn", "diffuse_light")
    call = "diffuse_light(c, here, beyond, Painted(vec3f(1.0, 0.5, 2.0)))"
    inputs = {"c": cos_o, "here": here, "beyond": beyond}
    found = run_wgsl(source, call, inputs, components=3, declarations=declared, tables=tables)
    share = diffuse_seen(cos_o, material)[:, None]
    light = np.array([0.2, 0.4, 0.6]) * share * here + np.array([0.3, 0.1, 0.05]) * beyond
    np.testing.assert_allclose(found, light * (1.0, 0.5, 2.0) / np.pi, rtol=1e-4)


def test_a_normal_map_leans_the_same_way_seen_from_behind(device: Any) -> None:
    """The surface itself leans: its normal there is turned round as a whole."""
    lean = normalize(np.array([0.3, -0.2, 1.0]))
    textures = {"m": MaterialTextures(normal=Texture(lean.astype(np.float16)[None, None]))}
    mirror = Material(name="m", lobes=(Lobe(mx=0.001, my=0.001, r0=1.0, alpha=0.5),))
    scene = replace(wall_scene(mirror, cube_of(smooth_light, 128)), textures=textures)
    image = Renderer(device, scene).image(replace(FROM_BEHIND, n=1, show="specular"))
    rays = pixel_rays(BEHIND, 8, 8)
    w = reflect(-rays, np.broadcast_to(-lean, rays.shape))
    np.testing.assert_allclose(image, smooth_light(w), rtol=0.03)


def test_roughness_stays_within_the_bounds_of_a_document(device: Any) -> None:
    """A texture may take neither axis below .001, nor above 4: both shrink, or grow, alike."""
    smooth = Lobe(mx=0.2, my=0.002, r0=1.0, alpha=0.5)
    state = replace(
        FROM_BEHIND, camera=replace(BEHIND, position=(0.3, 0.2, 2.0)), n=9, show="specular", integrator="fis"
    )
    light = cube_of(smooth_light)
    for lobe, factor, reached in (
        (smooth, 0.1, {"mx": 0.1, "my": 0.001}),
        (Lobe(mx=0.1, my=1.0, r0=1.0, alpha=0.5), 30.0, {"mx": 0.4, "my": 4.0}),
    ):
        textures = MaterialTextures(roughness=Texture(np.full((1, 1, 1), factor, np.float16)))
        textured = replace(wall_scene(Material(name="m", lobes=(lobe,)), light), textures={"m": textures})
        plain = wall_scene(Material(name="m", lobes=(lobe.model_copy(update=reached),)), light)
        got, expected = (Renderer(device, scene).image(state) for scene in (textured, plain))
        np.testing.assert_allclose(got, expected, rtol=5e-3)


def test_light_of_the_far_side_is_not_bent(device: Any) -> None:
    """The dominant direction is that of the front's light: behind, a normal map leaves the irradiance alone."""
    lean = normalize(np.array([0.6, 0.0, 1.0]))
    textures = {"m": MaterialTextures(normal=Texture(lean.astype(np.float16)[None, None]))}
    scene = wall_scene(Material(name="m", kd=0.5), cube_of(smooth_light), irradiance=(1.0, 1.0, 1.0))
    towards = np.broadcast_to(normalize(np.array([0.8, 0.0, 0.6])).astype(np.float32), (4, 4, 3))
    back = np.full((4, 4, 3), 2.0, np.float32)
    scene = replace(scene, textures=textures, irradiance_back=back, dominant_direction=towards)
    renderer = Renderer(device, scene)
    np.testing.assert_allclose(renderer.image(replace(FROM_BEHIND, show="diffuse")), 2 * 0.5 / np.pi, rtol=2e-3)
    front = replace(BEHIND, position=(0.3, 0.2, 2.0))
    shown = renderer.image(replace(FROM_BEHIND, camera=front, show="diffuse"))
    assert shown.mean() > 1.2 * 0.5 / np.pi, "in front it leans to the light"


def test_roughness_from_afar_is_the_mean_of_squares(device: Any) -> None:
    """Slopes' variances add: texels of .2 and 1.4 times m reflect as m, whose squares are their mean."""
    checks = np.array([[0.2, 1.4], [1.4, 0.2]], np.float16)[..., None]
    fine = Texture(checks, ((64.0, 0.0, 0.0), (0.0, 64.0, 0.0)))
    lamp = cube_of(lambda w: np.repeat(0.05 + np.exp(20 * (w[..., 2:] - 1)), 3, axis=-1), 128)
    camera = replace(BEHIND, position=(0.0, 0.0, 8.0), target=(0.0, 0.0, 0.0), fov_y_deg=20.0)
    state = replace(FROM_BEHIND, camera=camera, n=40, show="specular", integrator="fis")
    material = Material(name="m", lobes=(Lobe(mx=0.2, my=0.2, r0=1.0),))
    plain = wall_scene(material, lamp)
    textured = replace(plain, textures={"m": MaterialTextures(roughness=fine)})
    got, expected = (Renderer(device, scene).image(state) for scene in (textured, plain))
    assert got.mean() == pytest.approx(expected.mean(), rel=0.03)


def test_light_maps_of_shapes_are_linear_over_triangles() -> None:
    """The bilinear look-up at a triangle's middle is the mean of its corners' irradiance."""
    normals = normalize(np.array([0, 0, 1]) + 0.4 * RNG.normal(size=(4, 3))).astype(np.float32)
    mesh = replace(patch((0, 0, 0), (1, 0, 0), (0, 1, 0)), normals=normals)
    scene = unbaked_scene({"a": mesh}, Material(name="m", kd=0.5), cube_of(smooth_light))
    scene = with_diffuse_light(scene)
    assert scene.irradiance is not None and scene.environment is not None
    side = scene.irradiance.shape[0]
    for face in scene.faces:
        x, y = scene.uv2[face].mean(axis=0) * side - 0.5
        c, r = int(np.floor(x)), int(np.floor(y))
        fx, fy = x - c, y - r
        near = scene.irradiance[r : r + 2, c : c + 2].astype(float)
        looked_up = np.einsum("r,c,rcx->x", [1 - fy, fy], [1 - fx, fx], near)
        at = irradiance(scene.environment, normalize(scene.normals[face].astype(float)))
        np.testing.assert_allclose(looked_up, at.mean(axis=0), rtol=1e-4)


def test_texels_count_as_large_as_they_are_blurred() -> None:
    """Of a smooth cube one look-up covers five texels' area: half the log2 of 64^2, less that of 5."""
    light = ProbeLight(None, Probe((0.0, 0.0, 0.0), np.ones((6, 128, 128, 3), np.float32)), None, {})
    assert light.half_log2_texels("box") == 6
    assert light.half_log2_texels("smooth") == pytest.approx(6 - np.log2(5) / 2)
