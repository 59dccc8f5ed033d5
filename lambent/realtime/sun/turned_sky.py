"""Rotates the sky of a baked scene about the vertical: relighting by light fields (thesis R, "Relighting").

The visible sky rotates at once: in the background, in rays of light fields that hit nothing, and in probes whose
distances mark the sky. The sun rotates with it, and its direct light and shadows are redrawn. The light map stays as
baked: diffuse skylight and light between surfaces.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from lambent.baked.light_fields.light_field import Sky
from lambent.baked.light_fields.shading import turned, under_sky
from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.cubemap import face_directions, sample
from lambent.core.geometry.directions import normalize
from lambent.core.plain import triple
from lambent.realtime.gpu.cube_mips import mip_chain
from lambent.realtime.light.baked import BakedScene, Probe
from lambent.realtime.light.group_arrays import GroupArrays
from lambent.realtime.sun.sun_disc import sky_without
from lambent.scenes.geometry import turn
from lambent.scenes.light_groups import SKY, SUN
from lambent.store.contract import FAR


def under_turned_sky(scene: BakedScene, degrees: float) -> BakedScene:
    """The scene with its sky rotated by degrees from -z towards -x, like `ImageEnvironment.rotation_deg`."""
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
        sunlit=None,
        probes={name: _probe_under(probe, whole, rotation) for name, probe in scene.probes.items()},
        light_fields={
            name: under_sky(field, turned(_of(clear, field.inverse_distance.shape[1]), rotation))
            for name, field in scene.light_fields.items()
        },
        groups=scene.groups
        and TurnedGroups(
            scene.groups.records,
            scene.groups.store,
            scene.groups.unit,
            base=scene.groups,
            baked=scene.probes,
            whole=whole,
            clear=clear,
            rotation=rotation,
        ),
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class TurnedGroups(GroupArrays):
    """Light by group of a scene under a rotated sky.

    `whole` and `clear` are the sky's MIP levels with and without the sun's disc, which belongs to the sun's group.
    """

    base: GroupArrays
    baked: Mapping[str, Probe]
    whole: list[Floats]
    clear: list[Floats]
    rotation: Floats

    def probe(self, name: str) -> Floats | None:
        """Radiance of an object's probe by group, laid out as in `base`."""
        by_group, sky, sun = self.base.probe(name), self.number(SKY), self.number(SUN)
        if by_group is None or sky is None or (probe := self.baked[name]).distance is None:
            return by_group
        n, seen = by_group.shape[2], _sees_sky(probe.distance, by_group.shape[2])
        whole, clear = (_turned_sky(levels, self.rotation, n)[seen] for levels in (self.whole, self.clear))
        by_group[:, seen] = 0
        by_group[sky][seen] = whole if sun is None else clear
        if sun is not None:
            by_group[sun][seen] = whole - clear
        return by_group


def _levels(cube: Floats) -> list[Floats]:
    return mip_chain(np.nan_to_num(np.asarray(cube, np.float32)))


def _of(levels: list[Floats], side: int) -> Sky:
    """The sky for maps of side^2 texels over the sphere: the level with texels of about the same size."""
    fits = next((level for level in levels if 6 * level.shape[1] ** 2 <= 1.5 * side**2), levels[-1])
    return lambda w: sample(fits, w)


def _seen(sky: Sky, n: int) -> Floats:
    """A cube map (6, n, n, 3) of a sky."""
    return np.asarray(sky(normalize(face_directions(n))), np.float32)


def _probe_under(probe: Probe, levels: list[Floats], rotation: Floats) -> Probe:
    """The probe under the rotated sky; unchanged if it has no distances, which mark the sky."""
    if probe.distance is None:
        return probe
    n = probe.radiance.shape[1]
    radiance = np.where(_sees_sky(probe.distance, n)[..., None], _turned_sky(levels, rotation, n), probe.radiance)
    return replace(probe, radiance=np.asarray(radiance, probe.radiance.dtype))


def _sees_sky(distance: Floats, n: int) -> Flags:
    """Texels (6, n, n) of a probe that see the sky, by its distances (6, m, m)."""
    at = np.minimum((np.arange(n) + 0.5) * distance.shape[1] / n, distance.shape[1] - 1).astype(int)
    return np.asarray(distance[:, at[:, None], at] >= 0.999 * FAR)


def _turned_sky(levels: list[Floats], rotation: Floats, n: int) -> Floats:
    return _seen(turned(_of(levels, int(np.sqrt(6.0) * n)), rotation), n)
