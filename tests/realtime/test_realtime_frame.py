"""Frames: the right way round, the right side, the right colour."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.bench.scenes.specular_scene import sphere_and_torus
from lambent.core.errors import UserError
from lambent.core.light.colour import filmic, srgb_decode, srgb_encode
from lambent.core.views.camera import Camera, clip_from_world, pixel_rays
from lambent.materials.bsdf import under_fresnel
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.targets import pixels
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.objects.unbaked import CAMERA
from lambent.realtime.objects.unbaked import unbaked_scene as baked_scene
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import patch, sphere
from lambent.scenes.sky.environments import studio
from tests.realtime.lit_wall import cube_of, smooth_light, wall_scene

FORWARD = Camera(name="forward", position=(0.0, 0.0, 2.0), target=(0.0, 0.0, 0.0), fov_y_deg=60.0)
PAPER = Material(name="m", kd=0.5)


def with_light_map(scene: BakedScene, front: np.ndarray, back: np.ndarray | None = None) -> BakedScene:
    """The scene with light maps; uv2 runs with x and y over the unit square about the origin."""
    uv2 = scene.positions[:, :2] + 0.5
    return replace(scene, irradiance=front, irradiance_back=back, uv2=np.asarray(uv2, np.float32))


def square(material: Material = PAPER) -> BakedScene:
    mesh = patch((-0.5, -0.5, 0), (1, 0, 0), (0, 1, 0))
    return baked_scene({"square": mesh}, material, np.zeros((6, 2, 2, 3)))


def test_field_of_view_is_vertical_and_whole(device) -> None:
    """A square of half size tan(fov/2) times the distance fills the height, and half of an image twice as wide."""
    half = 2 * np.tan(np.radians(30))
    mesh = patch((-half, -half, 0), (2 * half, 0, 0), (0, 2 * half, 0))
    scene = baked_scene({"m": mesh}, PAPER, np.zeros((6, 2, 2, 3)), irradiance=(1, 1, 1))
    lit = Renderer(device, scene).image(FrameState(FORWARD, 64, 32))[..., 0] > 0
    np.testing.assert_array_equal(np.flatnonzero(lit.any(axis=0)), np.arange(16, 48))
    assert lit.any(axis=1).all()


def test_sky_shows_the_cube_map_unmirrored(device) -> None:
    """Also the test that the GPU reads faces as core.cubemap writes them: cameras look along all axes."""
    scene = replace(square(), environment=cube_of(smooth_light))
    renderer = Renderer(device, scene)
    for target in np.concatenate([np.eye(3), -np.eye(3)]):
        position = np.array([5.0, 5.0, 5.0])
        camera = Camera(name="c", position=tuple(position), target=tuple(position + target), fov_y_deg=70)
        image = renderer.image(FrameState(camera, 24, 18))
        np.testing.assert_allclose(image, smooth_light(pixel_rays(camera, 24, 18)), rtol=0.02)


@pytest.mark.long
def test_reflections_meet_at_the_edges_of_cube_faces(device) -> None:
    """Rough reflections of smooth light are smooth: no seam where MIP levels of neighbouring faces meet."""
    gloss = Material(name="m", lobes=(Lobe(mx=0.25, my=0.25, r0=1.0),))
    scene = baked_scene({"sphere": sphere(0.62)}, gloss, cube_of(smooth_light, 32))
    state = FrameState(CAMERA, 160, 120, n=40, antialias=False, show="specular")
    renderer = Renderer(device, scene)
    error = renderer.image(state) - renderer.converged(replace(state, n=16), 1024)
    height, width = np.indices(error.shape[:2])
    inside = np.hypot(height - 59.5, width - 79.5) < 24
    for axis in (0, 1):
        steps = np.abs(np.diff(error, axis=axis, append=0))[inside]
        assert steps.max() < 0.02, steps.max()


def test_light_map_rows_follow_the_contract(device) -> None:
    """Texel (row, column) has its centre at uv2 = ((column + 1/2)/W, (row + 1/2)/H): v up means row up."""
    light = np.zeros((4, 4, 3), np.float32)
    light[3, 3] = np.pi * 2
    image = Renderer(device, with_light_map(square(), light)).image(FrameState(FORWARD, 64, 64))[..., 0]
    row, column = np.unravel_index(image.argmax(), image.shape)
    assert image.max() == pytest.approx(1, rel=0.01)
    assert row < 32 < column


def test_a_sheet_shows_on_each_side_what_falls_on_and_through_it(device) -> None:
    sheet = Material(name="m", kd=(0.5, 0, 0), kt_d=(0, 0.25, 0))
    front, back = np.full((1, 1, 3), np.pi, np.float32), np.full((1, 1, 3), 3 * np.pi, np.float32)
    renderer = Renderer(device, with_light_map(square(sheet), front, back))
    behind = Camera(name="behind", position=(0, 0, -2), target=(0, 0, 0))
    for camera, expected in ((FORWARD, (0.5, 0.75, 0)), (behind, (1.5, 0.25, 0))):
        np.testing.assert_allclose(renderer.image(FrameState(camera, 9, 9))[4, 4], expected, rtol=1e-3, atol=1e-3)


def test_emission_goes_one_way(device) -> None:
    scene = square(Material(name="m"))
    lamp = scene.record.objects[0].model_copy(update={"emission": (7.0, 5.0, 3.0)})
    scene = replace(scene, record=scene.record.model_copy(update={"objects": (lamp,)}))
    renderer = Renderer(device, scene)
    behind = Camera(name="behind", position=(0, 0, -2), target=(0, 0, 0))
    np.testing.assert_allclose(renderer.image(FrameState(FORWARD, 9, 9))[4, 4], (7, 5, 3), rtol=1e-3)
    assert renderer.image(FrameState(behind, 9, 9))[4, 4].max() == 0


def test_a_niche_is_shown_the_share_of_the_probe_that_its_light_map_has(device) -> None:
    glossy = Material(name="m", lobes=(Lobe(mx=0.2, my=0.2, r0=1.0, alpha=0.5),))
    scene = wall_scene(glossy, np.ones((6, 8, 8, 3), np.float32), irradiance=(np.pi / 4,) * 3)

    def shown(*irradiance: float) -> np.ndarray:
        probes = {name: replace(probe, irradiance=irradiance) for name, probe in scene.probes.items()}
        return Renderer(device, replace(scene, probes=probes)).image(FrameState(CAMERA, 16, 12, antialias=False))

    whole = shown()
    np.testing.assert_allclose(shown(np.pi, *[0] * 8), whole / 4, rtol=2e-3)
    np.testing.assert_allclose(shown(np.pi / 8, *[0] * 8), whole, rtol=2e-3)  # never more than the probe has
    np.testing.assert_allclose(shown(np.pi / 3, 0, 0, np.pi / 3, 0, 0, np.pi / 6, 0, 0), whole / 4, rtol=2e-3)


@pytest.mark.parametrize("integrator", ["lamps", "qmc"])
def test_the_light_map_says_from_where_a_probes_light_arrives(device, integrator: str) -> None:
    """Shares a + b.w of the mirrored direction w, on fronts of the objects that they count for; at most 2."""
    mirror = Material(name="m", lobes=(Lobe(mx=0.003, my=0.003, r0=1.0, alpha=0.5),))
    scene = wall_scene(mirror, np.ones((6, 8, 8, 3), np.float32), irradiance=(np.pi / 4,) * 3)
    probes = {name: replace(probe, irradiance=(np.pi, *[0] * 8)) for name, probe in scene.probes.items()}
    scene = replace(scene, probes=probes)
    a, b = 0.6, np.array([0.5, -0.3, 2.0])
    shares = replace(scene, probe_share=np.tile([a, *b], (4, 4, 1)).astype(np.float32))
    w = pixel_rays(CAMERA, 16, 12) * [1, 1, -1]
    expected = np.clip(a + w @ b, 0, 2)
    state = FrameState(CAMERA, 16, 12, integrator=integrator, antialias=False, show="specular")
    found = Renderer(device, replace(shares, share_objects=frozenset(["wall"]))).image(state)[..., 0]
    whole = Renderer(device, replace(scene, probes={n: replace(p, irradiance=()) for n, p in probes.items()})).image(
        state
    )
    np.testing.assert_allclose(found / whole[..., 0], expected, rtol=0.03)
    others = Renderer(device, shares).image(state)  # the niche's share, as without
    np.testing.assert_allclose(others, whole / 4, rtol=5e-3)


def test_show_splits_the_light(device) -> None:
    both = Material(name="m", kd=0.5, lobes=(Lobe(mx=0.2, my=0.2),))
    scene = baked_scene(sphere_and_torus(), both, studio(32), irradiance=(1, 1, 1))
    renderer = Renderer(device, replace(scene, environment=None))
    full, diffuse, specular = (
        renderer.image(FrameState(CAMERA, 48, 36, show=show, antialias=False))
        for show in ("full", "diffuse", "specular")
    )
    np.testing.assert_allclose(full, diffuse + specular, rtol=1e-4, atol=1e-6)
    assert diffuse.max() == pytest.approx(0.5 / np.pi, rel=1e-3)
    assert specular.max() > 0.01


def test_coupled_diffuse_darkens_towards_grazing(device) -> None:
    """kd/pi E t(cos_o), with t of the numpy material."""
    coupled = Material(name="m", kd=(0.2, 0.4, 0.6), kd_coupled=True)
    low = Camera(name="low", position=(2.0, 0.2, 0.8), target=(0.0, 0.0, 0.0), fov_y_deg=30.0)
    scene = wall_scene(coupled, np.zeros((6, 8, 8, 3)), irradiance=(1, 2, 3))
    image = Renderer(device, scene).image(FrameState(low, 12, 8, show="diffuse", antialias=False))
    cos_o = np.abs(pixel_rays(low, 12, 8)[..., 2:])
    seen = cos_o[..., 0] > 0.1  # closer to grazing the shading normal is bent towards the viewer
    assert seen.mean() > 0.8 and cos_o[seen].min() < 0.2 < 0.5 < cos_o.max()
    expected = under_fresnel(cos_o) * np.array([0.2, 0.8, 1.8]) / np.pi
    np.testing.assert_allclose(image[seen], expected[seen], rtol=2e-3)


def test_display_image_is_exposed_and_encoded(device) -> None:
    scene = replace(square(), environment=cube_of(smooth_light))
    renderer = Renderer(device, scene)
    away = Camera(name="away", position=(0, 0, 2), target=(1, 1, 3), fov_y_deg=70)
    state = FrameState(away, 24, 16, exposure_ev=-0.7, view_transform="filmic")
    linear = renderer.image(state)
    np.testing.assert_allclose(renderer.display_image(state), srgb_encode(filmic(linear, -0.7)) * 255, atol=0.55)


def test_jitter_looks_right_of_and_below_the_middle_of_a_pixel() -> None:
    width, height, right_px, below_px = 48, 36, 0.25, 0.375
    per_px = 2 * 2.0 * np.tan(np.radians(FORWARD.fov_y_deg) / 2) / height  # metres in the target's plane
    there = clip_from_world(FORWARD, width, height, 0.01, (right_px, below_px)) @ (
        right_px * per_px, -below_px * per_px, 0.0, 1.0
    )  # fmt: skip
    np.testing.assert_allclose(there[:2], 0, atol=1e-9)


def lamp() -> BakedScene:
    """A slanted square so bright that a mean of radiance would have no edge."""
    mesh = patch((-0.4, -0.3, 0), (0.8, 0.2, 0), (-0.2, 0.6, 0))
    scene = baked_scene({"lamp": mesh}, Material(name="m"), np.zeros((6, 2, 2, 3)))
    glowing = scene.record.objects[0].model_copy(update={"emission": (500.0, 500.0, 500.0)})
    return replace(scene, record=scene.record.model_copy(update={"objects": (glowing,)}))


def test_display_image_blends_the_edges_of_lamps(device) -> None:
    renderer, state = Renderer(device, lamp()), FrameState(FORWARD, 96, 72)
    hard, smooth = renderer.display_image(replace(state, antialias=False)), renderer.display_image(state)
    assert set(np.unique(hard)) == {0, 255}
    truth = srgb_decode(renderer.still(state, 64) / np.float32(255))
    between = (truth > 0.05) & (truth < 0.95)
    assert np.abs(hard / 255 - truth)[between].mean() > 0.2
    assert np.abs(smooth / 255 - truth)[between].mean() < 0.13
    np.testing.assert_array_equal(renderer.image(state) > 0, hard > 0)  # radiance is not smoothed


def test_a_still_is_the_mean_of_what_a_display_emits(device) -> None:
    renderer, state = Renderer(device, lamp()), FrameState(FORWARD, 48, 36)
    still = renderer.still(state)
    np.testing.assert_array_equal(still, renderer.still(state))
    emitted = srgb_decode(still / np.float32(255))
    assert len(np.unique(still)) > 8
    area = (0.8 * 0.6 + 0.2 * 0.2) / (2 * np.tan(np.radians(30)) * 2 / 36) ** 2  # in pixels
    assert emitted[..., 0].sum() == pytest.approx(area, rel=0.01)
    np.testing.assert_array_equal(renderer.still(state, 1), renderer.display_image(replace(state, antialias=False)))
    assert renderer.still_radiance(state)[..., 0].sum() == pytest.approx(500 * area, rel=0.01)
    with pytest.raises(UserError, match="supersamples"):
        renderer.still(state, 0)


def test_given_radiance_is_shown_as_frames_show_theirs(device) -> None:
    """The same picture to a step of 8 bits, under every view transform."""
    gloss = Material(name="m", kd=0.2, lobes=(Lobe(mx=0.15, my=0.15, r0=0.5),))
    renderer = Renderer(device, wall_scene(gloss, cube_of(smooth_light)))
    given = renderer.uploaded_picture()
    for view in ("filmic", "neutral", "linear", "false-colour"):
        frame = FrameState(CAMERA, 48, 32, view_transform=view, antialias=False, exposure_ev=-1.0)
        given.take(renderer.image(frame))
        given.show(frame)
        shown = pixels(device, given.view.texture)[..., :3].astype(int)
        assert np.abs(shown - renderer.display_image(frame)).max() <= 1 and shown.std() > 3


def test_broken_normals_and_tangents_make_no_nan(device) -> None:
    gloss = Material(name="m", kd=0.2, lobes=(Lobe(mx=0.15, my=0.15, r0=0.5),))
    scene = baked_scene(sphere_and_torus(24), gloss, np.full((6, 4, 4, 3), np.nan), irradiance=(1, 1, 1))
    scene = replace(scene, normals=np.zeros_like(scene.normals), tangents=np.full_like(scene.tangents, np.nan))
    renderer = Renderer(device, scene)
    for name in ("rings", "lobe-4.25", "split-sum", "qmc"):
        assert np.isfinite(renderer.image(FrameState(CAMERA, 40, 30, integrator=name, accumulate=0))).all()


@pytest.mark.parametrize(
    "change",
    [
        {"integrator": "ring"},
        {"n": 0},
        {"n": 65},
        {"view_transform": "film"},
        {"show": "all"},
        {"width": 0},
        {"lookup": "plane"},
    ],
)
def test_impossible_frames_are_refused(device, change: dict[str, object]) -> None:
    gloss = Material(name="m", lobes=(Lobe(mx=0.1, my=0.1),))
    renderer = Renderer(device, square(gloss))
    with pytest.raises(UserError):
        renderer.image(replace(FrameState(FORWARD, 8, 8), **change))
