"""Textures in the path tracer: the right way round, the right numbers, and light through holes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from lambent.core.views.camera import Camera
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import patch
from lambent.scenes.scene import DirectionalLight, MaterialTextures, PointLight, Scene, SceneObject, Texture
from tests.baking.small_scenes import TINY

LETTER = np.array(
    [[1, 1, 1, 1], [1, 0, 0, 0], [1, 1, 1, 0], [1, 0, 0, 0], [1, 0, 0, 0]], np.float16
)  # an F, row 0 at the top
ABOVE = Camera("above", (0.0, 0.0, 2.0), (0.0, 0.0, 0.0), fov_y_deg=float(np.degrees(2 * np.arctan(0.25))))
pytestmark = pytest.mark.usefixtures("mi")
GLOSS = Lobe(mx=0.3, my=0.1, k=(0.5, 0.6, 0.7), r0=(0.5, 0.6, 0.7), alpha=0.4)


def wall(material: Material, textures: MaterialTextures, **more) -> Scene:
    """A square of 1 m that faces +z; uv runs with x and y."""
    mesh = patch((-0.5, -0.5, 0), (1, 0, 0), (0, 1, 0))
    return Scene("wall", (SceneObject("wall", mesh, "m"),), {"m": material}, textures={"m": textures}, **more)


def constant(*values: float) -> Texture:
    return Texture(np.array(values, np.float16)[None, None])


def test_pictures_are_seen_unmirrored_and_upright() -> None:
    from lambent.baking.reference.path_traced import render_reference

    picture = Texture(np.repeat(LETTER[..., None], 3, axis=2))
    sun = DirectionalLight((0.0, 0.0, -1.0), (2 * np.pi,) * 3)
    image, _ = render_reference(
        wall(Material(kd=0.5), MaterialTextures(diffuse=picture), lights=(sun,)), ABOVE, 80, 80, 4
    )
    centres = (np.arange(5) * 16 + 8)[:, None], (np.arange(4) * 20 + 10)[None]
    np.testing.assert_allclose(image[centres][..., 0], LETTER, atol=0.08)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_numbers_and_frame_equal_a_material_that_has_them(side: float) -> None:
    """A textured material scatters like one of the multiplied numbers, in a frame leant and turned."""
    import drjit as dr
    import mitsuba as mi

    from lambent.baking.bsdfs.material_plugin import material_dict, register_material_plugin

    register_material_plugin()
    material = Material(kd=(0.2, 0.3, 0.4), kt_d=0.1, lobes=(GLOSS,))
    lean, turn = np.array([0.3, -0.2, 1.0]), np.radians(130)
    textures = MaterialTextures(
        constant(0.5, 1.0, 2.0),
        constant(2.0, 1.0, 0.5),
        constant(0.5),
        constant(*lean),
        constant(np.cos(turn), np.sin(turn)),
    )
    plugin = mi.load_dict(material_dict(material, textures))
    same = Material(
        kd=(0.1, 0.3, 0.8), kt_d=(0.05, 0.1, 0.2),
        lobes=(GLOSS.model_copy(update={"mx": 0.15, "my": 0.05, "k": (1.0, 0.6, 0.35)}),),
    )  # fmt: skip
    n = lean.astype(np.float16) / np.linalg.norm(lean)
    t = np.array([np.cos(turn), np.sin(turn), 0])
    t = t - n * (n @ t)
    t /= np.linalg.norm(t)
    axes = np.stack([t, np.cross(n, t), n])
    rng = np.random.default_rng(1)
    wo = rng.normal(size=(256, 3))
    wo[:, 2] = side * np.abs(wo[:, 2])
    wo /= np.linalg.norm(wo, axis=1, keepdims=True)
    wo = wo[side * (wo @ n) > 0.12]  # a normal that turns from the viewer is bent back
    wi = -wo * [1, 1, -1] + rng.normal(scale=0.2, size=wo.shape)
    wi /= np.linalg.norm(wi, axis=1, keepdims=True)
    si = dr.zeros(mi.SurfaceInteraction3f, len(wo))
    si.sh_frame, si.wi = mi.Frame3f(mi.Normal3f(0, 0, 1)), mi.Vector3f(wo.T)
    got = np.array(plugin.eval(mi.BSDFContext(), si, mi.Vector3f(wi.T))).T
    expected = MaterialBSDF(same).eval(wi @ axes.T, wo @ axes.T) * np.abs(wi @ n)[:, None]
    possible = wi[:, 2] * (wi @ n) > 0
    np.testing.assert_allclose(got[possible], expected[possible], rtol=5e-3, atol=1e-5)
    assert not got[~possible].any()


@pytest.mark.parametrize("part", ["kd", "gloss"])
def test_bumpy_samples_follow_their_density(part: str) -> None:
    """With a normal map, sampling and evaluation agree: importance sampled albedo equals uniformly sampled albedo."""
    import drjit as dr
    import mitsuba as mi

    from lambent.baking.bsdfs.material_plugin import material_dict, register_material_plugin

    register_material_plugin()
    material = Material(kd=0.5) if part == "kd" else Material(lobes=(GLOSS,))
    plugin = mi.load_dict(material_dict(material, MaterialTextures(normal=constant(0.5, 0.3, 1.0))))
    n = 1 << 18
    for theta in (0.2, 1.2, 1.5):
        si = dr.zeros(mi.SurfaceInteraction3f, n)
        si.sh_frame, si.wi = mi.Frame3f(mi.Normal3f(0, 0, 1)), mi.Vector3f(-math.sin(theta), 0, math.cos(theta))
        u = np.random.default_rng(0).random((5, n)).astype(np.float32)
        _, weight = plugin.sample(mi.BSDFContext(), si, mi.Float(u[0]), mi.Point2f(u[1], u[2]))
        uniform = mi.warp.square_to_uniform_hemisphere(mi.Point2f(u[3], u[4]))
        value = plugin.eval(mi.BSDFContext(), si, uniform)
        np.testing.assert_allclose(np.array(weight)[1].mean(), np.array(value)[1].mean() * 2 * np.pi, rtol=0.03)


SCREEN = np.zeros((8, 8, 1), np.float16)
SCREEN[::2, ::2] = SCREEN[1::2, 1::2] = 1


def screened(light) -> Scene:
    """A floor of 1 m below a screen whose checks, an eighth of a metre, let every second beam through."""
    floor = SceneObject("floor", patch((-0.5, 0, 0.5), (1, 0, 0), (0, 0, -1)), "floor")
    screen = SceneObject("screen", patch((-0.5, 0.5, 0.5), (1, 0, 0), (0, 0, -1)), "screen")
    texels = np.repeat(np.repeat(SCREEN, 16, axis=0), 16, axis=1)
    holes = {"screen": MaterialTextures(opacity=Texture(texels))}
    black = {"floor": Material(), "screen": Material()}
    return Scene("screened", (floor, screen), black, lights=(light,), textures=holes)


def test_a_screen_casts_the_shadow_of_its_checks(tmp_path) -> None:
    """Sun from straight above: the floor's irradiance is the sun's, or nothing, check by check."""
    import mitsuba as mi

    from lambent.baking.tracing import path_tracer
    from lambent.baking.tracing.scene_builder import SceneBuilder

    scene = SceneBuilder(screened(DirectionalLight((0.0, -1.0, 0.0), (3.0, 3.0, 3.0)))).build()
    centre = (np.arange(8) + 0.5) / 8 - 0.5
    x, z = (a.ravel() for a in np.meshgrid(centre, centre))  # rows follow z, which is down the picture
    up = mi.Vector3f(0, 1, 0)
    points = path_tracer.Points(mi.Vector3f(x, np.zeros(64), z), up, up)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, 64)
    e = path_tracer.irradiance(scene, sampler, points, sampler.next_2d(), sampler.next_2d(), 4)
    np.testing.assert_allclose(np.array(e.x).reshape(8, 8), 3 * (1 - SCREEN[..., 0]), rtol=1e-5)


def test_cached_light_is_tinted_by_the_diffuse_texture() -> None:
    """kd/pi of the front's irradiance, pi, and kt_d/pi of the back's, 2 pi, times the texture."""
    import mitsuba as mi

    from lambent.baking.light.cache import LightMapCache
    from lambent.baking.tracing.scene_builder import SceneBuilder

    scene = wall(Material(kd=0.4, kt_d=0.2), MaterialTextures(diffuse=constant(0.5, 1.0, 0.25)))
    builder = SceneBuilder(scene, {"wall": np.full((4, 2), 0.5)}, diffuse=False)
    front, back = (np.full((2, 2, 3), irradiance) for irradiance in (np.pi, 2 * np.pi))
    si = builder.build().ray_intersect(mi.Ray3f(mi.Point3f(0.1, 0.1, 1), mi.Vector3f(0, 0, -1)))
    shown = np.array(LightMapCache(builder, front, back)(si, mi.Bool(True))).ravel()
    np.testing.assert_allclose(shown, [0.4, 0.8, 0.2], rtol=1e-4)


@pytest.mark.long
def test_diffuse_light_on_bumps_is_that_of_path_tracing(adapter, tmp_path) -> None:
    """A wall whose halves' normals lean to the left and to the right, between a lamp and a lit wall."""
    from lambent.baking.bake import bake
    from lambent.baking.reference.path_traced import render_reference
    from lambent.realtime.frame_state import FrameState
    from lambent.realtime.gpu.device import open_device
    from lambent.realtime.renderer import Renderer

    bumps = np.zeros((2, 2, 3), np.float16)
    bumps[..., 2], bumps[:, 0, 0], bumps[:, 1, 0] = 1, -0.5, 0.5
    scene = wall(
        Material(kd=0.5), MaterialTextures(normal=Texture(bumps)), lights=(PointLight((-1.0, 0.0, 1.0), (3.0,) * 3),)
    )
    shade = SceneObject("shade", patch((0.52, -0.5, 0), (0, 0, 0.5), (0, 1, 0)), "grey")
    grey = scene.materials | {"grey": Material(kd=0.8)}
    scene = replace(scene, objects=(*scene.objects, shade), materials=grey)
    store = bake(scene, tmp_path / "s", quality=TINY.changed(light_map={"gather_samples": 64}), only={"lamps"})
    drawn = Renderer(open_device(), store).image(FrameState(ABOVE, 32, 32))
    traced, _ = render_reference(scene, ABOVE, 32, 32, 256)
    halves = (slice(4, 28), slice(3, 13)), (slice(4, 28), slice(19, 29))
    got, expected = (np.array([image[half].mean() for half in halves]) for image in (drawn, traced))
    unbent = replace(scene, textures={})
    flat = np.array([render_reference(unbent, ABOVE, 32, 32, 256)[0][half].mean() for half in halves])
    assert (np.abs(flat / expected - 1) > 0.1).all()
    np.testing.assert_allclose(got, expected, rtol=0.06)  # the lit wall is neither a lamp nor a sky
