"""Textures on surfaces: MIP chains that keep what they should, the right way round, and as the path tracer has them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.geometry.directions import normalize
from lambent.core.light.colour import srgb_decode
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.materials import textures as on_gpu
from lambent.realtime.objects.draws import draws_of
from lambent.realtime.objects.unbaked import unbaked_scene
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import patch
from lambent.scenes.looks.textures import halved, slopes
from lambent.scenes.scene import MaterialTextures, Scene, SceneObject, Texture
from tests.realtime.lit_wall import cube_of, smooth_light, wall_scene

LETTER = np.array([[1, 1, 1, 1], [1, 0, 0, 0], [1, 1, 1, 0], [1, 0, 0, 0], [1, 0, 0, 0]], np.float16)  # an F
FRONT = Camera(
    name="c", position=(0.0, 0.0, 2.0), target=(0.0, 0.0, 0.0), fov_y_deg=float(np.degrees(2 * np.arctan(0.25)))
)
SQUARE = patch((-0.5, -0.5, 0), (1, 0, 0), (0, 1, 0))
DARK = np.zeros((6, 2, 2, 3), np.float32)


def texture(values: np.ndarray) -> Texture:
    return Texture(np.asarray(values, np.float16))


def constant(*values: float) -> Texture:
    return texture(np.array(values)[None, None])


def square(material: Material, textures: MaterialTextures, environment=DARK, light=(np.pi,) * 3):
    """A square of 1 m that faces +z and fills FRONT's image; uv runs with x and y."""
    scene = unbaked_scene({"o": SQUARE}, material, environment, irradiance=light)
    return replace(scene, textures={material.name: textures})


def test_halving_keeps_the_mean_of_odd_sizes() -> None:
    texels = np.random.default_rng(0).random((7, 5, 2)).astype(np.float32)
    for _ in range(3):
        smaller = halved(texels)
        assert smaller.shape[:2] == tuple(max(1, n // 2) for n in texels.shape[:2])
        np.testing.assert_allclose(smaller.mean(axis=(0, 1)), texels.mean(axis=(0, 1)), rtol=1e-5)
        texels = smaller


def test_bytes_decode_to_the_texels() -> None:
    texels = (np.random.default_rng(0).random((16, 16, 3)) * (0.5, 1.0, 7.0)).astype(np.float16)
    levels, scale = on_gpu.encoded(texels)
    decoded = srgb_decode(levels[0][..., :3] / np.float32(255)) * scale
    np.testing.assert_allclose(decoded, texels, atol=0.005 * max(scale), rtol=0.02)
    assert [level.shape[0] for level in levels] == [16, 8, 4, 2, 1]


def test_bumps_become_roughness_where_they_are_averaged() -> None:
    """Ridges of slope +-.2 along t: flat from afar, with twice their variance added to mx^2, and nothing to my^2."""
    normals = np.zeros((8, 8, 3), np.float16)
    normals[..., 2], normals[:, ::2, 0], normals[:, 1::2, 0] = 1, 0.2, -0.2
    levels = on_gpu.normal_levels(normals)
    assert not levels[0][..., 2:].any()
    np.testing.assert_allclose(levels[1], np.broadcast_to([0, 0, 2 * 0.04, 0], (4, 4, 4)), atol=1e-4)
    np.testing.assert_allclose(slopes(np.array([0.0, 3.0, -1.0])), (0, 8), rtol=1e-5)


def test_leaves_keep_their_area_on_all_levels() -> None:
    """Plain means would lift noise above the cutoff everywhere or nowhere."""
    opacity = np.random.default_rng(0).random((64, 64, 1)).astype(np.float32)
    for cutoff in (0.1, 0.5, 0.95):
        share = (opacity >= cutoff).mean()
        for level in on_gpu.opacity_levels(opacity, cutoff)[1:4]:
            assert np.count_nonzero(level >= cutoff) == round(share * level.size)
    assert all((level == 1).all() for level in on_gpu.opacity_levels(np.ones((4, 4, 1)), 0.5))


@pytest.mark.parametrize("part", ["diffuse", "opacity"])
def test_textures_are_drawn_unmirrored_and_upright(device, part: str) -> None:
    texels = LETTER.repeat(8, 0).repeat(8, 1)[..., None]
    texels = texels.repeat(3, axis=2) if part == "diffuse" else texels
    scene = square(Material(name="m", kd=1.0), MaterialTextures(**{part: texture(texels)}))
    image = Renderer(device, scene).image(FrameState(FRONT, 80, 80))
    np.testing.assert_allclose(image[8::16, 10::20, 0], LETTER, atol=0.02)


def test_a_uv_transform_repeats_and_shifts(device) -> None:
    texels = np.zeros((16, 16, 3))
    texels[8:, :8] = 1  # lower left
    lies = replace(texture(texels), uv_transform=((2.0, 0.0, 0.0), (0.0, 1.0, 0.5)))
    image = Renderer(device, square(Material(name="m", kd=1.0), MaterialTextures(diffuse=lies))).image(
        FrameState(FRONT, 64, 64)
    )
    np.testing.assert_allclose(image[16::32, 8::16, 0], [[1, 0, 1, 0], [0, 0, 0, 0]], atol=0.02)


def test_what_is_behind_a_hole_is_seen(device) -> None:
    scene = square(Material(name="m", kd=1.0), MaterialTextures(opacity=constant(0.4)), np.full((6, 2, 2, 3), 0.25))
    renderer = Renderer(device, scene)
    np.testing.assert_allclose(renderer.image(FrameState(FRONT, 8, 8)), 0.25, rtol=1e-3)
    solid = replace(scene, textures={"m": replace(scene.textures["m"], cutoff=0.3)})
    np.testing.assert_allclose(Renderer(device, solid).image(FrameState(FRONT, 8, 8)), 1.0, rtol=1e-3)


def shown(renderer: Renderer, size: int, **how) -> np.ndarray:
    """Light of an image as it is shown in motion, without a view transform: (size, size)."""
    frame = FrameState(FRONT, size, size, view_transform="linear", **how)
    return srgb_decode(renderer.display_image(frame)[..., 0].astype(np.float32) / 255)


def test_edges_of_a_mask_are_as_wide_as_a_pixel_in_motion(device) -> None:
    """Texels of 8 pixels, the mask's edge a quarter into a pixel: the mean of light and dark by what is covered."""
    opaque = (np.arange(8) < 4).astype(np.float16) * np.ones((8, 1))
    scene = square(Material(name="m", kd=0.8), MaterialTextures(opacity=texture(opaque[..., None])))
    moved = replace(scene, positions=scene.positions + np.float32([0.25 / 64, 0, 0]))
    middle = shown(Renderer(device, moved), 64)[32, 8:56]
    expected = 0.8 * (np.arange(48) < 24)
    expected[24] = 0.2
    np.testing.assert_allclose(middle, expected, atol=0.05)


def test_no_pixel_of_a_masked_surface_is_lost_in_motion(device) -> None:
    """What is covered in part and what is covered whole make up what the test alone finds."""
    opaque = np.random.default_rng(5).random((8, 8, 1)).astype(np.float16)
    masked = Renderer(device, square(Material(name="m", kd=0.8), MaterialTextures(opacity=texture(opaque))))
    finely_tested = shown(masked, 512, antialias=False).mean()
    assert shown(masked, 128).mean() == pytest.approx(finely_tested, rel=0.02)
    covered = Renderer(device, square(Material(name="m", kd=0.8), MaterialTextures(opacity=constant(1.0))))
    np.testing.assert_array_equal(shown(covered, 64), shown(covered, 64, antialias=False))


@pytest.mark.parametrize("integrator", ["rings", "qmc", "split-sum"])
def test_a_roughness_texture_equals_a_material_of_that_roughness(device, integrator: str) -> None:
    """Half of everything: the samples move, the filter narrows, as a material of half the numbers has it."""
    lobe = Lobe(mx=0.2, my=0.12, r0=0.6, k=0.8, alpha=0.2)
    if integrator == "split-sum":
        lobe = lobe.model_copy(update={"alpha": 0.0})
    half = lobe.model_copy(update={"mx": 0.1, "my": 0.06, "k": (0.4, 0.8, 1.6)})
    light = cube_of(smooth_light)
    textures = MaterialTextures(roughness=constant(0.5), specular=constant(0.5, 1.0, 2.0))
    state = FrameState(FRONT, 24, 24, integrator=integrator, n=9, accumulate=0, antialias=False)
    textured = square(Material(name="m", lobes=(lobe,)), textures, light)
    plain = square(Material(name="m", lobes=(half,)), MaterialTextures(), light)
    got, expected = (Renderer(device, scene).image(state) for scene in (textured, plain))
    # rings: normalised for the roughness that the material has without its texture
    loose = {"rings": 0.01, "split-sum": 0.03}
    np.testing.assert_allclose(got, expected, rtol=loose.get(integrator, 4e-3))


def test_bumps_from_afar_look_as_rough_as_they_are(device) -> None:
    """One-texel ridges, of which a pixel sees hundreds, reflect as wide along t as a lobe of both variances."""
    normals = np.zeros((64, 64, 3))
    normals[..., 2], normals[:, ::2, 0], normals[:, 1::2, 0] = 1, 0.1, -0.1
    textures = MaterialTextures(normal=replace(texture(normals), uv_transform=((64.0, 0, 0), (0, 64.0, 0))))
    lobe = Lobe(mx=0.1, my=0.1, r0=1.0)
    wide = lobe.model_copy(update={"mx": float(np.sqrt(0.01 + 2 * 0.01))})
    light = cube_of(smooth_light)
    state = FrameState(FRONT, 16, 16, n=64, integrator="qmc")
    got = Renderer(device, square(Material(name="m", lobes=(lobe,)), textures, light)).converged(state, 256)
    expected = Renderer(device, square(Material(name="m", lobes=(wide,)), MaterialTextures(), light)).converged(
        state, 256
    )
    np.testing.assert_allclose(got, expected, rtol=0.02)


@pytest.mark.long
def test_drawn_images_equal_path_traced_ones(device, mi, tmp_path) -> None:
    """All of a gloss at once - colour, roughness, bumps, brushing, a hole - under light from afar."""
    from lambent.baking.reference.path_traced import render_reference
    from lambent.baking.sky.cube import environment_cube
    from lambent.core.pictures.images import write_image
    from lambent.scenes.scene import ImageEnvironment

    theta, phi = np.meshgrid((np.arange(32) + 0.5) * np.pi / 32, (np.arange(64) + 0.5) * np.pi / 32, indexing="ij")
    w = np.stack([np.sin(theta) * np.sin(phi - np.pi), np.cos(theta), -np.sin(theta) * np.cos(phi - np.pi)], axis=-1)
    path = tmp_path / "light.exr"
    write_image(path, smooth_light(w).astype(np.float32))
    environment = ImageEnvironment(path)
    v, u = np.meshgrid((np.arange(32) + 0.5) / 32, (np.arange(32) + 0.5) / 32, indexing="ij")
    turn = np.arctan2(0.5 - v, u - 0.5)
    textures = MaterialTextures(
        specular=texture(np.stack([0.2 + u, 1.2 - u, 0.5 + v], axis=-1)),
        roughness=texture((0.4 + 1.6 * u)[..., None]),
        normal=texture(np.stack([0.3 * np.sin(12 * u), 0.3 * np.cos(9 * v), np.ones_like(u)], axis=-1)),
        direction=texture(np.stack([np.cos(turn), np.sin(turn)], axis=-1)),
        opacity=texture((np.hypot(u - 0.7, v - 0.3) > 0.2)[..., None]),
    )
    material = Material(name="m", lobes=(Lobe(mx=0.25, my=0.06, k=0.8, r0=0.6, alpha=0.3),))
    camera = Camera("c", (0.6, 0.3, 1.6), (0.0, 0.0, 0.0), fov_y_deg=34)
    scene = Scene("s", (SceneObject("o", SQUARE, "m"),), {"m": material}, environment, textures={"m": textures})
    traced, variance = render_reference(scene, camera, 48, 48, 256)
    cube = environment_cube(environment, 128)
    baked = replace(unbaked_scene({"o": SQUARE}, material, cube), textures={"m": textures})
    drawn = Renderer(device, baked).converged(FrameState(camera, 48, 48, lookup="plain"), 256)
    z = (drawn - traced) / np.sqrt(variance + (0.02 * traced) ** 2)
    assert np.sqrt(np.median(z**2)) < 1
    assert (np.abs(z) > 4).mean() < 0.03  # the hole's edge
    np.testing.assert_allclose(drawn.mean(axis=(0, 1)), traced.mean(axis=(0, 1)), rtol=0.01)


def test_materials_without_textures_pay_nothing(device) -> None:
    """No texture is read by the pipeline of a material that has none."""
    renderer = Renderer(device, wall_scene(Material(name="m", kd=0.5), cube_of(smooth_light)))
    assert [draw.textures for draw in draws_of(FrameState(FRONT, 8, 8), renderer.resources)] == [0]
    gloss = Material(name="m", kd=0.5, lobes=(Lobe(mx=0.1, my=0.1),))
    everything = {part: constant(*[0.5] * channels) for part, channels in on_gpu.CHANNELS.items()}
    renderer = Renderer(device, square(gloss, MaterialTextures(**everything)))
    assert [draw.textures for draw in draws_of(FrameState(FRONT, 8, 8), renderer.resources)] == [1 | 2 | 4 | 8]


BUMPS = ((0.0, 0.0), (0.5, 0.0), (-0.5, 0.0), (0.2, -0.4))  # slopes of the normal along x and y


def shares(device, lean, slope) -> float:
    """Diffuse light of a wall that faces +z, over that without the normal map."""
    scene = square(Material(name="m", kd=0.5), MaterialTextures(normal=constant(*slope, 1.0)), light=(1.0, 2.0, 3.0))
    scene = replace(scene, dominant_direction=None if lean is None else np.array(lean, np.float32)[None, None])
    image = Renderer(device, scene).image(FrameState(FRONT, 8, 8))
    share = image / (0.5 / np.pi * np.array([1.0, 2.0, 3.0]))
    assert np.ptp(share) < 2e-3 * share.mean()
    return float(share.mean())


@pytest.mark.parametrize("slope", BUMPS)
def test_a_normal_map_bends_diffuse_light_as_it_leans(device, slope) -> None:
    """Exact for one lamp, for a uniform hemisphere (half of 1 + n.n'), and for a mixture of both."""
    bent = np.array([*slope, 1.0]) / np.linalg.norm([*slope, 1.0])
    lamp = np.array([0.6, 0.0, 0.8])
    of_lamp, of_sky = max(lamp @ bent, 0) / lamp[2], (1 + bent[2]) / 2
    assert shares(device, lamp, slope) == pytest.approx(of_lamp, rel=3e-3)
    assert shares(device, (0, 0, 2 / 3), slope) == pytest.approx(of_sky, rel=3e-3)
    mixed = 0.3 * lamp + 0.7 * np.array([0, 0, 2 / 3])
    assert shares(device, mixed, slope) == pytest.approx(0.3 * of_lamp + 0.7 * of_sky, rel=3e-3)
    assert shares(device, None, slope) == pytest.approx(1, rel=2e-3)  # where it is not known, light is not bent


def test_footprints_are_filtered_alike_by_all_adapters(device) -> None:
    """A square seen almost from its edge, over a corner: pixels cover slanted ellipses of up to eight texels by one."""
    size, texels = 64, np.random.default_rng(1).random((128, 128, 3)).astype(np.float16)
    scene = square(Material(name="m", kd=1.0), MaterialTextures(diffuse=texture(texels)))
    camera = Camera("corner", (-0.65, -0.65, 0.16), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 20.0)
    image = Renderer(device, scene).image(FrameState(camera, size, size))
    encoded, scale = on_gpu.encoded(texels)
    levels = [srgb_decode(level[..., :3] / np.float32(255)) * scale for level in encoded]
    shown = slice(20, 48)
    error = np.abs(image - _filtered(levels, _places(camera, size)))[shown, shown]
    assert image[shown, shown].std() > 0.05 and error.mean() < 0.002


def _places(camera: Camera, size: int) -> np.ndarray:
    """Texel coordinates (size, size, 2), in shares of the texture, that pixels of a square frame see of the square."""
    eye = np.array(camera.position)
    forward = normalize(np.array(camera.target) - eye)
    right = normalize(np.cross(forward, camera.up))
    at = ((np.arange(size) + 0.5) / size * 2 - 1) * np.tan(np.radians(camera.fov_y_deg) / 2)
    rays = forward + at[None, :, None] * right - at[:, None, None] * np.cross(right, forward)
    hits = eye + rays * (-eye[2] / rays[..., 2:])
    return np.stack([hits[..., 0] + 0.5, 0.5 - hits[..., 1]], axis=-1)


def _filtered(levels: list[np.ndarray], at: np.ndarray) -> np.ndarray:
    """`filtered` of material.wgsl; steps from pixel to pixel are those within blocks of 2 x 2."""
    side = len(levels[0])
    x = np.repeat(at[:, 1::2] - at[:, ::2], 2, axis=1) * side
    y = np.repeat(at[1::2] - at[::2], 2, axis=0) * side
    axes, lengths, _ = np.linalg.svd(np.stack([x, y], axis=-1))
    major, minor = np.moveaxis(lengths, -1, 0)
    minor = np.maximum(np.maximum(minor, major / 8), 1)
    taps, found = np.maximum(np.round(major / minor), 1), np.zeros((*at.shape[:2], 3))
    for k in range(8):
        place = at + (((k + 0.5) / taps - 0.5) * major / side)[..., None] * axes[..., 0]
        found += np.where((k < taps)[..., None], _trilinear(levels, place, np.log2(minor)), 0) / taps[..., None]
    return found


def _trilinear(levels: list[np.ndarray], at: np.ndarray, level: np.ndarray) -> np.ndarray:
    found = np.zeros((*at.shape[:2], 3))
    for number, texels in enumerate(levels):
        share = np.clip(1 - np.abs(level - number), 0, 1)
        texel = at * len(texels) - 0.5
        low = np.floor(texel).astype(int)
        for step in np.ndindex(2, 2):
            weight = np.prod(1 - np.abs(texel - low - step), axis=-1)
            column, row = np.moveaxis((low + np.array(step)) % len(texels), -1, 0)
            found += (share * weight)[..., None] * texels[row, column]
    return found
