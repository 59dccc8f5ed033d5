"""Light of smooth shading in photon maps, and of texels that light reaches in part: known by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.baking.engine import engine
from lambent.baking.photons.shooting import shoot
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.geometry.directions import normalize
from lambent.materials.document import Material
from lambent.scenes.geometry import patch
from lambent.scenes.scene import DirectionalLight, Mesh, Scene, SceneObject
from tests.baking.small_scenes import BLACK

TILT_DEG = 30.0
SCREENS = {"right": 1.0, "left": -1.0}


def tilted(mesh: Mesh, tilt_deg: float) -> Mesh:
    """A horizontal patch whose shading normals lean towards +x."""
    lean = np.radians(tilt_deg)
    return replace(mesh, normals=np.tile(np.float32([np.sin(lean), np.cos(lean), 0]), (len(mesh.positions), 1)))


def landed(
    objects: tuple[SceneObject, ...], sun: DirectionalLight, photons: int = 1 << 19, bounces: int = 4
) -> dict[str, float]:
    """Flux in W on each object's front: every object's light map is one texel of a row."""
    engine()
    scene = Scene("s", objects, {"black": BLACK, "white": Material(kd=0.8)}, lights=(sun,))
    uv2 = {o.name: np.tile([(i + 0.5) / len(objects), 0.5], (len(o.mesh.positions), 1)) for i, o in enumerate(objects)}
    flux = shoot(SceneBuilder(scene, uv2).build(), (1, 1, len(objects)), photons, bounces, 1)
    return {o.name: float(flux[0, 0, i, 1]) for i, o in enumerate(objects)}


@pytest.mark.parametrize("tilt_deg", [TILT_DEG, -TILT_DEG])
def test_irradiance_is_that_of_the_shading_normal(tilt_deg: float) -> None:
    """E = 2 cos of the angle from the shading normal to the sun, on 4 m^2; the triangle's is 30 degrees off it."""
    floor = SceneObject("floor", tilted(patch((-1, 0, 1), (2, 0, 0), (0, 0, -2)), tilt_deg), "black")
    sun = DirectionalLight((-0.5, -np.sqrt(0.75), 0.0), (2.0, 2.0, 2.0))
    wanted = 4 * 2 * np.cos(np.radians(30 - tilt_deg))
    assert landed((floor,), sun, 1 << 16)["floor"] == pytest.approx(wanted, rel=0.01)


def test_photons_are_counted_up_to_the_last_bounce() -> None:
    """Sun on the floor, none on the wall at right angles to it: one bounce lights the wall, two the floor again."""
    sun = DirectionalLight((0.0, -1.0, 0.0), (2.0, 2.0, 2.0))
    floor = SceneObject("floor", patch((-1, 0, 1), (2, 0, 0), (0, 0, -2)), "white")
    wall = SceneObject("wall", patch((-1, 0.001, 1), (0, 0, -2), (0, 2, 0)), "white")
    found = [landed((floor, wall), sun, 1 << 16, bounces) for bounces in range(3)]
    assert found[0] == {"floor": pytest.approx(8, rel=0.01), "wall": 0}
    assert found[1]["floor"] == pytest.approx(found[0]["floor"], rel=1e-6)
    assert found[1]["wall"] == pytest.approx(8 * 0.8 * 0.2, rel=0.05)
    assert found[2]["floor"] > 1.01 * found[0]["floor"]
    assert found[2]["wall"] == pytest.approx(found[1]["wall"], rel=0.02)


def test_smooth_shading_sends_light_by_the_triangles_cosine() -> None:
    """A diffuse floor has one radiance, kd/pi E of the shading normal: screens mirrored at x = 0 receive the same.

    The shading normal's cosines are .87 to the sun, 1 and 1/2 to the screens; the triangle's are 1/2, .87 and .87. A
    small screen of area a that faces the floor of area A from a distance d receives L A a sin(60)/d^2.
    """
    sun = DirectionalLight((-np.sqrt(0.75), -0.5, 0.0), (2.0, 2.0, 2.0))
    floor = SceneObject("floor", tilted(patch((-0.2, 0, 0.2), (0.4, 0, 0), (0, 0, -0.4)), TILT_DEG), "white")
    screens = []
    for name, side in SCREENS.items():
        towards = np.array([side * 0.5, np.sqrt(0.75), 0.0])
        across = np.array([0.0, 0.0, 0.8])
        up = 0.8 * normalize(np.cross(-towards, across))
        corner = 2 * towards - across / 2 - up / 2
        screens.append(SceneObject(name, patch(corner, across, up), "black"))
    found = landed((floor, *screens), sun, 1 << 21)
    radiance = 0.8 / np.pi * 2 * np.cos(np.radians(TILT_DEG))
    wanted = radiance * 0.16 * 0.64 * np.sqrt(0.75) / 4
    for name in SCREENS:
        assert found[name] == pytest.approx(wanted, rel=0.12), name
