"""Transport of a view: light by bands, against brute force, known scenes and the path tracer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import Any

import numpy as np
import pytest

from lambent.baked.shared_exponent import unpacked_rgb
from lambent.baking.engine import engine
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.baking.transport.bands import Bands, Pairs, pair_transport, transport
from lambent.baking.transport.view import View as BakedView
from lambent.baking.transport.view_points import ViewPoints, view_points
from lambent.baking.transport.view_tracer import ViewTracer
from lambent.baking.transport.visibility import visibility
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.latlong import lat_long_directions
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.curve import END_RAD, Curve
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.parametrisations import angle_of
from lambent.materials.factored.terms import Editable
from lambent.materials.lobes import NUMPY
from lambent.scenes.geometry import patch, placed, sphere
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import Scene, SceneObject
from lambent.scenes.sky.triangle_lights import TriangleLights, environment_triangles, solid_angles, surface_triangles
from tests.baking.small_scenes import GREY
from tests.tools.pair_numbers import pair_numbers

SIZE = 10
CAMERA = Camera("front", (0.0, 1.6, 2.4), (0.0, 0.35, 0.0))
GLOSSY = Material(kd=(0.4, 0.3, 0.2), lobes=(Lobe(mx=0.15, my=0.15, r0=0.5, k=(0.6, 0.5, 0.4)),))
BRUSHED = Material(lobes=(Lobe(mx=0.1, my=0.3, r0=0.5),))
GROUND = SceneObject("floor", patch((-3, 0, 3), (6, 0, 0), (0, 0, -6)), "grey")
FLOOR = Scene("floor", (GROUND,), {"grey": GREY})


def environment(height: int = 96) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions, solid angles and radiance of a sky with a soft sun over a dim ground."""
    w = lat_long_directions(height, 2 * height).reshape(-1, 3)
    weight = np.repeat(-np.diff(np.cos(np.linspace(0, np.pi, height + 1))), 2 * height) * np.pi / height
    sun = normalize(np.array([0.5, 0.7, 0.4]))
    sky = (
        np.where(w[:, 1:2] > 0, [0.5, 0.7, 1.0], [0.1, 0.08, 0.05])
        + 30 * np.clip((w @ sun - 0.95) / 0.05, 0, 1)[:, None]
    )
    return w, weight, sky


def ball_on_floor(material: Material = GLOSSY) -> Scene:
    ball = SceneObject("ball", placed(sphere(0.5, 48, 24), (0, 0.55, 0)), "glossy")
    return Scene("ball", (GROUND, ball), {"grey": GREY, "glossy": material})


@dataclass
class View:
    """A small view of a scene with its points, lights and what is seen of them."""

    scene: Scene
    lights: TriangleLights
    points: ViewPoints
    seen: np.ndarray

    def picture(self, editable: Editable, *counts: int) -> np.ndarray:
        """(P, 3) direct light by bands of a material."""
        total = np.zeros((len(self.points), 3))
        for term in editable.terms:
            bands = [Bands(f, c) for f, c in zip(term.factors, counts, strict=False)]
            means = [editable.curves[b.factor.curve].node_values(b.count, b.factor.polar) for b in bands]
            if len(bands) == 1:
                rows = transport(self.points, self.lights, self.seen, term, bands[0])
                total += np.einsum("jc,jcp->pc", means[0], rows) * term.scale
                continue
            blocks = pair_transport(self.points, self.lights, self.seen, term, bands, 1 / 256)
            found = Pairs(*map(np.concatenate, zip(*blocks, strict=True)))
            j, k = np.divmod(pair_numbers(found.counts, found.steps), counts[1])
            share = unpacked_rgb(found.light) / 256 * means[0][j] * means[1][k]
            np.add.at(total, np.repeat(np.arange(len(total)), found.counts), share * term.scale)
        return total

    def brute_force(self, editable: Editable, cuts: int, counts: tuple[int, ...] = ()) -> np.ndarray:
        """(P, 3) direct light by the same triangles, each as cuts^2 small ones that shine alike, numpy alone.

        Curves are smooth, or straight lines between `counts` nodes.
        """
        total = np.zeros((len(self.points), 3))
        p = self.points
        visible = (self.seen[np.arange(len(self.lights)) // 32] >> (np.arange(len(self.lights)) % 32)[:, None]) & 1
        frame = np.stack([p.t, p.b, p.n], axis=1).astype(float)
        for m, corners in enumerate(self.lights.corners):
            wi_centre = normalize(frame @ self.lights.centres[m])
            parts = normalize(_small(corners, cuts))
            wi = np.einsum("pij,sj->spi", frame, parts)
            for term in editable.terms:
                quotient = np.asarray(term.quotient.evaluate(tuple(wi_centre.T), tuple(p.wo.T.astype(float)), NUMPY))
                light = self.lights.light[m] * (quotient * np.maximum(wi_centre[:, 2], 0) * visible[m])[:, None]
                value = np.ones((len(parts), len(p), 3))
                for factor, count in zip_longest(term.factors, counts[: len(term.factors)]):
                    curve, angle = editable.curves[factor.curve], _angle(factor, wi, p.wo)
                    value = value * (curve.at(angle) if count is None else _lines(curve, count, angle, factor.polar))
                total += light * value.mean(axis=0) * term.scale
        return total


def _lines(curve: Curve, count: int, angle: np.ndarray, polar: int) -> np.ndarray:
    return Curve.through((np.arange(count) + 0.5) * END_RAD / count, curve.node_values(count, polar)).at(angle)


def _angle(factor: Any, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    wo = np.broadcast_to(wo, wi.shape).astype(float)
    components = [tuple(np.moveaxis(w, -1, 0)) for w in (wi, wo)]
    return angle_of(factor.over, *components, factor.stretch)


def _small(corners: np.ndarray, cuts: int) -> np.ndarray:
    """Centres of the pieces of a triangle, on its plane."""
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).max()
    return surface_triangles(corners[None], np.ones((1, 3)), longest / cuts * 1.0001).centres


def view(scene: Scene, lights: TriangleLights, size: tuple[int, int] = (SIZE, SIZE), camera: Camera = CAMERA) -> View:
    engine()
    builder = SceneBuilder(scene)
    traced = builder.build()
    points = view_points(builder, traced, camera, *size)
    return View(scene, lights, points, visibility(traced, points, lights))


@pytest.fixture(scope="module")
def outdoors() -> View:
    return view(ball_on_floor(), environment_triangles(*environment(), 400))


@pytest.mark.long
@pytest.mark.parametrize(("material", "counts"), [(GLOSSY, (256, 64)), (BRUSHED, (128, 64))])
def test_bands_are_the_sum_over_the_triangles(outdoors: View, material: Material, counts: tuple[int, int]) -> None:
    """Within 1e-3 where the curve is made of steps, too; the steps themselves cost a little more."""
    editable = of_material(material)
    found = outdoors.picture(editable, *counts)
    for steps, tolerance in ((counts, 1e-3), ((), 2e-3)):
        if material is BRUSHED and not steps:
            continue  # two sharp curves need finer steps
        expected = outdoors.brute_force(editable, 8, steps)
        assert np.abs(found - expected).mean() < tolerance * expected.mean()
        assert np.abs(found - expected).max() < 0.02 * expected.max()


def test_a_curve_shows_in_its_band_alone(outdoors: View) -> None:
    """Light of a diffuse surface between 22.5 and 45 degrees, counted by hand at a point of the floor."""
    editable = of_material(Material(kd=1.0))
    window = Curve.of(lambda x: ((x > np.pi / 8) & (x <= np.pi / 4)).astype(float))
    found = outdoors.picture(editable.with_curve("diffuse", window), 64)
    free = np.flatnonzero((outdoors.points.object == 0) & (np.linalg.norm(outdoors.points.p, axis=1) > 2.0))[0]
    w, weight, radiance = environment(192)
    inside = (w[:, 1] < np.cos(np.pi / 8)) & (w[:, 1] >= np.cos(np.pi / 4))
    expected = (radiance * (weight * w[:, 1] * inside)[:, None]).sum(axis=0) / np.pi
    assert np.allclose(found[free], expected, rtol=0.03)


def test_lamps_light_as_their_solid_angle_says() -> None:
    """A square lamp of radiance 7 over the floor: irradiance by quadrature, radiance kd / pi of it; none behind it."""
    square = np.array([[-0.5, 2, -0.5], [0.5, 2, -0.5], [0.5, 2, 0.5], [-0.5, 2, 0.5]])
    downwards = square[[[0, 1, 2], [0, 2, 3]]]
    lit = view(FLOOR, surface_triangles(downwards, np.full((2, 3), 7.0), 0.12))
    dark = view(FLOOR, surface_triangles(downwards[:, ::-1], np.full((2, 3), 7.0), 0.12))
    editable = of_material(Material(kd=0.5))
    found = lit.picture(editable, 32)
    p = lit.points.p.astype(float)
    g = (np.arange(60) + 0.5) / 60 - 0.5
    lamp = np.stack(np.meshgrid(g, [2.0], g, indexing="ij"), axis=-1).reshape(-1, 3)
    to = lamp - p[:, None]
    cosines = to[..., 1] ** 2 / (to**2).sum(axis=-1)
    expected = 0.5 / np.pi * 7 * (cosines / (to**2).sum(axis=-1)).mean(axis=1)
    assert np.allclose(found, expected[:, None], rtol=5e-3)
    assert not dark.picture(editable, 32).any()


def test_light_through_a_sheet_comes_from_behind_it() -> None:
    w, weight, _ = environment()
    below = environment_triangles(w, weight, np.where(w[:, 1:2] < 0, [1.0, 2.0, 3.0], 0.0), 300)
    found = view(FLOOR, below).picture(of_material(Material(kt_d=0.8)), 64)
    assert np.allclose(found, 0.8 * np.array([1, 2, 3]), rtol=0.01)
    assert not view(FLOOR, below).picture(of_material(Material(kd=0.8)), 64).max() > 0.01


def test_solid_angles_of_small_triangles_do_not_cancel() -> None:
    corners = normalize(np.array([[1, 0, 0], [1, 1e-4, 0], [1, 0, 1e-4]], float))
    assert solid_angles(corners) == pytest.approx(0.5e-8, rel=1e-6)


@pytest.mark.long
def test_retro_lobes_see_the_light_turned_about_the_normal() -> None:
    """On a free floor a retro lobe shows what the same lobe about the mirror direction shows under turned light."""
    lights = environment_triangles(*environment(), 200)
    half_turn = np.array([-1.0, 1.0, -1.0])
    turned = replace(lights, corners=lights.corners * half_turn, centres=lights.centres * half_turn)
    lobe = Lobe(mx=0.15, my=0.15, r0=0.5)
    about_light = of_material(Material(lobes=(lobe.model_copy(update={"retro": True}),)))
    about_mirror = of_material(Material(lobes=(lobe,)))
    found = view(FLOOR, lights).picture(about_light, 128, 32)
    assert np.allclose(found, view(FLOOR, turned).picture(about_mirror, 128, 32), rtol=1e-3, atol=1e-5)
    assert not np.allclose(found, view(FLOOR, lights).picture(about_mirror, 128, 32), rtol=0.1)


@pytest.mark.long
def test_no_pixel_looks_through_a_surface() -> None:
    """Where the pixels to the left and to the right show one place of the teapot, so does the one between them."""
    engine()
    scene = load_scene("builtin:teatray")
    points = ViewTracer(scene).points(BakedView(scene.cameras[0], 512, 512))
    place = np.full((512 * 512, 3), np.nan)
    teapot = np.array([o.material == "glaze" for o in scene.objects])[points.object]
    place[points.pixel[teapot]] = points.p[teapot]
    left, middle, right = (place.reshape(512, 512, 3)[:, k : 510 + k] for k in range(3))
    near = np.linalg.norm(left - right, axis=-1) < 0.004
    assert np.count_nonzero(near) > 10_000
    assert np.linalg.norm(middle - (left + right) / 2, axis=-1)[near].max() < 0.02


def test_small_lamps_keep_their_light() -> None:
    """A lamp of a tenth of a millimetre in 200 pieces lights like a point of radiance times area times cosine."""
    edge_m = 1e-4
    halves = np.array([[[0, 0, 0], [1, 0, 0], [1, 0, 1]], [[0, 0, 0], [1, 0, 1], [0, 0, 1]]])
    corners = edge_m * halves + [0.0, 2.0, 0.0]
    lit = view(FLOOR, surface_triangles(corners, np.full((2, 3), 7.0), edge_m * np.sqrt(2) / 10 * 1.01))
    found = lit.picture(of_material(Material(kd=0.5)), 32)
    to = np.array([0.0, 2.0, 0.0]) - lit.points.p.astype(float)
    square = (to**2).sum(axis=1)
    assert np.allclose(found, (0.5 / np.pi * 7 * edge_m**2 * to[:, 1] ** 2 / square**2)[:, None], rtol=2e-3)
