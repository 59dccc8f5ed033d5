"""Lamps outside of a probe's cube map: the picture is that of the cube map with them, and no roughness makes it pop."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from lambent.core.geometry.cubemap import face_directions
from lambent.core.geometry.directions import normalize
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.shader_source import assemble
from lambent.realtime.incident import look_ups
from lambent.realtime.light.probe_lamps import HEAD_ROWS, LAMP_ROWS, ProbeLamps, groups_out
from lambent.realtime.objects.draws import draws_of
from lambent.realtime.objects.unbaked import unbaked_scene
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import sphere
from tests.materials.test_lobes_shader import declared
from tests.realtime.integrators.test_realtime_integrators import HIGH, LOW, box_hit, box_planes, material
from tests.realtime.lit_wall import OBLIQUE, cube_of, smooth_light, wall_scene
from tests.tools.shader_parity import run_wgsl

STATE = FrameState(OBLIQUE, 12, 12, antialias=False, show="specular", lookup="plain", integrator="lamps", n=3)
BALL = Camera(name="c", position=(0.3, 0.5, 3.2), target=(0.0, 0.0, 0.0), fov_y_deg=24.0)
LOBES = {
    "satin": Lobe(mx=0.1, my=0.1, r0=(0.9, 0.7, 0.4), alpha=0.4),
    "rough": Lobe(mx=0.4, my=0.4, r0=0.7, alpha=0.5),
    "brushed": Lobe(mx=0.3, my=0.1, r0=0.8, alpha=0.5),
    "ggx": Lobe(mx=0.3, my=0.3, r0=0.5, distribution="ggx"),
    "transmission": Lobe(mx=0.35, my=0.3, r0=0.1, k=0.8, side="transmission"),
    "retro": Lobe(mx=0.35, my=0.3, r0=1.0, k=0.8, retro=True, alpha=-0.5),
}


def lit(*lamps: tuple[np.ndarray, float, float], rest: float = 0.05, n: int = 128) -> np.ndarray:
    """(6, n, n, 3): discs (direction, radius in rad, radiance) in one colour on an even background."""
    w = normalize(face_directions(n))
    cube = np.full((6, n, n, 3), rest, np.float32)
    for direction, radius, radiance in lamps:
        cube[w @ normalize(np.asarray(direction, float)) > np.cos(radius)] = radiance * np.array([1.0, 0.8, 0.5])
    return cube


def lamps_of(lobe: Lobe) -> list[tuple[np.ndarray, float, float]]:
    side = np.array([1, 1, -1]) if lobe.side == "transmission" else np.array([1, 1, 1])
    return [(np.array([-0.7, -0.3, 1.0]) * side, 0.05, 200.0), (np.array([0.9, 0.7, 1.0]) * side, 0.03, 300.0)]


def rms(image: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(np.mean((image - truth) ** 2)) / truth.max())


@pytest.mark.long
@pytest.mark.parametrize(
    "name, lookup", [(name, "planes") for name in ("brushed", "ggx", "transmission", "retro")] + [("satin", "distance")]
)
def test_small_lamps_are_those_of_the_cube_map(device, name: str, lookup: str) -> None:
    """At three samples; the same samples of the cube map with its lamps miss by far more."""
    lobe = LOBES[name]
    cube, texels = lit(*lamps_of(lobe)), normalize(face_directions(128))
    distance = np.linalg.norm(box_hit(np.zeros(3), texels), axis=-1)
    scene = wall_scene(material((lobe,)), cube, planes=box_planes(LOW, HIGH), distance=distance)
    camera = Camera(name="c", position=(0.6, 0.4, 1.5), target=(0.3, 0.1, 0.0), fov_y_deg=40.0)
    renderer, state = Renderer(device, scene), replace(STATE, camera=camera, lookup=lookup)
    truth = renderer.converged(replace(state, n=64), 32768)
    error = rms(renderer.image(state), truth)
    assert error < (0.03 if lobe.distribution == "ggx" else 0.02)
    assert rms(renderer.image(replace(state, integrator="rings")), truth) > 4 * error


@pytest.mark.long
def test_a_long_window_by_its_covariance(device) -> None:
    """A lobe of m = .4 under a tube 1.1 rad long; as a round lamp of the same radius it would be far off."""
    n = 64
    cube = np.full((6, n, n, 3), 0.05, np.float32)
    cube[4, 30:33, 10:54] = 60.0
    renderer = Renderer(device, unbaked_scene({"ball": sphere(0.6)}, material((LOBES["rough"],)), cube))
    state = replace(STATE, camera=BALL, width=24, height=24)
    assert rms(renderer.image(state), renderer.converged(replace(state, n=64), 16384)) < 0.02


@pytest.mark.parametrize("level", [0.0, 1.0])
def test_without_lamps_the_picture_is_that_of_rings(device, level: float) -> None:
    renderer = Renderer(device, wall_scene(material((LOBES["rough"],)), np.full((6, 8, 8, 3), level)))
    lamps, rings = (renderer.image(replace(STATE, integrator=name)) for name in ("lamps", "rings"))
    np.testing.assert_array_equal(lamps, rings)
    smooth = Renderer(device, wall_scene(material((LOBES["rough"],)), cube_of(smooth_light)))
    np.testing.assert_array_equal(smooth.image(STATE), smooth.image(replace(STATE, integrator="rings")))


@pytest.mark.long
def test_a_quarter_of_the_sky(device) -> None:
    """As large as a lamp can be: cut in pieces, or left in the cube map."""
    cube = lit((np.ones(3), 1.04, 1.0), rest=0.02)
    renderer = Renderer(device, unbaked_scene({"ball": sphere(0.6)}, material((LOBES["rough"],)), cube))
    state = replace(STATE, camera=BALL, width=24, height=24, n=7)
    assert np.sqrt(np.mean((renderer.image(state) - renderer.converged(replace(state, n=64), 16384)) ** 2)) < 0.03


@pytest.mark.long
def test_nothing_pops_while_a_roughness_is_dragged(device) -> None:
    """Steps of 2 % in m: none changes the picture by much more than its neighbours do."""
    lamps = [((0.5, 0.5, 0.9), 0.05, 100.0), ((-0.6, 0.3, 0.8), 0.13, 30.0)]
    renderer = Renderer(device, unbaked_scene({"ball": sphere(0.6)}, material((LOBES["satin"],)), lit(*lamps)))
    state = replace(STATE, camera=BALL, width=32, height=32, n=3)
    radii = renderer.resources.objects[0].light.lamps.radii

    def shown(m: float) -> np.ndarray:
        lobe = Lobe(mx=m, my=m, r0=0.8, alpha=0.4)
        return np.clip(renderer.image(replace(state, materials={"m": material((lobe,))})), 0, 4) ** (1 / 2.2)

    steps = 0.0155 * 1.02 ** np.arange(80)
    out = [groups_out(Lobe(mx=m, my=m), radii) for m in steps]
    assert out[0] == 0 and out[-1] == 2
    images = [shown(m) for m in steps]
    change = np.array([np.abs(b - a).mean() for a, b in itertools.pairwise(images)])
    usual = np.array([np.median(change[max(i - 6, 0) : i + 7]) for i in range(len(change))])
    whole = np.abs(shown(0.062 * radii[0] / 0.1) - images[0]).mean()
    assert (change < 4 * usual + 0.02 * whole).all()


def test_numpy_and_the_shader_take_out_as_many_groups() -> None:
    radii = np.array([0.02, 0.09, 0.3, 1e9])
    m = np.geomspace(0.005, 0.4, 200)
    source = assemble("lamps.wgsl", given={"look_up.wgsl": "", "surface.wgsl": ""})
    own = source[source.index("const FIRST_OUT") : source.index("fn lamps_light")]
    wide = "fn wide(m: f32) -> LambentLobe { var lobe = LOBE; lobe.mx = m; lobe.my = 2.0 * m; return lobe; }"
    declarations = own + declared(Lobe(mx=0.1, my=0.2)) + wide
    tables = {"lamps": radii[None]}
    got = run_wgsl(assemble("lobes.wgsl"), "groups_out(wide(m))", {"m": m}, declarations=declarations, tables=tables)
    expected = [groups_out(Lobe(mx=one, my=2 * one), radii) for one in m]
    assert 0 in expected and 3 in expected
    np.testing.assert_allclose(got, expected, atol=1e-4)


@pytest.mark.long
def test_faint_highlights_need_neither_lamps_nor_many_samples(device) -> None:
    """A window on rough varnish adds little to what is lit; a lamp on it, or the window on metal, is seen."""
    rough, metal = (Lobe(mx=0.2, my=0.2, r0=r0) for r0 in (0.04, 0.9))
    window, lamp = (np.array([-0.7, -0.3, 1.0]), 0.15, 4.0), (np.array([-0.7, -0.3, 1.0]), 0.05, 200.0)
    for lobe, light, is_faint in (
        (rough, window, True), (rough, lamp, False), (metal, window, False),
    ):  # fmt: skip
        renderer = Renderer(device, wall_scene(material((lobe,)), lit(light, rest=0.5)))
        (draw,) = draws_of(replace(STATE, n=None), renderer.resources)
        assert draw.takes_lamps != is_faint
        (many,) = draws_of(replace(STATE, integrator="rings", n=None), renderer.resources)
        assert many.n == 11 and draw.n == (5 if is_faint else 3)
    assert not ProbeLamps(lit(window, rest=0.5)).are_faint(material((rough, metal)), False), "one of two lobes shows it"
    faint, exact = (
        renderer_of.image(replace(STATE, n=n, integrator=how))
        for renderer_of in [Renderer(device, wall_scene(material((rough,)), lit(window, rest=0.5)))]
        for n, how in ((None, "lamps"), (40, "rings"))
    )
    assert np.abs(faint - exact).max() < 0.1 * 0.5  # of the light around


def test_the_table_holds_places_on_the_walls() -> None:
    lobe = LOBES["satin"]
    cube = lit(*lamps_of(lobe))
    scene = wall_scene(material((lobe,)), cube, planes=box_planes(LOW, HIGH))
    probe, lamps = scene.probes["wall"], ProbeLamps(cube)
    table = lamps.table(probe, look_ups()["planes"])
    rows = table[HEAD_ROWS : HEAD_ROWS + LAMP_ROWS * len(lamps.lamps)].reshape(-1, LAMP_ROWS, 4)
    walls = np.minimum(rows[:, 0, :3] - LOW, HIGH - rows[:, 0, :3])
    np.testing.assert_allclose(walls.min(axis=1), 0, atol=0.02)
    assert (rows[:, 0, 3] == 1).all()
    far = lamps.table(probe, look_ups()["plain"])[HEAD_ROWS::LAMP_ROWS][: len(lamps.lamps)]
    np.testing.assert_allclose(np.linalg.norm(far[:, :3], axis=1), 1, rtol=1e-5)
    assert (far[:, 3] == 0).all()
