"""Samples that aim at lamps: their table, their density, and what they add up to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from lambent.core.camera import pixel_rays
from lambent.core.cubemap import face_directions, texel_solid_angles
from lambent.core.cubemap import sample as sample_cube
from lambent.core.directions import normalize
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.realtime.aim import aim_table, aimed_share, lamp_probabilities, prominence
from lambent.realtime.frame_state import FrameState
from lambent.realtime.incident import look_ups, shader_of
from lambent.realtime.renderer import Renderer
from lambent.realtime.shader_source import assemble
from lambent.realtime.targets import pixels
from tests.realtime.lit_wall import OBLIQUE, wall_scene
from tests.tools.shader_parity import assert_parity, run_wgsl

N = 8  # texels of the table that the shader's functions are tried with
BOX = np.array([[-2.0, -1.5, -1.0], [2.5, 2.0, 3.0]])  # low, high
PLANES = np.array(
    [[*sign * np.eye(3)[axis], -sign * BOX[int(sign < 0), axis]] for axis in range(3) for sign in (1, -1)]
)
OFF_CENTRE = np.array([1.1, -0.7, 0.4])
STATE = FrameState(OBLIQUE, 8, 8, antialias=False, show="specular", lookup="plain")
ROUGH = Lobe(mx=0.4, my=0.4, r0=0.7, alpha=0.5)


def spotted(seed: int = 5) -> np.ndarray:
    """(6, N, N, 3): grey, with a dozen bright texels."""
    rng = np.random.default_rng(seed)
    cube = np.full((6, N, N, 3), 0.1)
    for _ in range(12):
        cube[tuple(rng.integers((6, N, N)))] = rng.uniform(2, 20, 3)
    return cube


def evaluate(
    expression: str, cube: np.ndarray, planes: np.ndarray, components: int = 1, **inputs: np.ndarray
) -> np.ndarray:
    """Of aim.wgsl and the look-up by planes, with tables of their own."""
    given = {"look_up.wgsl": shader_of(look_ups()["planes"])}
    source = assemble("aim.wgsl", "incident.wgsl", "look_up.wgsl", given=given)
    for binding in (
        "@group(2) @binding(2) var<storage, read> aim: array<vec4f>;",
        "@group(2) @binding(3) var<storage, read> planes: array<vec4f>;",
    ):
        assert binding in source
        source = source.replace(binding, "")
    source = source.replace("override PLANES: u32 = 0u;", f"const PLANES = {len(planes)}u;")
    declarations = (
        "fn density_at(x: vec3f, w: vec3f) -> f32 {\n"
        "    let found = aimed_look_up(x, w);\n    return aim_probability(found.direction) * found.density;\n}\n"
    )
    # both tables are named, so that an expression which needs one only has the bindings of both
    used = f"{expression} + 0.0 * (aim[0] + planes[0])" + (".x" if components == 1 else ".xyz")
    tables = {"aim": aim_table(cube), "planes": planes if len(planes) else np.zeros((1, 4))}
    return run_wgsl(source, used, inputs, components=components, declarations=declarations, tables=tables)


def texels_of(w: np.ndarray, n: int) -> np.ndarray:
    """(...) index into (6, n, n) of the texel that a direction lies in: that of the index it looks up."""
    index = np.arange(6 * n * n, dtype=float).reshape(6, n, n, 1).repeat(8, axis=1).repeat(8, axis=2)
    fine = normalize(w) * 1.0
    major = np.abs(fine).max(axis=-1, keepdims=True)
    snapped = (np.floor((fine / major + 1) * 4 * n) + 0.5) / (4 * n) - 1  # to the middles of 8 x 8 parts of texels
    axis = np.abs(fine).argmax(axis=-1)[..., None]
    np.put_along_axis(snapped, axis, np.sign(np.take_along_axis(fine, axis, -1)), -1)
    return sample_cube(index, snapped)[..., 0].round().astype(int)


def density_reference(cube: np.ndarray, x: np.ndarray, w: np.ndarray, boxed: bool) -> np.ndarray:
    """Density (M,) in 1/sr of unit directions w (M, 3) at x: of the probe's, times the ratio of solid angles of a piece
    of wall from the probe and from x."""
    ratio, q = np.ones(len(w)), w
    if boxed:
        walls = np.where(w > 0, BOX[1], BOX[0])
        t_axis = (walls - x) / np.where(np.abs(w) < 1e-12, 1e-12, w)
        axis = t_axis.argmin(axis=-1)
        t = t_axis.min(axis=-1)
        q = x + t[:, None] * w
        r, rows = np.linalg.norm(q, axis=-1), np.arange(len(w))
        ratio = (np.abs(q[rows, axis]) / r / r**2) / (np.abs(w[rows, axis]) / t**2)
    probabilities = lamp_probabilities(cube)[0]
    square = np.linalg.norm(q, axis=-1) / np.abs(q).max(axis=-1)  # 1/cos of the face
    return probabilities.ravel()[texels_of(q, N)] * (N / 2) ** 2 * square**3 * ratio


def test_the_table_holds_lamps_and_nothing_else() -> None:
    cube = np.full((6, 128, 128, 3), 0.5)
    cube[3, 40:48, 16:24] = 60.0
    probabilities, variance = lamp_probabilities(cube)
    assert probabilities.shape == (6, 64, 64)
    assert probabilities.sum() == pytest.approx(1)
    face, row, column = np.nonzero(probabilities)
    assert set(face) == {3}
    # 4 x 4 texels, and those that bilinear look-ups reach
    assert (row.min(), row.max(), column.min(), column.max()) == (19, 24, 7, 12)
    assert probabilities[3, 20:24, 8:12].sum() > 0.9
    omega = texel_solid_angles(128)[40:48, 16:24].sum()
    lamp, rest = 59.5 * omega, 0.5 * 4 * np.pi
    assert variance == pytest.approx(4 * np.pi / omega * (lamp / (lamp + rest)) ** 2, rel=0.15)
    assert prominence(variance) == 1


def test_uniform_light_has_no_lamps() -> None:
    probabilities, variance = lamp_probabilities(np.full((6, 8, 8, 3), 2.0))
    assert prominence(variance) == 0
    np.testing.assert_allclose(probabilities[0], texel_solid_angles(8) / (4 * np.pi), rtol=1e-5)
    assert lamp_probabilities(np.full((6, 5, 5, 3), 2.0))[0].shape == (6, 4, 4)
    np.testing.assert_allclose(lamp_probabilities(np.zeros((6, 1, 1, 3)))[0].sum(), 1)


@pytest.mark.parametrize("boxed", [False, True])
def test_density_is_that_of_numpy_and_integrates_to_one(boxed: bool) -> None:
    cube = spotted()
    planes = PLANES if boxed else PLANES[:0]
    n = 96
    w = normalize(face_directions(n)).reshape(-1, 3)
    x = np.broadcast_to(OFF_CENTRE, w.shape)
    got = evaluate("density_at(x, w)", cube, planes, x=x, w=w)
    expected = density_reference(cube, OFF_CENTRE, w, boxed)
    # float32 may find another texel where a direction meets the edge of one
    same = np.isclose(got, expected, rtol=1e-4, atol=1e-6)
    assert same.mean() > 0.998
    assert_parity(got[same], expected[same].astype(np.float32), rtol=1e-4, atol=1e-6)
    assert np.sum(got * np.tile(texel_solid_angles(n).ravel(), 6)) == pytest.approx(1, abs=0.01)


def test_directions_are_drawn_with_that_probability() -> None:
    cube = spotted()
    u = np.random.default_rng(3).random((60_000, 2))
    w = evaluate("aim_draw(u).xyz", cube, PLANES[:0], 3, u=u)
    expected = lamp_probabilities(cube)[0].ravel() * len(u)
    counts = np.bincount(texels_of(w, N), minlength=expected.size)
    assert counts[expected == 0].sum() == 0
    often = expected > 5
    assert chi2.sf(np.sum((counts - expected)[often] ** 2 / expected[often]), often.sum() - 1) > 1e-4


def test_a_direction_that_aims_leads_back_to_what_it_aims_at() -> None:
    q = normalize(np.random.default_rng(4).normal(size=(5000, 3)))
    x = np.random.default_rng(5).uniform(0.98 * BOX[0], 0.98 * BOX[1], q.shape)
    back = evaluate("aimed_look_up(x, aim_towards(x, q).w).direction", spotted(), PLANES, 3, x=x, q=q)
    np.testing.assert_allclose(normalize(back), q, atol=2e-5)


def test_nothing_aims_where_the_probe_stands_behind_a_plane() -> None:
    outside = np.array([[0.0, 0.0, 1.0, -0.5]])  # z > .5
    x = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.2]])
    np.testing.assert_array_equal(evaluate("f32(aim_maps(x))", spotted(), outside, x=x), [0, 1])


def test_numpy_and_the_shader_aim_as_many_samples() -> None:
    p, roughness = np.meshgrid(np.linspace(0, 1, 9), np.geomspace(0.005, 1.0, 25))
    got = evaluate("wanted_sixteenths(p, m * m)", spotted(), PLANES[:0], p=p.ravel(), m=roughness.ravel())
    expected = [16 * aimed_share(m, prominent) for prominent, m in zip(p.ravel(), roughness.ravel(), strict=True)]
    np.testing.assert_allclose(got, expected, atol=1e-4)
    assert min(expected) == 0 and max(expected) == 12


def one_lamp(face: int) -> np.ndarray:
    """(6, 64, 64, 3): 2 x 2 texels of light in the dark."""
    cube = np.zeros((6, 64, 64, 3), np.float32)
    cube[face, 24:26, 39:41] = (60.0, 30.0, 10.0)
    return cube


def lamp_light(cube: np.ndarray, face: int, lobe: Lobe, boxed: bool) -> np.ndarray:
    """(8, 8, 3) by quadrature over the lamp as the probe sees it; the probe is at the origin, on the wall."""
    steps = 96
    row, column = (np.arange(steps) + 0.5) / steps * 6 + np.array([[22.0], [37.0]])
    s, t = np.meshgrid(column / 32 - 1, row / 32 - 1)
    sign = 1 if face == 4 else -1
    q = np.stack([sign * s, -t, sign * np.ones_like(s)], axis=-1).reshape(-1, 3)
    omega = ((6 / steps / 32) ** 2 / np.sum(q * q, axis=-1) ** 1.5)[:, None]
    light = sample_cube(cube, q)
    rays = pixel_rays(OBLIQUE, 8, 8)
    eye = np.array(OBLIQUE.position)
    places = eye - rays * (eye[2] / rays[..., 2:])
    seen = np.zeros((8, 8, 3))
    bsdf = MaterialBSDF(Material(name="m", lobes=(lobe,)))
    for index in np.ndindex(8, 8):
        wi, ratio = normalize(q), np.ones((len(q), 1))
        if boxed:
            height = BOX[1, 2] if face == 4 else -BOX[0, 2]
            p = q * height
            to = p - places[index]
            wi = normalize(to)
            r, r_x = np.linalg.norm(p, axis=-1), np.linalg.norm(to, axis=-1)
            ratio = ((height / r_x / r_x**2) / (height / r / r**2))[:, None]
        f = bsdf.eval(wi, np.broadcast_to(-rays[index], wi.shape))
        seen[index] = np.sum(f * np.abs(wi[:, 2:]) * light * omega * ratio, axis=0)
    return seen


@pytest.mark.parametrize("boxed", [False, True])
@pytest.mark.parametrize(
    "lobe",
    [
        ROUGH,
        Lobe(mx=0.3, my=0.1, r0=0.8, distribution="ggx"),
        Lobe(mx=0.35, my=0.3, r0=0.1, k=0.8, side="transmission"),
        Lobe(mx=0.35, my=0.3, r0=1.0, k=0.8, retro=True, alpha=-0.5),
    ],
    ids=["rough", "brushed ggx", "transmission", "retro"],
)
def test_one_small_lamp_in_the_dark(device, lobe: Lobe, boxed: bool) -> None:
    face = 5 if lobe.side == "transmission" else 4
    cube = one_lamp(face)
    expected = lamp_light(cube, face, lobe, boxed)
    of = Material(name="m", lobes=(lobe,))
    renderer = Renderer(device, wall_scene(of, cube, planes=PLANES if boxed else None))
    state = replace(STATE, lookup="planes" if boxed else "plain")
    image = renderer.converged(state, 512)
    error = (image / expected - 1)[..., 0]
    assert np.abs(error).max() < 0.08
    assert abs(error.mean()) < 4 * error.std() / 8 < 0.012
    alone = replace(state, integrator="qmc-lobe")
    for index in range(64):
        left = renderer.draw(replace(alone, accumulate=index))
    blind = pixels(device, left)
    assert np.abs(blind / expected - 1).mean() > 10 * np.abs(error).mean()


@pytest.mark.parametrize("n", [1, 3])
def test_frames_of_few_samples_take_turns(device, n: int) -> None:
    """Counts of both kinds that do not divide a frame's samples, on a smooth and a jittered series."""
    expected = lamp_light(one_lamp(4), 4, ROUGH, boxed=False)
    renderer = Renderer(device, wall_scene(Material(name="m", lobes=(ROUGH,)), one_lamp(4)))
    image = renderer.converged(replace(STATE, n=n), 600)
    error = (image / expected - 1)[..., 0]
    assert abs(error.mean()) < 4 * error.std() / 8 < 0.02
