"""The material as a Mitsuba BSDF: the path tracer renders exactly the BSDF of materials/bsdf.py.

    register_material_plugin()
    scene["floor"]["bsdf"] = material_dict(material)

Conventions: Mitsuba's `si.wi` is the viewer's side (our wo) and its sampled `wo` is our wi; its eval includes the
cosine. A material is a thin two-sided sheet without refraction, so radiance and importance scatter alike.

Brushing direction: if the shape has a mesh attribute `vertex_tangent` (3 floats, world space, need not be exactly
perpendicular to the normal), t is its projection onto the shading plane and b = n x t. Without it, t is the s axis of
`si.sh_frame`, which Mitsuba derives from the uv's (dp/du), or arbitrarily for a mesh that has none.
Isotropic materials without a normal map do not use it.

`eval_null_transmission` is the undeviated transmittance. It is 1, with the flag Null, where a texture says that there
is no surface: `tracing.rays` pass through such holes. Mitsuba's own integrators do not: they see a whole surface. On
clear glass (`materials.clear`) it is between 0 and 1; its lobes scatter the same light, so adding both counts it twice.
"""

from __future__ import annotations

import functools
import json
from typing import Any

import drjit as dr
import mitsuba as mi

from lambent.baking.bsdfs.textured import SurfaceTextures, faced_side, facing_frame, textures_dict
from lambent.baking.engine import once_per_variant
from lambent.baking.tracing.array_ops import array_ops
from lambent.materials import bsdf
from lambent.materials.clear import MOST, clear_terms, transmittance
from lambent.materials.document import BLACK, Material, material_from
from lambent.scenes.panes import is_clear
from lambent.scenes.scene import MaterialTextures

PLUGIN = "lambent_material"
TANGENT_ATTRIBUTE = "vertex_tangent"
# Attributes of the BSDF: the textures that multiply kd and kt_d, and k of every lobe; the shading frame in world space.
DIFFUSE_ATTRIBUTE, SPECULAR_ATTRIBUTE, NORMAL_ATTRIBUTE = "diffuse", "specular", "normal"
# The factor of roughness; the mesh's normal if a normal map bends it, else 0.
ROUGHNESS_ATTRIBUTE, SHEET_ATTRIBUTE = "roughness", "sheet"
ATTRIBUTES = (
    DIFFUSE_ATTRIBUTE, SPECULAR_ATTRIBUTE, NORMAL_ATTRIBUTE, TANGENT_ATTRIBUTE, ROUGHNESS_ATTRIBUTE, SHEET_ATTRIBUTE,
)  # fmt: skip


def material_dict(
    material: Material, textures: MaterialTextures | None = None, *, diffuse: bool = True
) -> dict[str, Any]:
    """The dictionary for `mi.load_dict`; of the lobes alone if `diffuse` is false.

    Untextured surfaces that scatter light alike have equal dictionaries, whatever their materials' names.
    """
    scattering = material if diffuse else bsdf.specular_only(material)
    result: dict[str, Any] = {"type": PLUGIN, "material": scattering.model_dump_json(exclude={"name", "provenance"})}
    if is_clear(material, textures):
        result["clear"] = True
    if textures is not None:
        result |= textures_dict(textures)
    return result


@once_per_variant
def register_material_plugin() -> type:
    """Select the engine and register `lambent_material` with it; returns its class. Further calls cost nothing."""

    class MaterialBSDF(mi.BSDF):  # type: ignore[misc]
        """Diffuse terms and lobes; component i of Mitsuba is component i of `bsdf.selection`."""

        def __init__(self, props: Any) -> None:
            mi.BSDF.__init__(self, props)
            self.material = material_from(json.loads(str(props["material"])), f"{PLUGIN} {props.id()}")
            self._on_device = on_device(self.material)
            self._ops = array_ops()
            self.textures = SurfaceTextures(props)
            self.anisotropic = any(lobe.mx != lobe.my for lobe in self.material.lobes)
            self.framed = "normal" in self.textures or (self.anisotropic and "direction" in self.textures)
            flags, lobes = mi.BSDFFlags, self.material.lobes
            glossy = {"reflection": flags.GlossyReflection, "transmission": flags.GlossyTransmission}
            self.kinds = [flags.DiffuseReflection, flags.DiffuseTransmission, *(glossy[lobe.side] for lobe in lobes)]
            turned = [0, 0, *(int(flags.Anisotropic) * (lobe.mx != lobe.my) for lobe in lobes)]
            # Skip black components: emitters are not sampled for a material without any.
            shown = [any(self.material.kd), any(self.material.kt_d), *(any(lobe.k) for lobe in lobes)]
            both = int(flags.FrontSide) | int(flags.BackSide)
            parts = zip(self.kinds, turned, shown, strict=True)
            self.m_components = [both | (int(kind) | turn if is_shown else 0) for kind, turn, is_shown in parts]
            self.m_flags = functools.reduce(lambda a, b: a | b, self.m_components)
            if "opacity" in self.textures:
                self.m_flags |= int(mi.BSDFFlags.Null)
            self.clear = clear_terms(self.material) if props.get("clear") else None

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            material, frame = self._enabled(ctx, si, active), self._frame(si, active)
            wo = frame.to_local(si.wi)
            wi = bsdf.sample(wo, sample1, sample2.x, sample2.y, material, self._ops)
            density = bsdf.pdf(wi, wo, material, self._ops)
            bs = mi.BSDFSample3f()
            bs.wo = mi.Vector3f(frame.to_world(mi.Vector3f(*wi)))
            active &= (density > 0) & self._is_possible(si, bs.wo, wi)
            value = mi.Color3f(bsdf.evaluate(wi, wo, material, self._ops))

            bs.pdf = dr.select(active, density, 0.0)
            bs.eta = 1.0
            bs.sampled_component, bs.sampled_type = self._component(sample1, wo, material)
            return bs, dr.select(active, value * (dr.abs(wi[2]) / density), 0.0)

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval_pdf(ctx, si, wo, active)[1]

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            material, frame = self._enabled(ctx, si, active), self._frame(si, active)
            viewer, light = frame.to_local(si.wi), frame.to_local(wo)
            value = mi.Color3f(bsdf.evaluate(light, viewer, material, self._ops)) * dr.abs(light[2])
            density = bsdf.pdf(light, viewer, material, self._ops)
            active &= self._is_possible(si, wo, light)
            return dr.select(active, value, 0.0), dr.select(active, density, 0.0)

        def eval_diffuse_reflectance(self, si: Any, active: Any = True) -> Any:
            seen = bsdf.diffuse_seen(dr.abs(si.wi.z), self.material, self._ops)
            kd = mi.Color3f(self.material.kd) * self.textures.diffuse(si, active)
            return dr.select(active, kd * seen, 0.0)

        def eval_null_transmission(self, si: Any, active: Any = True) -> Any:
            passed = mi.Color3f(0.0)
            if self.clear is not None:
                passed = mi.Color3f(transmittance(dr.abs(si.wi.z), self.clear, dr)) * self.textures.specular(si, active)
            return dr.select(self.textures.is_hole(si, active), mi.Color3f(1.0), dr.minimum(passed, MOST))

        def has_attribute(self, name: str, active: Any = True) -> Any:
            return mi.Bool(name in ATTRIBUTES)

        def eval_attribute_3(self, name: str, si: Any, active: Any = True) -> Any:
            """One of ATTRIBUTES; textures are returned regardless of the coefficients they multiply."""
            if name == DIFFUSE_ATTRIBUTE:
                return self.textures.diffuse(si, active)
            if name == SPECULAR_ATTRIBUTE:
                return self.textures.specular(si, active)
            if name == ROUGHNESS_ATTRIBUTE:
                return mi.Color3f(self.textures.roughness(self.material, si, active))
            if name == SHEET_ATTRIBUTE:
                return mi.Color3f(si.sh_frame.n) * float("normal" in self.textures)
            turned = brushing_angle(si, active, anisotropic=True)
            frame = self.textures.frame(turned, si, active) if self.framed else facing_frame(turned, si)
            axis = (0.0, 0.0, 1.0) if name == NORMAL_ATTRIBUTE else (1.0, 0.0, 0.0)
            return mi.Color3f(si.to_world(mi.Vector3f(frame.to_world(mi.Vector3f(*axis)))))

        def to_string(self) -> str:
            return f"{PLUGIN}[{self.material.model_dump_json()}]"

        def _enabled(self, ctx: Any, si: Any, active: Any) -> Material:
            """The material at `si`, with coefficients of components excluded by `ctx` set to zero."""
            on = [ctx.is_enabled(kind, i) for i, kind in enumerate(self.kinds)]
            material = self._on_device if all(on) else _masked(self._on_device, on)
            return self.textures.material(material, si, active)

        def _frame(self, si: Any, active: Any) -> Any:
            tangent = brushing_angle(si, active, self.anisotropic or self.framed)
            return self.textures.frame(tangent, si, active) if self.framed else facing_frame(tangent, si)

        def _is_possible(self, si: Any, wi: Any, in_frame: Any) -> Any:
            """False for light from behind the surface that a bent normal would admit."""
            if "normal" not in self.textures:
                return mi.Bool(True)
            turned = faced_side(si)[0] * si.wi.z < 0
            return turned | (wi.z * in_frame[2] > 0)

        def _component(self, sample1: Any, wo: Any, material: Material) -> tuple[Any, Any]:
            """Index and flags of the component that `bsdf.sample` chose."""
            index, flags = mi.UInt32(0), mi.UInt32(self.m_components[0])
            up_to = mi.Float(0)
            for i, share in enumerate(bsdf.selection(wo, material, self._ops)):
                here = sample1 >= up_to
                index = dr.select(here, mi.UInt32(i), index)
                flags = dr.select(here, mi.UInt32(self.m_components[i]), flags)
                up_to += share
            return index, flags

    mi.register_bsdf(PLUGIN, MaterialBSDF)
    return MaterialBSDF


def brushing_angle(si: Any, active: Any, anisotropic: bool) -> tuple[Any, Any]:
    """Cosine and sine of the angle from the s axis of the shading frame to the brushing direction."""

    if not anisotropic:
        return 1.0, 0.0
    brushed = active & si.shape.has_attribute(TANGENT_ATTRIBUTE)
    t = si.to_local(si.shape.eval_attribute_3(TANGENT_ATTRIBUTE, si, brushed))
    length = dr.sqrt(t.x * t.x + t.y * t.y)
    brushed &= length > 1e-6
    return dr.select(brushed, t.x / length, 1.0), dr.select(brushed, t.y / length, 0.0)


def on_device(material: Material) -> Material:
    """The material with numbers that kernels read from memory: kernels depend on its structure alone.

    That is which numbers are 0, whether a colour is grey and whether a lobe is isotropic. Materials of one structure
    share their functions, so an edit compiles nothing.
    """
    lobes = []
    for lobe in material.lobes:
        mx, my = _held((lobe.mx, lobe.my))
        update = {"k": _held(lobe.k), "r0": _held(lobe.r0), "mx": mx, "my": my, "alpha": _held((lobe.alpha,))[0]}
        lobes.append(lobe.model_copy(update=update))
    update = {"kd": _held(material.kd), "kt_d": _held(material.kt_d), "lobes": tuple(lobes)}
    return material.model_copy(update=update)


def _held(values: tuple[float, ...]) -> tuple[Any, ...]:
    """Numbers as mi.Float that are no constants, equal ones as one; if all are 0, as they are."""
    if not any(values):
        return values
    if len(set(values)) == 1:
        return (dr.opaque(mi.Float, values[0]),) * len(values)
    return tuple(dr.opaque(mi.Float, value) for value in values)


def _masked(material: Material, on: list[bool]) -> Material:
    lobes = [
        lobe if keep else lobe.model_copy(update={"k": BLACK})
        for lobe, keep in zip(material.lobes, on[2:], strict=True)
    ]
    update = {"kd": material.kd if on[0] else BLACK, "kt_d": material.kt_d if on[1] else BLACK, "lobes": tuple(lobes)}
    return material.model_copy(update=update)
