"""A material as a scene that plain Mitsuba 3 loads: a sphere with the closest sum of Mitsuba's own BSDFs.

Reflection is `diffuse` and one `roughconductor` per lobe, with the lobe's distribution (Beckmann stays Beckmann);
transmission is `principledthin`, which is diffuse, or rough without refraction. Mitsuba cannot add BSDFs, only blend
them (`blendbsdf`), so each part's colour is divided by its weight in the blend. Such a colour may exceed 1 although the
sum does not; Mitsuba accepts it in an `srgb` texture that is `unbounded`.

A comment holds the exact material, for use where Lambent is installed, after `register_material_plugin()`.

Sources: Mitsuba's manual; Burley 2015, Extending the Disney BRDF (the thin sheet and its scaled roughness).
Known fault of `principledthin`, which the match includes: at oblique incidence it cuts off the far tail of its
transmission lobe.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.files import write_text
from lambent.core.progress import Progress, silent
from lambent.materials.document import Distribution, Lobe, Material
from lambent.materials.export import matching
from lambent.materials.export.contract import Cost, Kind, Subject
from lambent.materials.export.matching import Likeness, Part, Tool, brightness, material_of, rounded, shape_losses
from lambent.materials.export.resampling.resampled import Pairs
from lambent.materials.fresnel import conductor, ior_of

NAME = "Mitsuba 3 scene"
ENDINGS = (".xml",)
TAKES: tuple[Kind, ...] = ("material",)
ETA_RANGE, KAPPA_RANGE = (1.0, 12.0), (0.0, 12.0)
COLOUR_MAX = 4.0  # largest colour of a part before division by its weight
THIN_ETA = 1.0001  # near 1, so that the sheet itself does not reflect: reflection has its own lobes
LEAST_SHARE = 0.05  # of the blend, so that no part is sampled too rarely


def write(subject: Subject, path: Path, progress: Progress = silent) -> Cost:
    """Write a scene of a sphere, a light and a camera; the BSDF has the id `material`."""
    material = material_of(subject)
    found, cost = likeness(material, progress)
    write_text(path, document(material, found))
    return cost


def likeness(material: Material, progress: Progress = silent) -> tuple[Likeness, Cost]:
    """The parts closest to `material`, rounded as in the file, and their cost."""
    masking, with_fresnel = "Smith's masking", "Smith's masking and a conductor's Fresnel term"
    lost = [line.replace(masking, with_fresnel) for line in shape_losses(material, beckmann_kept=True)]
    if any(lobe.distribution == "beckmann" for lobe in material.transmission_lobes):
        lost.append("Beckmann lobes of transmission became GGX lobes, whose tails are longer")
    return matching.likeness(material, TOOL, lost, progress)


def _eval(pairs: Pairs, part: Part) -> Floats:
    f = np.zeros((len(pairs), len(part.colour)))
    if part.lobe.side == "transmission":
        facets = pairs.facets(part.mx, part.my, "separable", "ggx")
        cut = pairs.wi[0] * pairs.h[0] + pairs.wi[1] * pairs.h[1] >= pairs.wi[2] * pairs.h[2]
        shown = pairs.far & ~cut
        f[shown] = (part.colour * facets[:, None])[shown]
        return f
    eta, kappa = (float(v) for v in part.others)
    facets = pairs.facets(part.mx, part.my, "separable", _distribution(part.lobe))
    near = ~pairs.far
    f[near] = (part.colour * (conductor(pairs.cos_d, eta, kappa) * facets)[:, None])[near]
    return f


def _others(lobe: Lobe, channels: int) -> tuple[Floats, Floats, Floats]:
    """Start values of eta and kappa, with bounds."""
    low, high = zip(ETA_RANGE, KAPPA_RANGE, strict=True)
    return np.array([ior_of(np.clip(np.mean(lobe.r0), 0.001, 0.7)), 0.5]), np.array(low), np.array(high)


def _colour_start(lobe: Lobe) -> Floats:
    k, r0 = np.array(lobe.k), np.array(lobe.r0)
    return np.asarray(k * (1 - r0) if lobe.side == "transmission" else k * r0 / max(float(r0.mean()), 1e-3))


def _distribution(lobe: Lobe) -> Distribution:
    return "beckmann" if lobe.distribution == "beckmann" and lobe.side == "reflection" else "ggx"


TOOL = Tool(NAME, _eval, _others, _colour_start, COLOUR_MAX, _distribution, rounded)


_SCENE = """<scene version="3.0.0">
  <integrator type="path" />
  <shape type="sphere">
    <ref name="bsdf" id="material" /><transform name="to_world"><rotate x="1" angle="-90" /></transform>
  </shape>
  <shape type="sphere">
    <point name="center" value="3, 4, {behind}" /><float name="radius" value="0.6" />
    <emitter type="area"><rgb name="radiance" value="60" /></emitter>
  </shape>
  <shape type="sphere">
    <point name="center" value="-4, 1, 4" /><float name="radius" value="0.8" />
    <emitter type="area"><rgb name="radiance" value="8" /></emitter>
  </shape>
  <emitter type="constant"><rgb name="radiance" value="0.3" /></emitter>
  <sensor type="perspective">
    <float name="fov" value="28" />
    <transform name="to_world"><lookat origin="0, 1, 5" target="0, 0, 0" up="0, 1, 0" /></transform>
    <film type="hdrfilm"><integer name="width" value="512" /><integer name="height" value="512" /></film>
    <sampler type="independent"><integer name="sample_count" value="128" /></sampler>
  </sensor>
</scene>"""  # the ball's pole is up: brushed along circles of latitude


def document(material: Material, found: Likeness) -> str:
    """The scene as XML; for a material that transmits, the light is behind the ball."""
    scene = ET.fromstring(_SCENE.format(behind=-4 if material.transmits else 4))
    bsdf = _bsdf(found)
    bsdf.set("id", "material")
    scene.insert(1, _exact(material))
    scene.insert(2, bsdf)
    ET.indent(scene, "  ")
    return ET.tostring(scene, encoding="unicode") + "\n"


def _exact(material: Material) -> Any:
    """A comment with the exact BSDF and instructions."""
    bsdf = ET.Element("bsdf", type="lambent_material", id="material")
    exact = material.model_dump_json(exclude={"name", "provenance"})
    ET.SubElement(bsdf, "string", name="material", value=exact)
    text = ET.tostring(bsdf, encoding="unicode")
    return ET.Comment(
        " Below is an approximation for every Mitsuba. Exact, where Lambent is installed: this in its place, after\n"
        "  `from lambent.baking.bsdfs.material_plugin import register_material_plugin; register_material_plugin()`.\n"
        f"  {text}\n  "
    )


def _bsdf(found: Likeness) -> ET.Element:
    """All parts: reflection in one two-sided blend, combined with each part of transmission."""
    near: list[Part | None] = [part for part in found.parts if part.lobe.side == "reflection"]
    far: list[Part | None] = [part for part in found.parts if part.lobe.side == "transmission"]
    if any(found.kd) or not (near or far or any(found.kt_d)):
        near.append(None)
    if any(found.kt_d):
        far.append(None)
    diffuse = [found.kd] * len(near) + [found.kt_d] * len(far)
    parts = zip([*near, *far], diffuse, strict=True)
    shares = _shares([float(np.mean(kd)) if part is None else brightness(part.lobe) for part, kd in parts])
    leaves_near = [(_near(found, part, share), share) for part, share in zip(near, shares, strict=False)]
    leaves_far = [(_far(found, part, share), share) for part, share in zip(far, shares[len(near) :], strict=True)]
    if leaves_near:
        leaves_far.insert(0, (_made("twosided", _blend(leaves_near)), sum(share for _, share in leaves_near)))
    return _blend(leaves_far)


def _shares(sizes: Sequence[float]) -> list[float]:
    """Weights of the blend, rounded as in the file; they sum to 1."""
    raised = np.maximum(np.array(sizes) / max(sum(sizes), 1e-9), LEAST_SHARE)
    shares = [round(float(share), 4) for share in raised / raised.sum()]
    return [*shares[:-1], round(1 - sum(shares[:-1]), 4)]


def _blend(leaves: list[tuple[ET.Element, float]]) -> ET.Element:
    """Blend the leaves, each weighted by its share."""
    (first, share), *rest = leaves
    total = sum(share for _, share in leaves)
    return _made("blendbsdf", ("float", "weight", 1 - share / total), first, _blend(rest)) if rest else first


def _near(found: Likeness, part: Part | None, share: float) -> ET.Element:
    """The BSDF of a part of reflection, or of the diffuse term."""
    if part is None:
        return _made("diffuse", _colour("reflectance", found.kd / share))
    return _made(
        "roughconductor",
        ("string", "distribution", _distribution(part.lobe)),
        ("float", "alpha_u", part.mx),
        ("float", "alpha_v", part.my),
        *(("spectrum", name, float(value)) for name, value in zip(("eta", "k"), part.others, strict=True)),
        _colour("specular_reflectance", part.colour / share),
    )


def _far(found: Likeness, part: Part | None, share: float) -> ET.Element:
    """The BSDF of a part of transmission, or of the diffuse term."""
    eta = ("float", "eta", THIN_ETA)
    if part is None:
        return _made("principledthin", eta, ("float", "diff_trans", "2"), _colour("base_color", found.kt_d / share))
    aspect2 = part.my / part.mx
    roughness = (part.mx * part.my) ** 0.25 / (0.65 * THIN_ETA - 0.35)
    anisotropic = [("float", "anisotropic", (1 - aspect2) / 0.9)] if aspect2 != 1 else []
    rough = [("float", "spec_trans", "1"), ("float", "roughness", roughness), *anisotropic]
    return _made("principledthin", eta, *rough, _colour("base_color", part.colour / share))


def _made(kind: str, *children: ET.Element | tuple[str, str, str | float]) -> ET.Element:
    """A BSDF of this type with its children: elements, or (tag, name, value) of a parameter."""
    bsdf = ET.Element("bsdf", type=kind)
    for child in children:
        if isinstance(child, tuple):
            tag, name, value = child
            ET.SubElement(bsdf, tag, name=name, value=value if isinstance(value, str) else repr(value))
        else:
            bsdf.append(child)
    return bsdf


def _colour(name: str, values: Floats) -> ET.Element:
    texture = ET.Element("texture", type="srgb", name=name)
    rgb = " ".join(repr(float(v)) for v in np.broadcast_to(values, 3))
    ET.SubElement(texture, "rgb", name="color", value=rgb)
    ET.SubElement(texture, "boolean", name="unbounded", value="true")
    return texture
