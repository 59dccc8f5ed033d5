"""The sun through clear glass: what shadow rays bring is what paths and photons leave out, pane by pane."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from lambent.baking.photons.shooting import shoot
from lambent.baking.sky.sun import sun_of
from lambent.baking.tracing.lights.sun import Sun, SunRays
from lambent.baking.tracing.rays import array_of, vectors
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.arrays import Floats
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import box, patch, placed, sphere
from lambent.scenes.scene import DirectionalLight, MaterialTextures, Mesh, Scene, SceneObject, Texture
from tests.baking.sky.test_sun import TOWARDS, disc, environment_file
from tests.baking.small_scenes import BLACK, GREY
from tests.baking.tracing.facing_up import facing_up, irradiance

pytestmark = pytest.mark.usefixtures("mi")
IRRADIANCE = np.array([3.0, 2.0, 1.0])


def glass(*k: float, m: float = 0.003, **terms: object) -> Material:
    """Passes k of the light at normal incidence, and nearly that at all others; mirrors 8 %."""
    through = Lobe(side="transmission", mx=m, my=m, r0=0.0, k=k, alpha=0.5)
    return Material(lobes=(through, Lobe(mx=0.003, my=0.003, r0=0.08)), **terms)


MATERIALS = {
    "grey": GREY, "black": BLACK, "clear": glass(0.8, 0.8, 0.8), "red": glass(0.9, 0.3, 0.0),
    "frosted": glass(0.8, 0.8, 0.8, m=0.07), "sheer": glass(0.5, 0.5, 0.5, kt_d=0.2),
}  # fmt: skip


def passing(cosine: float) -> float:
    """Share of k that a flat pane passes."""
    return float(1 - (1 - abs(cosine)) ** 5)


def pane(height: float, half: float = 0.5) -> Mesh:
    return patch((-half, height, half), (2 * half, 0, 0), (0, 0, -2 * half))


def ceiling() -> tuple[SceneObject, ...]:
    """At a height of 1 m, with an opening of 1 m about x = z = 0."""
    sides = [((-3, 3), (0.5, 3)), ((-3, 3), (-3, -0.5)), ((-3, -0.5), (-0.5, 0.5)), ((0.5, 3), (-0.5, 0.5))]
    parts = (patch((x[0], 1, z[1]), (x[1] - x[0], 0, 0), (0, 0, z[0] - z[1])) for x, z in sides)
    return tuple(SceneObject(f"ceiling_{i}", mesh, "grey") for i, mesh in enumerate(parts))


FLOOR = SceneObject("floor", patch((-3, 0, 3), (6, 0, 0), (0, 0, -6)), "grey")
GLAZINGS = {
    "pane": (SceneObject("pane", pane(1.0), "clear"),),
    "two": (SceneObject("upper", pane(1.0), "clear"), SceneObject("lower", pane(0.9, 1.2), "red")),
    "slab": (SceneObject("slab", placed(box((1.1, 0.02, 1.1)), (0, 1.02, 0)), "clear"),),
    "bowl": (SceneObject("bowl", placed(sphere(0.6, 48, 24), (0, 1.1, 0)), "clear"),),
    "frosted": (SceneObject("pane", pane(1.0), "frosted"),),
    "sheer": (SceneObject("pane", pane(1.0), "sheer"),),
}


def room(glazing: str, **light: object) -> Scene:
    return Scene("room", (FLOOR, *ceiling(), *GLAZINGS[glazing]), MATERIALS, **light)


def sunlit(scene: Scene, points: Floats) -> tuple[Sun, Floats]:
    """The scene's sun, and its irradiance (n, 3) by shadow rays on points of the floor."""
    found = sun_of(scene)
    assert found is not None
    sun, whole = Sun(found), SceneBuilder(scene).build()
    up = mi.Vector3f(0.0, 1.0, 0.0) + dr.zeros(mi.Vector3f, len(points))
    return sun, array_of(SunRays(sun, whole).on(vectors(mi.Point3f, points), up, up, mi.Bool(True))).astype(float)


def under(at: tuple[float, float], height: float = 1.0) -> Floats:
    """(1, 3) point of the floor that sees the sun through the point (x, z) of the opening."""
    step = TOWARDS / TOWARDS[1] * height
    return np.array([[at[0] - step[0], 0.0, at[1] - step[2]]])


def test_shadow_rays_pass_panes_by_what_each_lets_through() -> None:
    light = DirectionalLight(tuple(-TOWARDS), tuple(IRRADIANCE))
    once, full = passing(TOWARDS[1]), IRRADIANCE * TOWARDS[1]
    expected = {
        "pane": 0.8 * once, "two": 0.8 * once**2 * np.array([0.9, 0.3, 0.0]), "slab": (0.8 * once) ** 2,
        "frosted": 0.0, "sheer": 0.0,
    }  # fmt: skip
    for glazing, share in expected.items():
        found = sunlit(room(glazing, lights=(light,)), under((0.1, 0.1)))[1]
        assert np.allclose(found, full * share, rtol=1e-4), glazing
    assert not sunlit(room("pane", lights=(light,)), under((0.9, 0.9)))[1].any(), "beside the opening"


def test_textures_tint_what_passes_and_may_forbid_it() -> None:
    light = DirectionalLight(tuple(-TOWARDS), tuple(IRRADIANCE))
    tint = Texture(np.full((2, 2, 3), (0.5, 1.0, 0.25), np.float16))
    rough = Texture(np.full((2, 2, 1), 40.0, np.float16))
    plain = room("pane", lights=(light,))
    whole = sunlit(plain, under((0.1, 0.1)))[1]
    painted = replace(plain, textures={"clear": MaterialTextures(specular=tint)})
    assert np.allclose(sunlit(painted, under((0.1, 0.1)))[1], whole * (0.5, 1.0, 0.25), rtol=1e-3)
    spread = replace(plain, textures={"clear": MaterialTextures(roughness=rough)})
    assert sun_of(spread).record.panes == () and not sunlit(spread, under((0.1, 0.1)))[1].any()


@pytest.mark.long
@pytest.mark.parametrize("glazing", ["two", "bowl", "frosted"])
def test_paths_leave_out_what_shadow_rays_bring(tmp_path: Path, glazing: str) -> None:
    scene = room(glazing, environment=environment_file(tmp_path, disc(TOWARDS, 3.0, 300.0)))
    rng, count = np.random.default_rng(1), 1 << 18
    p = np.column_stack([rng.uniform(-1.5, 1.0, count), np.zeros(count), rng.uniform(-1, 1.5, count)])
    points, whole = facing_up(p), SceneBuilder(scene).build()
    sun, direct = sunlit(scene, p)
    rest = np.mean([irradiance(whole, points, seed, 6, sun) for seed in range(2)], axis=0)
    former = np.mean([irradiance(whole, points, 10 + seed, 6) for seed in range(2)], axis=0)
    error = np.sqrt(((rest + direct).var(axis=0) + former.var(axis=0)) / count)
    assert (direct.mean(axis=0)[0] > 8 * error[0]) == (glazing != "frosted")
    assert np.all(np.abs((rest + direct).mean(axis=0) - former.mean(axis=0)) < 4 * error)
    if glazing != "frosted":
        assert rest.var() < 0.2 * former.var(), "caustics are gone"


def test_photons_leave_out_the_same_light() -> None:
    light = DirectionalLight(tuple(-TOWARDS), tuple(IRRADIANCE))
    scene = replace(room("two", lights=(light,)), materials=MATERIALS | {"grey": BLACK})
    uv2 = {o.name: np.full((len(o.mesh.positions), 2), 0.25 if o is FLOOR else 0.75) for o in scene.objects}
    whole = SceneBuilder(scene, uv2).build()
    rng, count = np.random.default_rng(0), 1 << 17
    p = np.column_stack([rng.uniform(-3, 3, count), np.zeros(count), rng.uniform(-3, 3, count)])
    sun, direct = sunlit(scene, p)
    flux = np.array([
        [shoot(whole, (1, 2, 2), 1 << 17, 6, 2 * seed + k, None, unseen)[0, 0, 0] for seed in range(4)]
        for k, unseen in enumerate((None, sun))
    ])  # fmt: skip
    error = np.sqrt(flux[0].var(axis=0, ddof=1) / 4 + direct.var(axis=0) / count * 36**2)
    expected = direct.mean(axis=0) * 36
    assert np.all(np.abs(flux[0].mean(axis=0) - expected) < 5 * error + 0.002 * expected)
    assert flux[1].mean(axis=0)[0] < 0.03 * expected[0], "only what panes mirror to and fro is left"
