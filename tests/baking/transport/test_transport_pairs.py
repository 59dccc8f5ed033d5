"""Transport by pairs of bands: how it is summed in parts, merged and packed; lights that are hard to count."""

from __future__ import annotations

from typing import Any

import drjit as dr
import numpy as np
import pytest

from lambent.baked.shared_exponent import ONES, unpacked_rgb
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.baking.transport import bands
from lambent.baking.transport.bands import Bands, Pairs, _merge, _threads, pair_transport
from lambent.baking.transport.visibility import visibility
from lambent.core.geometry.directions import normalize
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.of_lobes import of_material
from lambent.scenes.sky.triangle_lights import (
    TriangleLights,
    environment_triangles,
    joined,
    solid_angles,
    surface_triangles,
)
from tests.baking.transport.test_transport import BRUSHED, GLOSSY, View, ball_on_floor, environment, view
from tests.tools.pair_numbers import pair_numbers

SATIN = Material(kd=0.2, lobes=(Lobe(mx=0.3, my=0.3, r0=0.4),))


@pytest.fixture(scope="module")
def outdoors() -> View:
    return view(ball_on_floor(), environment_triangles(*environment(), 200))


def pairs_of(seen: View, material: Material, counts: tuple[int, int], least: float = 0.0, **more: Any) -> Any:
    term = of_material(material).terms[-1]
    both = [Bands(factor, count) for factor, count in zip(term.factors, counts, strict=True)]
    blocks = pair_transport(seen.points, seen.lights, seen.seen, term, both, 1 / 256, least=least, **more)
    return Pairs(*map(np.concatenate, zip(*blocks, strict=True)))


def matrix(found: Any, counts: tuple[int, int]) -> np.ndarray:
    """(P, J, K, 3)."""
    whole = np.zeros((len(found.counts), counts[0] * counts[1], 3))
    pair = pair_numbers(found.counts, found.steps)
    whole[np.repeat(np.arange(len(found.counts)), found.counts), pair] = unpacked_rgb(found.light)
    return whole.reshape(-1, *counts, 3)


@pytest.mark.long
@pytest.mark.parametrize("own", [16, 100])
def test_parts_of_the_bands_and_blocks_of_points_change_nothing(
    outdoors: View, monkeypatch: pytest.MonkeyPatch, own: int
) -> None:
    whole = pairs_of(outdoors, SATIN, (32, 16))
    monkeypatch.setattr(bands, "OWN_PAIRS", own)
    monkeypatch.setattr(bands, "PAIRS_AT_ONCE", 32 * 16 * 37)
    parts = pairs_of(outdoors, SATIN, (32, 16))
    assert np.array_equal(matrix(parts, (32, 16)), matrix(whole, (32, 16)))
    assert np.array_equal(parts.light, whole.light)
    assert np.array_equal(parts.steps, whole.steps)


@pytest.mark.long
def test_long_steps_go_over_black_entries(outdoors: View) -> None:
    """Two sharp curves leave most pairs dark."""
    found = pairs_of(outdoors, BRUSHED, (256, 128))
    black = (found.light & ONES) == 0
    assert black.any()
    assert (found.steps[black] == 255).all()
    assert (found.steps > 0).all()
    assert pair_numbers(found.counts, found.steps).max() < 256 * 128


def test_small_entries_move_along_the_second_curve_alone(outdoors: View) -> None:
    counts = (64, 16)
    exact, merged = (matrix(pairs_of(outdoors, GLOSSY, counts, least), counts) for least in (0.0, 2.0**-10))
    assert np.count_nonzero(merged.any(axis=-1)) < 0.97 * np.count_nonzero(exact.any(axis=-1))
    rows, after = exact.sum(axis=2), merged.sum(axis=2)
    assert np.allclose(after, rows, rtol=4e-3, atol=1e-3), "no light is lost but by rounding"
    fresnel = of_material(GLOSSY).curves["fresnel"].node_values(16, 2)
    shown, moved = ((m * fresnel).sum(axis=(1, 2)) for m in (exact, merged))
    lit = shown > 1e-3 * shown.max()
    assert np.sqrt(np.mean((moved - shown)[lit] ** 2)) < 1e-3 * np.sqrt(np.mean(shown[lit] ** 2))


def test_small_entries_join_the_large_one_before_them_or_the_first(mi: Any) -> None:
    """Two bands of five entries; a tenth of a band's light is large."""
    before = np.array([[0.5, 0.25, 6, 0.5, 4], [3, 0.5, 0.25, 9, 0.125]])
    after = [[0, 0, 7.25, 0, 4], [3.75, 0, 0, 9.125, 0]]
    row = dr.alloc_local(mi.Float, 30)
    for at, light in enumerate(before.ravel()):
        for channel in range(3):
            row[3 * at + channel] = mi.Float(light * (channel + 1))
    _merge(row, mi.Bool(True), 0.1, mi.UInt32(5), mi.UInt32(10))
    found = mi.TensorXf(dr.concat([row[k] for k in range(30)]), (2, 5, 3))
    assert np.allclose(found, np.multiply.outer(after, [1, 2, 3]))


@pytest.mark.parametrize("points", [1, 17, 16_384, 40_001])
def test_every_point_has_one_thread(outdoors: View, points: int) -> None:
    pixel, active = (np.array(one) for one in _threads(points))
    assert sorted(pixel[active]) == list(range(points))


def test_lights_behind_the_surface_are_traced_where_they_count(outdoors: View) -> None:
    traced, p, lights = SceneBuilder(outdoors.scene).build(), outdoors.points, outdoors.lights
    m = np.arange(len(lights))
    front = lights.centres @ p.n.T.astype(float)
    seen = (outdoors.seen[m // 32] >> (m % 32)[:, None]) & 1 == 1
    behind = np.arange(len(p)) % 2 == 0
    found = (visibility(traced, p, lights, behind)[m // 32] >> (m % 32)[:, None]) & 1 == 1
    assert np.array_equal(found[:, behind], seen[:, behind])
    sure = np.abs(front) > 1e-6
    assert np.array_equal(found[sure & ~behind], (seen & (front > 0))[sure & ~behind])
    assert (seen & (front < 0))[:, ~behind].any(), "there is something to leave out"


def far(corners: np.ndarray, radiance: float = 5.0) -> TriangleLights:
    """Triangles (M, 3, 3) of directions as lights at infinity."""
    corners = normalize(np.asarray(corners, float))
    light = np.full((len(corners), 3), radiance) * solid_angles(corners)[:, None]
    return TriangleLights(corners, normalize(corners.mean(axis=1)), light, np.zeros(len(corners), bool))


def around(direction: tuple[float, float, float], half_angle: float) -> TriangleLights:
    """A disc of 12 triangles about a direction."""
    n = normalize(np.array(direction))
    t = normalize(np.cross(n, [0.3, 0.5, 0.8]))
    angle = np.arange(13) / 12 * 2 * np.pi
    rim = n + np.tan(half_angle) * (np.cos(angle)[:, None] * t + np.sin(angle)[:, None] * np.cross(n, t))
    return far(np.stack([np.broadcast_to(n, (12, 3)), rim[:-1], rim[1:]], axis=1))


EDGE_ON = Camera("edge", (0.0, 0.02, 2.9), (0.0, 0.02, 0.0))
HARD = {
    "the sun's disc": around((0.5, 0.7, 0.4), np.radians(0.25)),
    "a lamp so far that it is a point": around((-0.2, 0.9, 0.3), 1e-4),
    "a light on the horizon": around((0.8, 0.06, -0.5), np.radians(5.0)),
    "a light at the mirror direction of the floor": around((0.0, 0.5, -1.0), np.radians(1.0)),
    "a twentieth of the sphere in one triangle": far(np.array([[[0.1, 1, 0.5], [-0.8, 0.5, 0.2], [0.1, 0.4, -0.9]]])),
}


@pytest.mark.long
@pytest.mark.parametrize("camera", [None, EDGE_ON], ids=["above", "edge-on"])
def test_hard_lights_are_the_sum_over_small_pieces(camera: Camera | None) -> None:
    """Each against brute force with 32^2 pieces, and none brings anything that is no number."""
    for what, lights in HARD.items():
        seen = view(ball_on_floor(), lights, **({} if camera is None else {"camera": camera}))
        editable = of_material(SATIN)
        found, expected = seen.picture(editable, 128, 16), seen.brute_force(editable, 32, (128, 16))
        assert np.isfinite(found).all(), what
        assert expected.max() > 0, what
        tolerance = 1e-2 if len(lights) == 1 else 2e-3  # two angles over a large triangle are taken as independent
        assert np.abs(found - expected).mean() < tolerance * expected.mean(), what


def test_a_lamp_that_touches_the_floor_gives_no_more_than_its_radiance() -> None:
    rectangle = np.array([[-0.5, 0, -0.8], [0.5, 0, -0.8], [0.5, 0.6, -0.8], [-0.5, 0.6, -0.8]])
    upright = rectangle[[[0, 1, 2], [0, 2, 3]]]
    lights = joined([surface_triangles(upright, np.full((2, 3), 3.0), 0.1), around((0.1, 1.0, 0.1), 0.01)])
    found = view(ball_on_floor(), lights).picture(of_material(Material(kd=1.0)), 64)
    assert np.isfinite(found).all()
    assert 0 < found.max() <= 3.0 + 5.0
