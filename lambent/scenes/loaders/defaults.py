"""What a bare geometry file lacks: daylight, a camera, an exposure."""

from __future__ import annotations

from dataclasses import replace

from lambent.core.camera import overview
from lambent.scenes.loaders.parts import Parts
from lambent.scenes.scene import Scene, SunSky

DAYLIGHT = SunSky(sun_direction=(0.4558, 0.7597, 0.4637))
EXPOSURE_EV = 2.0  # sunlit white is about .25 W/(sr m^2) in the sky model's units


def with_defaults(name: str, parts: Parts) -> Scene:
    """A scene of one geometry file; its own lights, cameras and environment stay.

    Clear daylight is added where the file does not tell how its scene is lit, or tells of nothing that shines.
    """
    shines = bool(parts.environment or parts.lights or any(any(o.emission) for o in parts.objects))
    own_light = parts.environment is not None or (parts.tells_its_light and shines)
    said = ("nothing in it gives light: it is under daylight",) if parts.tells_its_light and not own_light else ()
    scene = Scene(
        name=name,
        objects=parts.objects,
        materials=parts.materials,
        environment=parts.environment if own_light else DAYLIGHT,
        lights=parts.lights,
        cameras=parts.cameras,
        exposure_ev=0.0 if own_light else EXPOSURE_EV,
        sources=parts.sources,
        warnings=(*parts.warnings, *said),
        textures=parts.textures,
    )
    if parts.cameras:
        return scene
    return replace(scene, cameras=(overview(*scene.bounds),))
