"""A material as a Mitsuba 3 scene that plain Mitsuba loads: a sphere that wears the nearest sum of its own BSDFs.

Reflection is `diffuse` and one `roughconductor` per lobe, with our distribution (Beckmann stays Beckmann); transmission
is `principledthin`, which is diffuse, or rough without bending. Mitsuba has no sum of BSDFs, only `blendbsdf`; so each
part has its share of the blend as weight, and its colour divided by it. Such colours may exceed 1 where the sum does
not, which Mitsuba takes of an `srgb` texture that says `unbounded`.

The exact material stands in a comment, for where Lambent is installed: `register_material_plugin()` first.

Sources: Mitsuba's manual; Burley 2015, Extending the Disney BRDF (the thin sheet and its scaled roughness). Known
fault of `principledthin`: at oblique incidence it cuts off the far tail of its transmission lobe; it is counted here.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.directions import Floats
from lambent.core.files import write_text
from lambent.core.progress import Progress, silent
from lambent.materials.document import Lobe, Material
from lambent.materials.export import sums
from lambent.materials.export.contract import Cost, Kind, Subject
from lambent.materials.export.match import brightness, material_of, shape_losses, three
from lambent.materials.export.pairs import Pairs
from lambent.materials.export.sums import Likeness, Part, Tool

NAME = "Mitsuba 3 scene"
ENDINGS = (".xml",)
TAKES: tuple[Kind, ...] = ("material",)
VERSION = "3.0.0"
ETA_RANGE, KAPPA_RANGE = (1.0, 12.0), (0.0, 12.0)
COLOUR_MAX = 4.0  # of a part before its share is divided out
THIN_ETA = 1.0001  # so near 1 that the sheet itself reflects nothing: reflection has lobes of its own
LEAST_SHARE = 0.05  # of the blend, so that no part is sampled too rarely


def write(subject: Subject, path: Path, progress: Progress = silent) -> Cost:
    """Write a scene of a sphere, a light and a camera; the BSDF has the id `material`."""
    material = material_of(subject)
    found, cost = likeness(material, progress)
    write_text(path, document(material, found))
    return cost


def likeness(material: Material, progress: Progress = silent) -> tuple[Likeness, Cost]:
    """The parts that look most like `material`, rounded as they are written, and what they cost."""
    lost = shape_losses(material, beckmann_kept=True)
    lost = [
        line.replace("Smith's masking stands", "Smith's masking and a conductor's Fresnel term stand") for line in lost
    ]
    if any(lobe.distribution == "beckmann" for lobe in material.transmission_lobes):
        lost.append("Beckmann lobes of transmission became GGX lobes, whose tails are longer")
    return sums.likeness(material, TOOL, lost, _rounded, progress)


def _eval(pairs: Pairs, part: Part) -> Floats:
    f = np.zeros((len(pairs), len(part.colour)))
    if part.lobe.side == "transmission":
        facets = pairs.facets(part.mx, part.my, "separable", "ggx")
        cut = pairs.wi[0] * pairs.h[0] + pairs.wi[1] * pairs.h[1] >= pairs.wi[2] * pairs.h[2]
        shown = pairs.far & ~cut
        f[shown] = (part.colour * facets[:, None])[shown]
        return f
    eta, kappa = (float(v) for v in part.others)
    facets = pairs.facets(part.mx, part.my, "separable", part.lobe.distribution)
    near = ~pairs.far
    f[near] = (part.colour * (conductor(pairs.cos_d, eta, kappa) * facets)[:, None])[near]
    return f


def conductor(cos_d: Floats, eta: float, kappa: float) -> Floats:
    """Fresnel reflectance (N,) of unpolarised light at a conductor of index eta - i kappa (Born & Wolf, 14.2)."""
    cos2 = cos_d * cos_d
    sin2 = 1 - cos2
    t0 = eta * eta - kappa * kappa - sin2
    a2b2 = np.sqrt(t0 * t0 + 4 * eta * eta * kappa * kappa)
    a = np.sqrt(np.maximum((a2b2 + t0) / 2, 0))
    s = (a2b2 + cos2 - 2 * a * cos_d) / (a2b2 + cos2 + 2 * a * cos_d)
    t1, t2 = a2b2 * cos2 + sin2 * sin2, 2 * a * cos_d * sin2
    return np.asarray((s + s * (t1 - t2) / (t1 + t2)) / 2)


def _others(lobe: Lobe, channels: int) -> tuple[Floats, Floats, Floats]:
    """eta and kappa; a lobe of transmission has none."""
    if lobe.side == "transmission":
        return np.zeros(0), np.zeros(0), np.zeros(0)
    root = np.sqrt(np.clip(np.mean(lobe.r0), 0.001, 0.7))
    low, high = zip(ETA_RANGE, KAPPA_RANGE, strict=True)
    return np.array([(1 + root) / (1 - root), 0.5]), np.array(low), np.array(high)


def _colour_start(lobe: Lobe) -> Floats:
    k, r0 = np.array(lobe.k), np.array(lobe.r0)
    return np.asarray(k * (1 - r0) if lobe.side == "transmission" else k * r0 / max(float(r0.mean()), 1e-3))


def _rounded(part: Part) -> Part:
    colour = np.array(three(part.colour))[: len(part.colour)]
    return replace(part, mx=round(part.mx, 6), my=round(part.my, 6), colour=colour, others=np.round(part.others, 6))


TOOL = Tool(
    NAME,
    _eval,
    _others,
    _colour_start,
    COLOUR_MAX,
    lambda lobe: lobe.distribution if lobe.side == "reflection" else "ggx",
)


def document(material: Material, found: Likeness) -> str:
    """The scene as XML."""
    scene = ET.Element("scene", version=VERSION)
    ET.SubElement(scene, "integrator", type="path")
    scene.append(_exact(material))
    bsdf = _bsdf(found)
    bsdf.set("id", "material")
    scene.append(bsdf)
    ball = ET.SubElement(scene, "shape", type="sphere")
    ET.SubElement(ball, "ref", name="bsdf", id="material")
    transform = ET.SubElement(ball, "transform", name="to_world")
    ET.SubElement(transform, "rotate", x="1", angle="-90")  # the pole upwards: brushed along circles of latitude
    behind = -1 if material.transmits else 1
    for position, radius, radiance in ((f"3, 4, {4 * behind}", "0.6", 60.0), ("-4, 1, 4", "0.8", 8.0)):
        lamp = ET.SubElement(scene, "shape", type="sphere")
        ET.SubElement(lamp, "point", name="center", value=position)
        ET.SubElement(lamp, "float", name="radius", value=radius)
        ET.SubElement(ET.SubElement(lamp, "emitter", type="area"), "rgb", name="radiance", value=f"{radiance:g}")
    ET.SubElement(ET.SubElement(scene, "emitter", type="constant"), "rgb", name="radiance", value="0.3")
    sensor = ET.SubElement(scene, "sensor", type="perspective")
    ET.SubElement(sensor, "float", name="fov", value="28")
    transform = ET.SubElement(sensor, "transform", name="to_world")
    ET.SubElement(transform, "lookat", origin="0, 1, 5", target="0, 0, 0", up="0, 1, 0")
    film = ET.SubElement(sensor, "film", type="hdrfilm")
    for name in ("width", "height"):
        ET.SubElement(film, "integer", name=name, value="512")
    ET.SubElement(ET.SubElement(sensor, "sampler", type="independent"), "integer", name="sample_count", value="128")
    ET.indent(scene, "  ")
    return ET.tostring(scene, encoding="unicode") + "\n"


def _exact(material: Material) -> Any:
    """Comment with the exact BSDF, and how to use it."""
    bsdf = ET.Element("bsdf", type="lambent_material", id="material")
    exact = material.model_dump_json(exclude={"name", "provenance"})
    ET.SubElement(bsdf, "string", name="material", value=exact)
    text = ET.tostring(bsdf, encoding="unicode")
    return ET.Comment(
        " Below is an approximation that every Mitsuba loads. Exact, where Lambent is installed: this in its place,\n"
        "  after `from lambent.bake.material_plugin import register_material_plugin; register_material_plugin()`.\n"
        f"  {text}\n  "
    )


def _bsdf(found: Likeness) -> ET.Element:
    """All parts: reflection in one two-sided blend, each part of transmission beside it."""
    reflected = [(part, brightness(part.lobe)) for part in found.parts if part.lobe.side == "reflection"]
    passed = [(part, brightness(part.lobe)) for part in found.parts if part.lobe.side == "transmission"]
    near: list[tuple[Part | str, float]] = [*reflected]
    far: list[tuple[Part | str, float]] = [*passed]
    if any(found.kd) or not (near or far or any(found.kt_d)):
        near.append(("diffuse", float(np.mean(found.kd))))
    if any(found.kt_d):
        far.append(("diffuse", float(np.mean(found.kt_d))))
    shares = _shares([share for _, share in [*near, *far]])
    leaves_near = [(_near(found, part, share), share) for (part, _), share in zip(near, shares, strict=False)]
    leaves_far = [(_far(found, part, share), share) for (part, _), share in zip(far, shares[len(near) :], strict=True)]
    if leaves_near:
        both = ET.Element("bsdf", type="twosided")
        both.append(_blend(leaves_near))
        leaves_far.insert(0, (both, sum(share for _, share in leaves_near)))
    return _blend(leaves_far)


def _shares(sizes: Sequence[float]) -> list[float]:
    """Shares of the blend, rounded to what is written; they sum to 1."""
    raised = np.maximum(np.array(sizes) / max(sum(sizes), 1e-9), LEAST_SHARE)
    shares = [round(float(share), 4) for share in raised / raised.sum()]
    return [*shares[:-1], round(1 - sum(shares[:-1]), 4)]


def _blend(leaves: list[tuple[ET.Element, float]]) -> ET.Element:
    """The leaves, each at its share of the sum of shares."""
    (first, share), *rest = leaves
    if not rest:
        return first
    blend = ET.Element("bsdf", type="blendbsdf")
    total = sum(share for _, share in leaves)
    ET.SubElement(blend, "float", name="weight", value=repr(1 - share / total))
    blend.append(first)
    blend.append(_blend(rest))
    return blend


def _near(found: Likeness, part: Part | str, share: float) -> ET.Element:
    if isinstance(part, str):
        bsdf = ET.Element("bsdf", type="diffuse")
        bsdf.append(_colour("reflectance", found.kd / share))
        return bsdf
    bsdf = ET.Element("bsdf", type="roughconductor")
    ET.SubElement(bsdf, "string", name="distribution", value=part.lobe.distribution)
    ET.SubElement(bsdf, "float", name="alpha_u", value=repr(part.mx))
    ET.SubElement(bsdf, "float", name="alpha_v", value=repr(part.my))
    for name, value in zip(("eta", "k"), part.others, strict=True):
        ET.SubElement(bsdf, "spectrum", name=name, value=repr(float(value)))
    bsdf.append(_colour("specular_reflectance", part.colour / share))
    return bsdf


def _far(found: Likeness, part: Part | str, share: float) -> ET.Element:
    bsdf = ET.Element("bsdf", type="principledthin")
    ET.SubElement(bsdf, "float", name="eta", value=repr(THIN_ETA))
    if isinstance(part, str):
        ET.SubElement(bsdf, "float", name="diff_trans", value="2")
        bsdf.append(_colour("base_color", found.kt_d / share))
        return bsdf
    aspect2 = part.my / part.mx
    roughness = (part.mx * part.my) ** 0.25 / (0.65 * THIN_ETA - 0.35)
    ET.SubElement(bsdf, "float", name="spec_trans", value="1")
    ET.SubElement(bsdf, "float", name="roughness", value=repr(roughness))
    if aspect2 != 1:
        ET.SubElement(bsdf, "float", name="anisotropic", value=repr((1 - aspect2) / 0.9))
    bsdf.append(_colour("base_color", part.colour / share))
    return bsdf


def _colour(name: str, values: Floats) -> ET.Element:
    texture = ET.Element("texture", type="srgb", name=name)
    rgb = " ".join(repr(float(v)) for v in np.broadcast_to(values, 3))
    ET.SubElement(texture, "rgb", name="color", value=rgb)
    ET.SubElement(texture, "boolean", name="unbounded", value="true")
    return texture
