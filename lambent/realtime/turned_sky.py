"""A baked scene under its sky turned about the vertical: relighting by light fields (thesis R, "Relighting").

What is seen of the sky turns at once: behind everything, in light fields, where they say that nothing is hit, and in
probes whose distances say so. The sun turns with it, and its direct light and shadows are drawn anew. What the light
map holds stays as it was baked: the diffuse light of the sky, and all that surfaces throw on each other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.cubemap import face_directions, sample
from lambent.core.directions import normalize
from lambent.core.light_field import Sky
from lambent.core.light_field_shading import turned, under_sky
from lambent.core.plain import triple
from lambent.realtime.baked import BakedScene, Probe
from lambent.realtime.cube_mips import mip_chain
from lambent.realtime.sun_disc import sky_without
from lambent.scenes.geometry import turn
from lambent.store.contract import FAR


def under_turned_sky(scene: BakedScene, degrees: float) -> BakedScene:
    """The scene with its sky turned by degrees from -z towards -x, as `ImageEnvironment.rotation_deg` counts."""
    if scene.environment is None or degrees % 360 == 0:
        return scene
    rotation = turn("y", degrees)
    sun = scene.sun and scene.sun.model_copy(update={"direction": triple(rotation @ np.array(scene.sun.direction))})
    clear = _levels(scene.environment if scene.sun is None else sky_without(scene.environment, scene.sun))
    whole = _levels(scene.environment)
    return replace(
        scene,
        environment=_seen(turned(_of(whole, 2 * scene.environment.shape[1]), rotation), scene.environment.shape[1]),
        sun=sun,
        probes={name: _probe_under(probe, whole, rotation) for name, probe in scene.probes.items()},
        light_fields={
            name: under_sky(field, turned(_of(clear, field.inverse_distance.shape[1]), rotation))
            for name, field in scene.light_fields.items()
        },
    )


def _levels(cube: Floats) -> list[Floats]:
    return mip_chain(np.nan_to_num(np.asarray(cube, np.float32)))


def _of(levels: list[Floats], side: int) -> Sky:
    """The sky for maps of side^2 texels over the sphere: of the level whose texels are about as large."""
    fits = next((level for level in levels if 6 * level.shape[1] ** 2 <= 1.5 * side**2), levels[-1])
    return lambda w: sample(fits, w)


def _seen(sky: Sky, n: int) -> Floats:
    """A cube map (6, n, n, 3) of a sky."""
    return np.asarray(sky(normalize(face_directions(n))), np.float32)


def _probe_under(probe: Probe, levels: list[Floats], rotation: Floats) -> Probe:
    """A probe whose distances say where it sees the sky; others stay."""
    if probe.distance is None:
        return probe
    n, m = probe.radiance.shape[1], probe.distance.shape[1]
    at = np.minimum((np.arange(n) + 0.5) * m / n, m - 1).astype(int)
    open_sky = probe.distance[:, at[:, None], at] >= 0.999 * FAR
    sky = turned(_of(levels, int(np.sqrt(6.0) * n)), rotation)
    radiance = np.where(open_sky[..., None], _seen(sky, n), probe.radiance)
    return replace(probe, radiance=np.asarray(radiance, probe.radiance.dtype))
