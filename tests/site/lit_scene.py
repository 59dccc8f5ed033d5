"""A store whose light has groups of every kind: a sun, a sky, an object that emits, and a spot that pixels draw."""

from __future__ import annotations

from pathlib import Path

from lambent.baking.bake import bake
from lambent.core.light.light_mix import GroupMix, LightMix
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import box, patch, placed, sphere
from lambent.scenes.scene import PointLight, Scene, SceneObject, SunSky
from lambent.store.kept.session import FILE, RoomState, WalkSession, write_session
from tests.baking.small_scenes import TINY

GLOSSY = Material(kd=0.2, lobes=(Lobe(mx=0.2, my=0.2, r0=0.3),))
CAMERAS = (
    Camera("in", (0.9, 1.3, 2.4), (-0.2, 0.6, -0.3), fov_y_deg=60),
    Camera("low", (-1.4, 0.5, 1.2), (0.3, 0.6, -0.6), fov_y_deg=70),
)
EVENING = LightMix({"lüstre": GroupMix(intensity=1.5, temperature_k=2700.0), "sky": GroupMix(intensity=0.25)})


def lit_scene() -> Scene:
    """A corner without a ceiling, with a glossy floor and ball."""
    objects = (
        SceneObject("floor", patch((-2, 0, 2), (4, 0, 0), (0, 0, -4)), "glossy"),
        SceneObject("back", patch((-2, 0, -2), (4, 0, 0), (0, 2, 0)), "white"),
        SceneObject("left", patch((-2, 0, 2), (0, 0, -4), (0, 2, 0)), "white"),
        SceneObject("ball", placed(sphere(0.4, 24, 12), (0.2, 0.4, 0.2)), "glossy"),
        SceneObject("block", placed(box((0.6, 0.6, 0.6)), (-1.0, 0.3, -0.8)), "white"),
        SceneObject("lüstre", patch((0.5, 1.8, -1.9), (0.8, 0, 0), (0, 0, 0.4)), "black", emission=(60, 50, 30)),
    )
    materials = {"glossy": GLOSSY, "white": Material(kd=0.6), "black": Material()}
    spot = PointLight((-1.2, 1.7, 1.0), (300.0, 200.0, 100.0), (0.48, -0.8, -0.36), 20.0, 45.0, name="spot")
    sky = SunSky(sun_direction=(0.48, 0.64, 0.6))
    return Scene("corner", objects, materials, cameras=CAMERAS, lights=(spot,), environment=sky)


def bake_lit_store(folder: Path) -> Path:
    """Bake it, with two states: its walls red, and the evening."""
    quality = TINY.changed("tiny", environment={"texels": 32}, probe={"texels": 32, "samples": 64})
    bake(lit_scene(), folder, quality=quality, light_groups="scene").close()
    red = Material(name="white", kd=(0.7, 0.1, 0.1))
    states = {"red": RoomState(materials={"white": red}), "evening": RoomState(light=EVENING)}
    write_session(folder / FILE, WalkSession(states=states))
    return folder
