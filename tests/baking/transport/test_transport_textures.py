"""Textures in the transport of a view: roughness and normals at each point, holes; by hand and by the path tracer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from lambent.baking.reference.path_traced import render_reference
from lambent.baking.transport.view import View
from lambent.baking.transport.view_tracer import ViewTracer
from lambent.baking.transport.visibility import visibility
from lambent.core.geometry.directions import normalize
from lambent.core.views.camera import Camera
from lambent.materials.bsdf import MaterialBSDF, components
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.parametrisations import angle_of
from lambent.materials.factored.terms import narrowed, thinned
from lambent.materials.lobes import NUMPY
from lambent.scenes.geometry import patch
from lambent.scenes.scene import ConstantEnvironment, ImageEnvironment, MaterialTextures, Scene, SceneObject, Texture
from tests.baking.artefacts.test_relighting_view import sky
from tests.baking.transport.test_transport_converges import CAMERA, SIZE, direct_light, scene
from tests.tools.z_test import assert_same_image

GLOSSY = Material(kd=(0.1, 0.1, 0.1), lobes=(Lobe(mx=0.2, my=0.2, r0=0.5, alpha=0.3),))
DULL = Material(kd=(0.6, 0.5, 0.4))


def halves(left: float, right: float) -> Texture:
    """One value on the right half of every metre, which the camera sees on its left, and another on the left half."""
    texels = np.full((2, 64, 1), left, np.float16)
    texels[:, 32:] = right
    return Texture(texels)


@pytest.mark.parametrize("lobe", [
    Lobe(mx=0.2, my=0.2, r0=0.5, alpha=0.4),
    Lobe(mx=0.3, my=0.3, r0=0.1, distribution="ggx"),
    Lobe(mx=0.1, my=0.4, r0=0.3),
    Lobe(mx=0.4, my=0.2, r0=0.3, distribution="ggx"),
    Lobe(mx=0.2, my=0.2, r0=0.5, retro=True),
    Lobe(mx=0.3, my=0.3, r0=0.5, side="transmission"),
], ids=["beckmann", "ggx", "two curves", "stretched", "retro", "through"])  # fmt: skip
@pytest.mark.parametrize("roughness", [0.4, 1.8])
def test_one_curve_has_the_lobes_of_every_roughness(lobe: Lobe, roughness: float) -> None:
    """Curves of m, looked up at narrowed angles and thinned, are the lobe of roughness times m."""
    wi, wo = normalize(np.random.default_rng(3).normal(size=(2, 4000, 3)))
    wi[:, 2], wo[:, 2] = np.abs(wi[:, 2]) + 0.05, np.abs(wo[:, 2]) + 0.05
    wi, wo = normalize(wi), normalize(wo)
    editable, pair = of_material(Material(lobes=(lobe,))), (components(wi), components(wo))
    found = np.zeros((len(wi), 3))
    for term in editable.terms:
        value = np.asarray(term.scale) * np.asarray(term.quotient.evaluate(*pair, NUMPY))[:, None]
        value = value * thinned(term, *pair, roughness, NUMPY)[:, None]
        for factor in term.factors:
            angle = narrowed(factor.over, angle_of(factor.over, *pair, factor.stretch), roughness, NUMPY)
            value = value * editable.curves[factor.curve].at(angle)
        found += value
    lit = wi * {"reflection": [1, 1, 1], "transmission": [1, 1, -1], "retro": [-1, -1, 1]}[lobe.kind]
    rough = lobe.model_copy(update={"mx": lobe.mx * roughness, "my": lobe.my * roughness})
    expected = MaterialBSDF(Material(lobes=(rough,))).eval(lit, wo)
    assert expected.max() > 0.1
    assert np.allclose(found, expected, rtol=2e-3, atol=2e-4 * expected.max())


@pytest.mark.long
def test_roughness_varies_over_a_floor_as_path_traced(tmp_path: Path) -> None:
    """Half of the mean roughness on one side, one and a half on the other; the mean alone is far off."""
    textured = scene(GLOSSY, ImageEnvironment(sky(tmp_path, "sky.exr", 1)))
    textured = replace(textured, textures={"it": MaterialTextures(roughness=halves(1.5, 0.5))})
    found, mean = direct_light(textured, 1000), direct_light(replace(textured, textures={}), 1000)
    expected, variance = render_reference(textured, CAMERA, SIZE, SIZE, 512, max_depth=1)
    assert_same_image(found, (0.02 * found) ** 2, expected, variance)
    sides = (slice(0, SIZE // 3), slice(-(SIZE // 3), None))
    assert all(np.abs(found[:, side] / mean[:, side] - 1).mean() > 0.01 for side in sides)


@pytest.mark.long
def test_bent_normals_are_lit_from_one_side_of_the_sheet() -> None:
    """A normal map of 45 degrees under even light: light from beyond the sheet does not count, as in the path tracer.

    By hand: the cosine about n' over the half-space of the sheet is pi (1 + cos 45) / 2.
    """
    tilted = np.broadcast_to(np.sqrt([0.5, 0.0, 0.5]).astype(np.float16), (2, 2, 3))
    even = scene(DULL, ConstantEnvironment((1.0, 1.0, 1.0)))
    bent = replace(even, objects=even.objects[:1], textures={"it": MaterialTextures(normal=Texture(tilted))})
    found = direct_light(bent, 4000)
    assert np.allclose(found, np.array(DULL.kd) * (1 + np.sqrt(0.5)) / 2, rtol=0.01)


@pytest.mark.long
def test_holes_show_and_light_what_lies_behind(mi: ModuleType) -> None:
    """A sheet half of which is cut away, over a black floor: its points are on one side, its shadow is half."""
    sheet = SceneObject("sheet", patch((-1, 1, 1), (2, 0, 0), (0, 0, -2)), "leaf")
    floor = SceneObject("floor", patch((-9, 0, 9), (18, 0, 0), (0, 0, -18)), "dull")
    texels = np.zeros((2, 64, 1), np.float16)
    texels[:, 32:] = 1
    cut = {"leaf": MaterialTextures(opacity=Texture(texels, ((0.5, 0.0, 0.0), (0.0, 0.5, 0.0))))}
    around = ConstantEnvironment((1.0, 1.0, 1.0))
    holed = Scene("holed", (sheet, floor), {"leaf": DULL, "dull": DULL}, around, textures=cut)
    tracer, view = ViewTracer(holed), View(Camera("top", (0, 4, 0), (0, 0, 0), up=(0, 0, -1), fov_y_deg=20.0), 8, 8)
    points = tracer.points(view)
    x = points.p[:, 0]
    assert (points.object[x > 0.05] == 0).all() and (points.object[x < -0.05] == 1).all()
    lights = tracer.lights(400)
    seen = visibility(tracer.scene, points, lights)
    below = (points.object == 1) & (np.abs(x + 0.35) < 0.2) & (np.abs(points.p[:, 2]) < 0.3)
    towards = normalize(np.array([-0.5, 1.0, 0.0]))  # through the hole, from the floor below it
    away = normalize(np.array([0.8, 1.0, 0.0]))  # onto the leaf
    for direction, expected in ((towards, True), (away, False)):
        m = int(np.argmax(lights.centres @ direction))
        assert (((seen[m // 32, below] >> (m % 32)) & 1) == expected).all()
