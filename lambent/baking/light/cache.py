"""The light map as a radiance cache: paths end at diffuse surfaces and take their baked light."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.bsdfs.diffuse_shares import DiffuseShares
from lambent.baking.bsdfs.material_plugin import DIFFUSE_ATTRIBUTE
from lambent.baking.tracing.lights.lamps import LampRays
from lambent.baking.tracing.lights.sun import SunRays
from lambent.baking.tracing.path_tracer import Points
from lambent.baking.tracing.scene_builder import SceneBuilder, light_map_uv
from lambent.core.arrays import Floats
from lambent.materials.document import Material


class LightMapCache:
    """Diffuse radiance of surfaces from baked irradiance: kd/pi E of this side plus kt_d/pi E of the other.

    Where kd depends on directions (`DiffuseShares`), its mean over the light's cosines is used, which is exact for
    uniform light. Shadow rays add the `sun` and the `lamps` that the light map leaves out. By side, `drawn` is the part
    (H, W, 3) of its light that renderers draw by pixel.
    """

    def __init__(
        self, builder: SceneBuilder, irradiance: Floats, irradiance_back: Floats | None, sun: SunRays | None = None,
        drawn: Sequence[Floats] = (), lamps: LampRays | None = None,
    ) -> None:  # fmt: skip
        self._sun, self._lamps, self._drawn = sun, lamps, [_texture(side) for side in drawn]
        # A measured table is traced without the cache: its object has no diffuse term.
        looks = dict(builder.scene.materials) | dict.fromkeys(builder.measured, Material())
        materials = [Material() if o.name in builder.unmapped else looks[o.material] for o in builder.scene.objects]
        self._numbers = builder.numbers
        self._reflected = mi.Color3f(np.array([m.kd for m in materials], np.float32).T / np.float32(np.pi))
        self.shares = DiffuseShares(materials)
        self._transmitted = mi.Color3f(np.array([m.kt_d for m in materials], np.float32).T / np.float32(np.pi))
        self._textured = any(t.diffuse for t in builder.scene.textures.values())
        self._front = _texture(irradiance)
        self._back = _texture(irradiance_back) if irradiance_back is not None else None

    def __call__(self, si: Any, active: Any) -> Any:
        uv2 = light_map_uv(si, active)
        front = mi.Color3f(self._front.eval(uv2, active))
        back = mi.Color3f(self._back.eval(uv2, active)) if self._back is not None else mi.Color3f(0.0)
        if self._sun is not None:
            sun = self._sun(si, active)
            front, back = front + dr.maximum(sun, 0), back + dr.maximum(-sun, 0)
        if self._lamps is not None:
            on_front, on_back = self._lamps(si, active)
            front, back = front + on_front, back + on_back
        return self._shown(si, active, [(front, back)])[0]

    def _shown(self, si: Any, active: Any, irradiance: list[tuple[Any, Any]]) -> list[Any]:
        """Diffuse radiance (mi.Color3f) of surfaces for each pair of irradiances on the normal's side and the other."""
        outside = mi.Frame3f.cos_theta(si.wi) > 0
        reflected, transmitted, number = self.colours(si, active)
        reflected *= self.shares.seen(number, dr.abs(mi.Frame3f.cos_theta(si.wi)), active)
        by_front, by_back = dr.select(outside, reflected, transmitted), dr.select(outside, transmitted, reflected)
        return [by_front * front + by_back * back for front, back in irradiance]

    def colours(self, si: Any, active: Any) -> tuple[Any, Any, Any]:
        """kd/pi, kt_d/pi (mi.Color3f), textured, and the number of the material in `shares`."""
        number = self._numbers.at(si, active)
        reflected = dr.gather(mi.Color3f, self._reflected, number, active)
        transmitted = dr.gather(mi.Color3f, self._transmitted, number, active)
        if self._textured:
            texture = si.bsdf().eval_attribute_3(DIFFUSE_ATTRIBUTE, si, active)
            reflected, transmitted = reflected * texture, transmitted * texture
        return reflected, transmitted, number

    def sun_on(self, points: Points, active: Any) -> list[tuple[Any, Any]]:
        """Irradiance (mi.Color3f) of the sun that the light map leaves out, and the direction it comes from."""
        if self._sun is None:
            return []
        light = self._sun.on(points.position, points.normal, points.flat, active)
        return [(light, mi.Vector3f(*map(float, self._sun.direction)))]

    def irradiance(self, si: Any, active: Any, *, direct: bool = True) -> Any:
        """Irradiance on the side that a ray came from, with or without what renderers draw: sun and lamps.

        A back without a light map takes the front's.
        """
        outside, uv2 = mi.Frame3f.cos_theta(si.wi) > 0, light_map_uv(si, active)
        found = mi.Color3f(self._front.eval(uv2, active))
        if self._back is not None:
            found = dr.select(outside, found, mi.Color3f(self._back.eval(uv2, active)))
        if not direct:
            for side, light in zip((outside, ~outside), self._drawn, strict=False):
                found -= dr.select(side, mi.Color3f(light.eval(uv2, active)), 0.0)
            return dr.maximum(found, 0.0)
        if self._sun is None:
            return found
        of_sun = self._sun(si, active)
        return found + dr.maximum(dr.select(outside, of_sun, -of_sun), 0)


class GroupedCache(LightMapCache):
    """Likewise by group of emitters: light maps (n, H, W, 3) of n groups, the sun's shadow rays in the group `of_sun`.

    `groups` is called like a cache and returns a list.
    """

    def __init__(
        self, builder: SceneBuilder, irradiance: Floats, irradiance_back: Floats | None, sun: SunRays | None,
        of_sun: int | None,
    ) -> None:  # fmt: skip
        super().__init__(builder, _side_by_side(irradiance), _side_by_side(irradiance_back), sun)
        self._count, self._of_sun = len(irradiance), of_sun

    def groups(self, si: Any, active: Any) -> list[Any]:
        """Diffuse radiance (mi.Color3f) by group."""
        uv2 = light_map_uv(si, active)
        front = self._front.eval(uv2, active)
        back = [mi.Float(0.0)] * len(front) if self._back is None else self._back.eval(uv2, active)
        sides = [tuple(mi.Color3f(*light[3 * g : 3 * g + 3]) for light in (front, back)) for g in range(self._count)]
        if self._sun is not None and self._of_sun is not None:
            sun, (one, other) = self._sun(si, active), sides[self._of_sun]
            sides[self._of_sun] = one + dr.maximum(sun, 0), other + dr.maximum(-sun, 0)
        return self._shown(si, active, sides)


def _side_by_side(maps: Floats | None) -> Any:
    """(H, W, 3 n) of maps (n, H, W, 3)."""
    return None if maps is None else np.concatenate(list(maps), axis=-1)


def _texture(image: Floats) -> Any:
    return mi.Texture2f(mi.TensorXf(image.astype(np.float32)), wrap_mode=dr.WrapMode.Clamp)
