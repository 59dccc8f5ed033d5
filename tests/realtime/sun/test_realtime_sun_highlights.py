"""Highlights of the sun: as path traced, wherever a probe stands, and counted once where it shows the disc."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import binary_erosion

from lambent.baked.probes.irradiance import basis_of
from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import face_directions, texel_solid_angles
from lambent.core.geometry.directions import basis, normalize
from lambent.core.geometry.sequences import hammersley
from lambent.core.light.colour import luminance
from lambent.core.views.camera import Camera, pixel_rays
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.cube_mips import finite
from lambent.realtime.light.baked import BakedScene, Probe
from lambent.realtime.objects.unbaked import unbaked_scene
from lambent.realtime.renderer import Renderer
from lambent.realtime.sun.sun_disc import without_sun
from lambent.scenes.geometry import patch, placed, sphere
from lambent.scenes.scene import DirectionalLight, Scene, SceneObject
from lambent.store.contract import SunRecord

TOWARDS = normalize(np.array([0.3, 0.9, 0.4]))
IRRADIANCE = (3.0, 2.5, 2.0)
GLOSSY = Material(name="m", lobes=(Lobe(mx=0.5, my=0.3, r0=(0.9, 0.6, 0.5), alpha=0.4),))
CAMERA = Camera(name="c", position=(0.5, 1.9, 2.6), target=(0.0, 0.4, 0.0), fov_y_deg=36.0)
SIZE = 96
# A ball on a floor, and a plate at 2 m whose edge lets the sun see half of both.
MESHES = {
    "ball": placed(sphere(0.5, 96, 48), (0.0, 0.5, 0.0)),
    "floor": patch((-2, 0, 2), (4, 0, 0), (0, 0, -4)),
    "plate": patch((0.5, 2.0, 4.0), (4, 0, 0), (0, 0, -6)),
}


def sun(radius_rad: float = 0.0, irradiance: tuple[float, float, float] = IRRADIANCE) -> SunRecord:
    return SunRecord(direction=tuple(TOWARDS), irradiance=irradiance, radius_rad=radius_rad)


def disc_cube(radius_rad: float, rest: float, n: int = 64) -> Floats:
    """(6, n, n, 3): a disc of the sun's light on an even sky, in as many texels as it touches."""
    away = np.arccos(np.clip(normalize(face_directions(n)) @ TOWARDS, -1, 1))
    inside = away < max(radius_rad, 1.5 / n)
    omega = np.broadcast_to(texel_solid_angles(n), (6, n, n))
    cube = np.full((6, n, n, 3), rest)
    cube[inside] += np.array(IRRADIANCE) / omega[inside].sum()
    return cube.astype(np.float32)


def lit(environment: Floats, radius_rad: float = 0.0, material: Material = GLOSSY) -> BakedScene:
    return replace(unbaked_scene(MESHES, material, environment), sun=sun(radius_rad))


@pytest.fixture(scope="module")
def traced(mi: Any) -> Floats:
    from lambent.baking.reference.path_traced import render_reference

    objects = tuple(SceneObject(name, mesh, "m") for name, mesh in MESHES.items())
    light = DirectionalLight(tuple(-TOWARDS), IRRADIANCE)
    scene = Scene("shade", objects, {"m": GLOSSY}, lights=(light,))
    return render_reference(scene, CAMERA, SIZE, SIZE, 64, max_depth=1)[0].astype(float)


@pytest.mark.long
@pytest.mark.parametrize("integrator", ["lamps", "qmc"])
def test_a_ball_half_in_the_shade_is_that_of_the_path_tracer(device: Any, traced: Floats, integrator: str) -> None:
    """With a probe in the shade, and with one that sees the disc, which must not count twice."""
    for cube in (np.zeros((6, 64, 64, 3), np.float32), disc_cube(0.0, 0.0)):
        renderer = Renderer(device, lit(cube))
        state = FrameState(CAMERA, SIZE, SIZE, integrator=integrator, antialias=False, n=16)
        image = renderer.still_radiance(state, 4) if integrator[0] != "q" else renderer.converged(state, 256)
        sees = traced.max(axis=-1) > 1e-3
        sure = binary_erosion(sees, iterations=2) | binary_erosion(~sees, iterations=2)
        assert sees.mean() > 0.1 and (~sees).mean() > 0.3
        lit_mean, expected = image[sees].mean(axis=0), traced[sees].mean(axis=0)
        np.testing.assert_allclose(lit_mean, expected, rtol=0.01)
        error = np.abs(image - traced)[sure]
        assert np.quantile(error, 0.99) < 0.03 * np.quantile(traced, 0.99)


def spread(image: Floats) -> float:
    """Variance of the place of the light in a picture, pixels squared."""
    light = image.sum(axis=-1) / image.sum()
    place = np.indices(light.shape)
    mean = (light * place).sum(axis=(1, 2), keepdims=True)
    return float((light * (place - mean) ** 2).sum())


@pytest.mark.long
@pytest.mark.parametrize(("m", "radius_rad"), [(0.004, 0.02), (0.1, 0.03)])
def test_a_disc_wider_than_the_lobe_at_rest(device: Any, m: float, radius_rad: float) -> None:
    """On a floor, against the mean of f cos_i over the disc; in motion the light is the same, if less sharp."""
    lobe = Lobe(mx=m, my=m, r0=0.9)
    floor = unbaked_scene({"floor": MESHES["floor"]}, Material(name="m", lobes=(lobe,)), np.zeros((6, 4, 4, 3)))
    mirrored = TOWARDS * (-1, 1, -1)
    camera = Camera(
        name="c", position=tuple(2 * mirrored), target=(0.0, 0.0, 0.0), fov_y_deg=6 * np.degrees(m + radius_rad)
    )
    renderer = Renderer(device, replace(floor, sun=sun(radius_rad)))
    state = FrameState(camera, 24, 24, show="specular", antialias=False)
    rest = renderer.converged(replace(state, integrator="qmc"), 512)
    wo = -pixel_rays(camera, 24, 24).reshape(-1, 3)[:, None, [0, 2, 1]] * (1, -1, 1)  # y up to z up
    u = hammersley(4096)
    t, b = basis(TOWARDS)
    place = (
        np.tan(radius_rad)
        * np.sqrt(u[:, :1])
        * np.column_stack([np.cos(2 * np.pi * u[:, 1]), np.sin(2 * np.pi * u[:, 1])])
    )
    wi = normalize(TOWARDS + place[:, :1] * t + place[:, 1:] * b)[None][..., [0, 2, 1]] * (1, -1, 1)
    f = MaterialBSDF(Material(name="m", lobes=(lobe,))).eval(wi, wo) * wi[..., 2:]
    expected = (f.mean(axis=1) * IRRADIANCE).reshape(24, 24, 3)
    error = np.sqrt(np.mean((rest - expected) ** 2))
    assert error < 0.02 * expected.max() and rest.mean() == pytest.approx(expected.mean(), rel=0.01)
    moving = renderer.image(state)
    assert moving.mean() == pytest.approx(expected.mean(), rel=0.03)
    assert spread(moving) == pytest.approx(spread(expected), rel=0.05), "as wide"


def test_a_probe_loses_the_disc_and_keeps_all_else() -> None:
    cube = disc_cube(0.01, 0.25)
    patch_of_wall = normalize(face_directions(64)) @ normalize(np.array([-1.0, 0.2, 0.1])) > 0.99
    cube[patch_of_wall] = 0.7  # nearly as bright as a white wall in the sun
    found = without_sun(Probe((0, 0, 0), cube, irradiance=(9.0,) * 9), sun(0.01), unit=2.0)
    expected = np.where(patch_of_wall[..., None], 0.7, 0.25)
    np.testing.assert_allclose(found.radiance, np.broadcast_to(expected, cube.shape), atol=1e-6)
    gone = np.array(found.irradiance) - 9.0
    facing = float(basis_of(TOWARDS) @ gone)  # to the second band, the cosine is 17/16 towards the light
    assert facing == pytest.approx(-2 * 17 / 16 * luminance(np.array(IRRADIANCE)), rel=0.02)


@pytest.mark.parametrize("n", [1, 4])
def test_small_cubes_and_odd_texels_stay_finite(n: int) -> None:
    cube = disc_cube(0.01, 0.25, n)
    cube[2, 0, 0, 1], cube[5, 0, 0] = np.nan, -1.0
    found = finite(without_sun(Probe((0, 0, 0), cube), sun(0.01)).radiance)[0]
    before = finite(cube)[0]
    assert (found <= before).all() and (found[3] == before[3]).all()
