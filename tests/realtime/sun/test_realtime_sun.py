"""Direct sunlight by the shadow map: a plate with an opening over a floor, whose penumbra is known by rays."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import basis, normalize
from lambent.core.geometry.sequences import hammersley
from lambent.core.views.camera import Camera, pixel_rays
from lambent.materials.document import Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.objects.unbaked import unbaked_scene
from lambent.realtime.renderer import Renderer
from lambent.realtime.sun.sun import BLOCK, block_ranges
from lambent.scenes.geometry import box, merge, patch, placed, sphere
from lambent.scenes.scene import Mesh
from lambent.store.contract import SunRecord
from tests.realtime.planar import test_realtime_planar as planar

TOWARDS = normalize(np.array([0.3, 0.9, 0.2]))
IRRADIANCE = (3.0, 2.0, 1.0)
HEIGHT, HALF = 2.0, 0.5  # of the plate, and half the side of its opening, metres
DOWN = Camera(name="down", position=(-0.7, 1.9, -0.4), target=(-0.7, 0.0, -0.401), fov_y_deg=60.0)
SIZE = 96


def plate() -> Mesh:
    """A plate of 8 m in the plane y = HEIGHT with a square opening about x = z = 0."""
    far = 4.0
    sides = [
        ((-far, far), (HALF, far)), ((-far, far), (-far, -HALF)), ((-far, -HALF), (-HALF, HALF)),
        ((HALF, far), (-HALF, HALF)),
    ]  # fmt: skip
    parts = (patch((x[0], HEIGHT, z[1]), (x[1] - x[0], 0, 0), (0, 0, z[0] - z[1])) for x, z in sides)
    return merge(parts)


def floor(half: float = 4.0) -> Mesh:
    return patch((-half, 0, half), (2 * half, 0, 0), (0, 0, -2 * half))


def scene(
    meshes: dict[str, Mesh],
    radius_deg: float,
    material: Material | None = None,
    environment: Floats | None = None,
    **record: Any,
) -> BakedScene:
    """Under the sun alone: light maps are black, if the environment is."""
    environment = np.zeros((6, 4, 4, 3), np.float32) if environment is None else environment
    dark = unbaked_scene(meshes, material or Material(name="grey", kd=0.5), environment)
    sun = SunRecord(direction=tuple(TOWARDS), irradiance=IRRADIANCE, radius_rad=np.radians(radius_deg))
    return replace(dark, sun=sun, record=dark.record.model_copy(update={"cameras": (DOWN,), **record}))


def drawn(
    device: Any, baked: BakedScene, camera: Camera = DOWN, frames: int = 16, alone: bool = False, **state: Any
) -> Floats:
    """(SIZE, SIZE) irradiance of the first channel, over that of a surface that faces the sun."""
    renderer = Renderer(device, baked)
    how = {"show": "light-map", "antialias": False, **state}
    series = [None] if alone else range(frames)
    shown = [renderer.image(FrameState(camera, SIZE, SIZE, accumulate=k, **how)) for k in series]
    return shown[-1][..., 0] / IRRADIANCE[0]


def places(camera: Camera) -> Floats:
    """(SIZE, SIZE, 3) of the floor that the pixels show."""
    w = pixel_rays(camera, SIZE, SIZE)
    return np.asarray(camera.position - w * (camera.position[1] / w[..., 1:2]))


def traced(points: Floats, radius_deg: float) -> Floats:
    """Share of the sun's disc that points of the floor see through the opening."""
    t, b = basis(TOWARDS)
    u = hammersley(4096)
    disc = np.tan(np.radians(radius_deg)) * np.sqrt(u[:, :1]) * np.column_stack(
        [np.cos(2 * np.pi * u[:, 1]), np.sin(2 * np.pi * u[:, 1])]
    )  # fmt: skip
    w = TOWARDS + disc[:, :1] * t + disc[:, 1:] * b
    step = (w / w[:, 1:2])[:, [0, 2]] * HEIGHT
    at = points.reshape(-1, 1, 3)[..., [0, 2]] + step
    return np.asarray((np.abs(at).max(axis=-1) < HALF).mean(axis=1).reshape(points.shape[:2]))


@pytest.mark.long
@pytest.mark.parametrize("radius_deg", [0.27, 3.0])
def test_penumbra_is_that_of_rays_to_the_disc(device: Any, radius_deg: float) -> None:
    found = drawn(device, scene({"floor": floor(), "plate": plate()}, radius_deg)) / TOWARDS[1]
    expected = traced(places(DOWN), radius_deg)
    penumbra = (expected > 0.02) & (expected < 0.98)
    assert penumbra.sum() > 100 and (expected > 0.98).sum() > 100
    assert np.abs(found - expected)[~penumbra].max() < 0.05
    assert np.abs(found - expected)[penumbra].mean() < (0.055 if radius_deg > 1 else 0.02)
    assert found.mean() == pytest.approx(expected.mean(), rel=0.01), "no light is lost or won"


@pytest.mark.long
def test_slats_in_the_penumbra_of_a_roof_leave_shadows_of_their_own(device: Any) -> None:
    """A wide sun behind the edge of a roof, and slats close to the floor: no one filter fits both penumbras."""
    roof = ((-4.0, HEIGHT, 4.0), (8.0, 0.0, 0.0), (0.0, 0.0, -4.3))
    slats = [((-1.2 + 0.15 * k, 0.35, 0.2), (0.05, 0.0, 0.0), (0.0, 0.0, -1.2)) for k in range(8)]
    camera = replace(DOWN, position=(-0.7, 1.5, -0.4), fov_y_deg=50.0)
    expected = past([roof, *slats], places(camera).reshape(-1, 3), 5.0).reshape(SIZE, SIZE)
    shown = past([*slats], places(camera).reshape(-1, 3), 0.0, np.array(camera.position)).reshape(SIZE, SIZE) > 0
    baked = scene({"floor": floor(), "roof": patch(*roof), "slats": merge(patch(*one) for one in slats)}, 5.0)
    found = drawn(device, baked, camera, alone=True) / TOWARDS[1]
    error = (found - expected)[binary_erosion(shown, iterations=2)]
    assert np.sqrt((error**2).mean()) < 0.06, ".08 by one filter"
    assert abs(error.mean()) < 0.01


def past(patches: list[Any], points: Floats, radius_deg: float, eye: Floats | None = None) -> Floats:
    """Shares (n,) of the sun's disc, or of an eye, that points (n, 3) see past patches (corner and two edges)."""
    t, b = basis(TOWARDS)
    u = hammersley(256 if eye is None else 1)
    disc = np.tan(np.radians(radius_deg)) * np.sqrt(u[:, :1]) * np.column_stack(
        [np.cos(2 * np.pi * u[:, 1]), np.sin(2 * np.pi * u[:, 1])]
    )  # fmt: skip
    w = TOWARDS + disc[:, :1] * t + disc[:, 1:] * b if eye is None else (eye - points)[:, None]
    seen = np.ones((len(points), len(u)), bool)
    for corner, one, other in (map(np.array, edges) for edges in patches):
        n = np.cross(one, other)
        distance = ((corner - points) @ n)[:, None] / (w @ n)
        at = points[:, None] + distance[..., None] * w - corner
        on = [(at @ edge / (edge @ edge) > 0) & (at @ edge / (edge @ edge) < 1) for edge in (one, other)]
        seen &= ~((distance > 1e-6) & on[0] & on[1])
    return np.asarray(seen.mean(axis=1))


@pytest.mark.long
def test_penumbra_stays_sharp_over_a_plane_of_fifty_kilometres(device: Any) -> None:
    found = drawn(device, scene({"floor": floor(25e3), "plate": plate()}, 0.27)) / TOWARDS[1]
    expected = traced(places(DOWN), 0.27)
    assert np.abs(found - expected).mean() < 0.02


@pytest.mark.long
def test_lit_surfaces_do_not_shadow_themselves_and_blocks_do_not_leak(device: Any) -> None:
    block = placed(box((0.8, 0.6, 0.8)), (0, 0.3, 0))
    camera = Camera(name="aside", position=(2.0, 2.2, 1.2), target=(0.0, 0.2, 0.0), fov_y_deg=45.0)
    found = drawn(device, scene({"floor": floor(), "block": block}, 0.27), camera, frames=1, antialias=False)
    w = pixel_rays(camera, SIZE, SIZE)
    expected, unsure = np.zeros((SIZE, SIZE)), np.zeros((SIZE, SIZE), bool)
    for row, column in np.ndindex(SIZE, SIZE):
        point, normal = first_hit(np.array(camera.position), w[row, column])
        shares = [0.0 if in_block(point + 1e-4 * normal + 1e-6, aside) else 1.0 for aside in (-0.03, 0.0, 0.03)]
        expected[row, column] = shares[1] * max(normal @ TOWARDS, 0)
        unsure[row, column] = (normal[1] == 1 and point[1] < 0.1 and len(set(shares)) > 1) or abs(point).max() > 3.9
    near_edge = unsure | (np.abs(np.gradient(expected)).max(axis=0) > 0)
    assert near_edge.mean() < 0.4 and np.abs(found - expected)[~near_edge].max() < 0.02


def first_hit(eye: Floats, w: Floats) -> tuple[Floats, Floats]:
    """Where a ray meets the block or the floor, and the normal there."""
    t = -eye[1] / w[1]
    found = eye + t * w, np.array([0.0, 1.0, 0.0])
    for axis, (low, high) in enumerate(((-0.4, 0.4), (0.0, 0.6), (-0.4, 0.4))):
        face = high if w[axis] < 0 else low
        at = (face - eye[axis]) / w[axis]
        p = eye + at * w
        inside = np.all((np.abs(p - [0, 0.3, 0]) <= [0.4, 0.3, 0.4]) | (np.arange(3) == axis))
        if inside and 0 < at < t:
            t, found = at, (p, -np.sign(w[axis]) * np.eye(3)[axis])
    return found


def in_block(p: Floats, aside: float) -> bool:
    """Whether the block, grown by `aside` on all sides but below, hides the sun's centre."""
    half = np.array([0.4, 0.3, 0.4]) + aside
    near, far = np.sort([(s * half + [0, 0.3, 0] - p) / TOWARDS for s in (-1, 1)], axis=0)
    return bool(near.max() < far.min() and far.min() > 1e-3)


@pytest.mark.long
def test_facets_of_a_ball_are_lit_as_far_as_the_ball_is(device: Any) -> None:
    """Facets that turn away from the sun hide themselves; where a plate hides the sun, they stay dark."""
    radius, middle = 0.5, np.array([0.0, 0.55, 0.0])
    meshes = {"floor": floor(), "ball": placed(sphere(radius, 24, 12), tuple(middle))}
    camera = Camera(name="aside", position=(1.2, 1.5, 2.2), target=tuple(middle), fov_y_deg=32.0)
    eye, w = np.array(camera.position) - middle, pixel_rays(camera, SIZE, SIZE)
    along = w @ eye
    square = along**2 - eye @ eye + (0.96 * radius) ** 2  # within the facets' outline
    cosine = normalize(eye + (-along - np.sqrt(square.clip(0)))[..., None] * w) @ TOWARDS
    found = drawn(device, scene(meshes, 0.27, cameras=(camera,)), camera, 1)
    assert ((cosine > 0) & (cosine < 0.1) & (square > 0)).sum() > 100
    assert (found - cosine)[square > 0].min() > -0.03, "up to .09 is missing where facets hide themselves"
    meshes["lid"] = placed(floor(), (0, 1.9, 0))
    covered = drawn(device, scene(meshes, 0.27, cameras=(camera,)), camera, 1)
    assert not covered[square > 0].any()


def test_sheet_that_transmits_shows_the_sun_from_behind(device: Any) -> None:
    behind = Camera(name="behind", position=(0.0, -2.0, 0.0), target=(0.0, 0.0, 0.001), fov_y_deg=30.0)
    for kt_d, expected in ((0.4, 0.4 * TOWARDS[1] / np.pi), (0.0, 0.0)):
        sheet = Material(name="sheet", kd=(0.3,) * 3, kt_d=(kt_d,) * 3)
        baked = scene({"sheet": floor(1.0)}, 0.27, sheet)
        assert np.allclose(drawn(device, baked, behind, 1, show="diffuse"), expected, rtol=0.01)


def test_blocks_know_the_least_and_the_greatest_depth_about_them() -> None:
    depths = np.random.default_rng(0).random((2, 4 * BLOCK, 4 * BLOCK)).astype(np.float32)
    found = block_ranges(depths)
    assert found.shape == (2, 4, 6, 2)
    corner = depths[1, : 3 * BLOCK, : 2 * BLOCK]
    assert found[1, 1, 0].tolist() == [corner.min(), corner.max()]
    inner = depths[1, BLOCK:, : 3 * BLOCK]
    assert found[1, 2, 1].tolist() == [inner.min(), inner.max()]
    for level in (found[1, 1, 4], found[1, 2, 4]):  # of 2 x 2 blocks, and of one
        assert level.tolist() == [depths[1].min(), depths[1].max()]


@pytest.mark.long
def test_a_mirror_shows_sunlight_and_shadows(device: Any) -> None:
    """As the camera below the floor sees them: a wall with the shadows of a box and a ball on it."""
    sun = SunRecord(direction=tuple(normalize(np.array([0.3, 0.5, 0.8]))), irradiance=IRRADIANCE, radius_rad=0.005)
    above, below = (planar.scene_of(planar.mirror(0.001), floor) for floor in (True, False))
    dull = [o.model_copy(update={"emission": (0.0, 0.0, 0.0)}) for o in above.record.objects]
    lit = [
        replace(baked, sun=sun, record=baked.record.model_copy(update={"objects": tuple(dull[: len(baked.probes)])}))
        for baked in (above, below)
    ]
    (x, y, z), (u, v, w) = planar.CAMERA.position, planar.CAMERA.target
    turned = replace(planar.CAMERA, position=(x, -y, z), target=(u, -v, w), up=(0, -1, 0))
    expected = Renderer(device, lit[1]).image(replace(planar.state(), camera=turned))[:, ::-1]
    renderer = Renderer(device, lit[0])
    found = renderer.image(planar.state(n=3, integrator="rings"))
    floor = renderer.image(planar.state(planar="off"))[..., 2] == 0  # the dark probe
    on_wall = floor & (expected[..., 2] < 0.5)  # not the sky
    sunny, shaded = on_wall & (expected[..., 0] > 0.2), on_wall & (expected[..., 0] < 0.01)
    assert sunny.sum() > 300 and shaded.sum() > 40
    difference = np.abs(found - expected).max(axis=-1)
    assert np.median(difference[on_wall]) < 0.01 and (difference[on_wall] < 0.1).mean() > 0.9
    assert np.median(found[sunny][:, 0] / expected[sunny][:, 0]) == pytest.approx(1, rel=0.02)
