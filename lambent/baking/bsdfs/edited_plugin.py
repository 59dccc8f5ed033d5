"""An edited material as a Mitsuba BSDF: the path tracer renders its edited terms and curves.

    scene["floor"]["bsdf"] = edited_dict(material, editable)

Conventions, textures and frames are those of material_plugin.py. Sampling of directions ignores the curves, as for
interreflections.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from lambent.baking.bsdfs.material_plugin import material_dict, register_material_plugin
from lambent.baking.engine import once_per_variant
from lambent.baking.interreflection.directions import Sides, density, sampled, shares_of
from lambent.baking.interreflection.evaluation import Curves
from lambent.baking.tracing.array_ops import array_ops
from lambent.materials.document import Material
from lambent.materials.factored.terms import Editable
from lambent.scenes.scene import MaterialTextures

PLUGIN = "lambent_edited"
_EDITABLES: list[Editable] = []  # a plugin receives only an index into this list


def edited_dict(material: Material, edited: Editable, textures: MaterialTextures | None = None) -> dict[str, Any]:
    """The dictionary for `mi.load_dict`, for a material of this document after edits; registers the plugin."""
    _register()
    _EDITABLES.append(edited)
    return material_dict(material, textures) | {"type": PLUGIN, "number": len(_EDITABLES) - 1}


@once_per_variant
def _register() -> None:
    base, ops = register_material_plugin(), array_ops()

    class EditedBSDF(base):  # type: ignore[misc, valid-type]
        """All terms in one component."""

        def __init__(self, props: Any) -> None:
            base.__init__(self, props)  # type: ignore[misc]
            self.curves = Curves(_EDITABLES[int(props["number"])], ops)
            self.anisotropic = True
            through, back = map(float, shares_of(self.curves.material))
            self.sides = Sides(through, back)
            flags = int(mi.BSDFFlags.FrontSide) | int(mi.BSDFFlags.BackSide) | int(mi.BSDFFlags.GlossyReflection)
            if through > 0:
                flags |= int(mi.BSDFFlags.GlossyTransmission)
            self.m_components = [flags]
            self.m_flags = flags | (int(mi.BSDFFlags.Null) if "opacity" in self.textures else 0)

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            frame = self._frame(si, active)
            wo = mi.Vector3f(*frame.to_local(si.wi))
            up = dr.select(wo.z < 0, -1.0, 1.0)
            wi, pdf = sampled(wo * mi.Vector3f(1, 1, up), self.sides, sample1, _rest(sample1, self.sides), sample2)
            wi *= mi.Vector3f(1, 1, up)
            bs = mi.BSDFSample3f()
            bs.wo = mi.Vector3f(*frame.to_world(wi))
            active &= (pdf > 0) & self._is_possible(si, bs.wo, wi)
            bs.pdf, bs.eta = dr.select(active, pdf, 0.0), 1.0
            bs.sampled_component, bs.sampled_type = mi.UInt32(0), mi.UInt32(self.m_components[0])
            value = self._value(wi, wo, si, active)
            return bs, dr.select(active, value * (dr.abs(wi.z) / dr.maximum(pdf, 1e-20)), 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            frame = self._frame(si, active)
            viewer, light = (mi.Vector3f(*frame.to_local(w)) for w in (si.wi, wo))
            up = mi.Vector3f(1, 1, dr.select(viewer.z < 0, -1.0, 1.0))
            active &= self._is_possible(si, wo, light)
            value = self._value(light, viewer, si, active) * dr.abs(light.z)
            return dr.select(active, value, 0.0), dr.select(active, density(light * up, viewer * up, self.sides), 0.0)

        def _value(self, wi: Any, wo: Any, si: Any, active: Any) -> Any:
            diffuse, specular = self.textures.diffuse(si, active), self.textures.specular(si, active)
            return mi.Color3f(self.curves.evaluate(wi, wo, diffuse, specular))

        def to_string(self) -> str:
            return f"{PLUGIN}[{self.curves.material.name}]"

    mi.register_bsdf(PLUGIN, EditedBSDF)


def _rest(u: Any, sides: Sides) -> Any:
    """Rescale a random number after it chose a side: uniform in [0, 1) again."""
    both = sides.through + sides.back
    above = dr.select(u < both, (u - sides.through) / sides.back, (u - both) / (1 - both))
    return dr.select(u < sides.through, u / sides.through, above)
