"""The light map as a radiance cache: paths end at diffuse surfaces, which show their baked light."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.bake.bsdfs.material_plugin import DIFFUSE_ATTRIBUTE
from lambent.bake.tracing.scene_builder import SceneBuilder, light_map_uv
from lambent.bake.tracing.sun import SunRays
from lambent.core.arrays import Floats
from lambent.materials.bsdf import under_fresnel
from lambent.materials.document import Material


class LightMapCache:
    """Diffuse radiance of surfaces, from baked irradiance: kd/pi E of this side plus kt_d/pi E of the other.

    A coupled kd falls with the viewer's cosine, t(cos_o); over the light's cosines its mean is taken, which is exact
    under uniform light. The `sun` that the light map leaves out is added by shadow rays.
    """

    def __init__(
        self, builder: SceneBuilder, irradiance: Floats, irradiance_back: Floats | None, sun: SunRays | None = None
    ) -> None:
        self._sun = sun
        # A measured table is traced whole: its object has no diffuse term of its own.
        looks = dict(builder.scene.materials) | dict.fromkeys(builder.measured, Material())
        materials = [looks[o.material] for o in builder.scene.objects]
        self._numbers = builder.object_numbers()
        self._reflected = mi.Color3f(np.array([m.kd for m in materials], np.float32).T / np.float32(np.pi))
        self._coupled = mi.Bool(np.array([m.kd_coupled for m in materials], bool))
        self._transmitted = mi.Color3f(np.array([m.kt_d for m in materials], np.float32).T / np.float32(np.pi))
        self._textured = any(t.diffuse for t in builder.scene.textures.values())
        self._front = _texture(irradiance)
        self._back = _texture(irradiance_back) if irradiance_back is not None else None

    def __call__(self, si: Any, active: Any) -> Any:
        number = dr.gather(mi.UInt32, self._numbers, dr.reinterpret_array(mi.UInt32, si.shape), active)
        uv2 = light_map_uv(si, active)
        front = mi.Color3f(self._front.eval(uv2, active))
        back = mi.Color3f(self._back.eval(uv2, active)) if self._back is not None else mi.Color3f(0.0)
        if self._sun is not None:
            sun = self._sun(si, active)
            front, back = front + dr.maximum(sun, 0), back + dr.maximum(-sun, 0)
        outside = mi.Frame3f.cos_theta(si.wi) > 0
        reflected = dr.gather(mi.Color3f, self._reflected, number, active)
        transmitted = dr.gather(mi.Color3f, self._transmitted, number, active)
        coupled = dr.gather(mi.Bool, self._coupled, number, active)
        reflected *= dr.select(coupled, under_fresnel(dr.abs(mi.Frame3f.cos_theta(si.wi)), dr), 1.0)
        this_side, other_side = dr.select(outside, front, back), dr.select(outside, back, front)
        light = reflected * this_side + transmitted * other_side
        return light * si.bsdf().eval_attribute_3(DIFFUSE_ATTRIBUTE, si, active) if self._textured else light

    def irradiance(self, si: Any, active: Any) -> Any:
        """Irradiance on the normal's side."""
        found = mi.Color3f(self._front.eval(light_map_uv(si, active), active))
        return found if self._sun is None else found + dr.maximum(self._sun(si, active), 0)


def _texture(image: Floats) -> Any:
    return mi.Texture2f(mi.TensorXf(image.astype(np.float32)), wrap_mode=dr.WrapMode.Clamp)
