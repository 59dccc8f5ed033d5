"""Textures in the path tracer: a material's parameters and shading frame at ray hits.

Texels are interpolated bilinearly without further filtering, which many paths per pixel replace. The interpolated
quantities are the renderer's (scenes.textures): slopes for normals, doubled angles for directions.
"""

from __future__ import annotations

import json
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.materials.document import Lobe, Material
from lambent.scenes.looks.textures import doubled_angle, parts, slopes
from lambent.scenes.scene import MaterialTextures

INTERPOLATED = {"normal": slopes, "direction": doubled_angle}  # other parts are interpolated directly
LAYOUT = "textures"
IMAGE = "picture_"
GRAZING = 0.1  # least cos_o of a normal, as in realtime/shading/shade.wgsl: others are bent to the viewer
SMALLEST_M, LARGEST_M = 0.001, 4.0  # of materials.document


def textures_dict(textures: MaterialTextures) -> dict[str, Any]:
    """Textures for `material_dict`: their transforms as JSON, the images as tensors."""
    said: dict[str, Any] = {"cutoff": textures.cutoff, "parts": {}}
    result: dict[str, Any] = {}
    for part, texture in parts(textures).items():
        values = INTERPOLATED.get(part, np.asarray)(texture.texels.astype(np.float32))
        said["parts"][part] = np.asarray(texture.uv_transform, float).tolist()
        result[IMAGE + part] = mi.TensorXf(np.ascontiguousarray(values))
    return {LAYOUT: json.dumps(said), **result}


class SurfaceTextures:
    """The textures of one material on the device; `part in textures` tests for a part's texture."""

    def __init__(self, props: Any) -> None:
        said: dict[str, Any] = json.loads(str(props[LAYOUT])) if LAYOUT in props else {"cutoff": 0.5, "parts": {}}
        self.cutoff: float = said["cutoff"]
        self._transforms: dict[str, Any] = said["parts"]
        wrap = dr.WrapMode.Repeat
        self._images = {part: mi.Texture2f(props[IMAGE + part], wrap_mode=wrap) for part in self._transforms}

    def __contains__(self, part: str) -> bool:
        return part in self._images

    def at(self, part: str, si: Any, active: Any) -> list[Any]:
        """Channels of a texture at `si`."""
        (a, b, c), (d, e, f) = self._transforms[part]
        u, v = a * si.uv.x + b * si.uv.y + c, d * si.uv.x + e * si.uv.y + f
        return list(self._images[part].eval(mi.Point2f(u, 1 - v), active))

    def is_hole(self, si: Any, active: Any) -> Any:
        """Whether there is no surface."""
        return self.at("opacity", si, active)[0] < self.cutoff if "opacity" in self else mi.Bool(False)

    def diffuse(self, si: Any, active: Any) -> Any:
        """Factor (mi.Color3f) of kd and kt_d."""
        return self._colour("diffuse", si, active)

    def specular(self, si: Any, active: Any) -> Any:
        """Factor (mi.Color3f) of k of every lobe."""
        return self._colour("specular", si, active)

    def roughness(self, material: Material, si: Any, active: Any) -> Any:
        """Factor (mi.Float) of mx and my of every lobe, clamped to the range that materials allow."""
        if "roughness" not in self or not material.lobes:
            return mi.Float(1.0)
        widths = [m for lobe in material.lobes for m in (lobe.mx, lobe.my)]
        return dr.clip(self.at("roughness", si, active)[0], SMALLEST_M / min(widths), LARGEST_M / max(widths))

    def _colour(self, part: str, si: Any, active: Any) -> Any:
        return mi.Color3f(*self.at(part, si, active)) if part in self else mi.Color3f(1.0)

    def material(self, material: Material, si: Any, active: Any) -> Material:
        """A material whose numbers other than 0 are on the device (`material_plugin.on_device`), as it is at `si`."""
        update: dict[str, Any] = {}
        both = {"kd": material.kd, "kt_d": material.kt_d}
        colours = {name: colour for name, colour in both.items() if not isinstance(colour[0], float)}  # not black
        if "diffuse" in self and colours:
            factor = self.at("diffuse", si, active)
            update = {name: tuple(x * y for x, y in zip(value, factor, strict=True)) for name, value in colours.items()}
        if material.lobes and ("specular" in self or "roughness" in self):
            colour = self.at("specular", si, active) if "specular" in self else [1.0] * 3
            rough = self.at("roughness", si, active)[0] if "roughness" in self else None
            update["lobes"] = tuple(_lobe(lobe, colour, rough) for lobe in material.lobes)
        return material.model_copy(update=update) if update else material

    def frame(self, tangent: tuple[Any, Any], si: Any, active: Any) -> Any:
        """mi.Frame3f (t, b, n) within `si.sh_frame`; `tangent` is the cosine and sine of t without textures."""
        c, s = tangent
        t, b = mi.Vector3f(c, s, 0.0), mi.Vector3f(-s, c, 0.0)
        n = mi.Vector3f(0.0, 0.0, 1.0)
        along = t
        if "direction" in self:
            cos2, sin2 = self.at("direction", si, active)
            half = _half_angle(cos2, sin2)
            along = half[0] * t + half[1] * b
        if "normal" in self:
            x, y = self.at("normal", si, active)
            n = bent(dr.normalize(x * t + y * b + n), si.wi, faced_side(si)[0], GRAZING)
        else:
            n = bent(n, si.wi, *faced_side(si))
        along = dr.normalize(along - n * dr.dot(n, along))
        return mi.Frame3f(along, dr.cross(n, along), n)


def _lobe(lobe: Lobe, colour: list[Any], rough: Any) -> Lobe:
    update: dict[str, Any] = {"k": tuple(x * y for x, y in zip(lobe.k, colour, strict=True))}
    if rough is not None:
        scale = dr.clip(rough, SMALLEST_M / dr.minimum(lobe.mx, lobe.my), LARGEST_M / dr.maximum(lobe.mx, lobe.my))
        update |= {"mx": lobe.mx * scale, "my": lobe.my * scale}
    return lobe.model_copy(update=update)


def _half_angle(cos2: Any, sin2: Any) -> tuple[Any, Any]:
    """Cosine and sine of half the angle of (cos2, sin2), a vector shortened by interpolation."""
    length = dr.sqrt(cos2 * cos2 + sin2 * sin2)
    c2 = dr.select(length > 1e-6, cos2 / dr.maximum(length, 1e-6), 1.0)
    c, s = dr.safe_sqrt((1 + c2) / 2), dr.safe_sqrt((1 - c2) / 2)
    return c, dr.select(sin2 < 0, -s, s)


def faced_side(si: Any) -> tuple[Any, Any]:
    """The side of its triangle that the viewer sees, 1 or -1, and the least cosine of a normal to the viewer.

    The least cosine is the renderer's GRAZING, or the triangle's own if that is smaller, which keeps flat meshes
    unchanged.
    """
    towards = dr.dot(si.n, si.to_world(si.wi)) * dr.sign(dr.dot(si.n, si.sh_frame.n))
    seen = dr.select(towards == 0, si.wi.z, towards)
    return dr.select(seen < 0, -1.0, 1.0), dr.minimum(dr.abs(towards), GRAZING)


def bent(n: Any, wo: Any, side: Any, least: Any) -> Any:
    """A normal n on the +z side, bent to a cosine of at least `least` to the viewer wo, on the viewer's side."""
    n = n * side
    return dr.normalize(n + dr.maximum(least - dr.dot(n, wo), 0.0) * wo) * side


def facing_frame(tangent: tuple[Any, Any], si: Any) -> Any:
    """mi.Frame3f (t, b, n) within `si.sh_frame`, bent if a smooth normal faces away from a viewer in front."""
    c, s = tangent
    t, b, up = mi.Vector3f(c, s, 0.0), mi.Vector3f(-s, c, 0.0), mi.Vector3f(0.0, 0.0, 1.0)
    side, least = faced_side(si)
    n = bent(up, si.wi, side, least)
    along = dr.normalize(t - n * dr.dot(n, t))
    turned = side * si.wi.z < least
    return mi.Frame3f(
        dr.select(turned, along, t), dr.select(turned, dr.cross(n, along), b), dr.select(turned, n, up)
    )  # fmt: skip
