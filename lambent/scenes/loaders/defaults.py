"""What a bare geometry file lacks: daylight, a camera, an exposure."""

from __future__ import annotations

from lambent.core.camera import overview
from lambent.scenes.loaders.contents import Contents
from lambent.scenes.scene import Scene, SunSky, bounds_of

DAYLIGHT = SunSky(sun_direction=(0.4558, 0.7597, 0.4637))
EXPOSURE_EV = 2.0  # sunlit white is about .25 W/(sr m^2) in the sky model's units


def with_defaults(name: str, contents: Contents) -> Scene:
    """A scene of one geometry file; its own lights, cameras and environment stay.

    Clear daylight is added if the file does not tell how its scene is lit, or if nothing in it emits light.
    """
    shines = bool(contents.environment or contents.lights or any(any(o.emission) for o in contents.objects))
    own_light = contents.environment is not None or (contents.tells_its_light and shines)
    notes = ("nothing in it gives light: it is under daylight",) if contents.tells_its_light and not own_light else ()
    return Scene(
        name=name,
        objects=contents.objects,
        materials=contents.materials,
        environment=contents.environment if own_light else DAYLIGHT,
        lights=contents.lights,
        cameras=contents.cameras or (overview(*bounds_of(contents.objects)),),
        exposure_ev=0.0 if own_light else EXPOSURE_EV,
        sources=contents.sources,
        warnings=(*contents.warnings, *notes),
        textures=contents.textures,
    )
