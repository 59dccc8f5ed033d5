"""A material as MaterialX: a graph of nodes from the physically based library, one per term.

The sum of a `generalized_schlick_bsdf` per lobe of reflection, a `dielectric_bsdf` in mode T per lobe of transmission,
a rough diffuse of roughness 0 and a translucent node for the far side, on a thin-walled surface. Roughness is GGX's
alpha, not its root; its x axis is the tangent of the shape.

Sources: MaterialX Physically Based Shading Nodes 1.39; its GLSL closures for the Fresnel terms.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.files import write_text
from lambent.core.progress import Progress, silent
from lambent.materials.document import Lobe, Material
from lambent.materials.export import matching
from lambent.materials.export.contract import Cost, Kind, Subject
from lambent.materials.export.matching import Likeness, Part, Tool, material_of, rounded, shape_losses, three
from lambent.materials.export.resampling.resampled import Pairs
from lambent.materials.fresnel import ior_of, r0_of

NAME = "MaterialX"
ENDINGS = (".mtlx",)
TAKES: tuple[Kind, ...] = ("material",)
VERSION = "1.39"
F0_RANGE = (0.02, 0.25)  # of the thin wall; outside it renderers bend or lose the light


def write(subject: Subject, path: Path, progress: Progress = silent) -> Cost:
    """Write a .mtlx document with one surface material."""
    material = material_of(subject)
    found, cost = likeness(material, progress)
    write_text(path, document(material.name, found))
    return cost


def likeness(material: Material, progress: Progress = silent) -> tuple[Likeness, Cost]:
    """Parameters of the nodes closest to `material`, rounded as in the file, and their cost."""
    lost = shape_losses(material)
    if material.lobes:
        lost.append(
            "some renderers add light that rough facets lose (energy compensation); the errors do not include it"
        )
    if material.transmission_lobes:
        lost.append("lobes of transmission are those of a thin wall; a renderer without thin walls bends the light")
    return matching.likeness(material, TOOL, lost, progress)


def _eval(pairs: Pairs, part: Part) -> Floats:
    f = np.zeros((len(pairs), len(part.colour)))
    schlick = pairs.schlick[:, None]
    if part.lobe.side == "transmission":
        facets = pairs.facets(part.mx, part.my)[:, None]
        through = 1 - (_f0(part.lobe) + (1 - _f0(part.lobe)) * schlick)
        f[pairs.far] = (part.colour * through * facets)[pairs.far]
        return f
    colour90 = part.others**2
    near = ~pairs.far
    f[near] = ((part.colour + (colour90 - part.colour) * schlick) * pairs.facets(part.mx, part.my)[:, None])[near]
    return f


def _others(lobe: Lobe, channels: int) -> tuple[Floats, Floats, Floats]:
    """Start values of the roots of color90, with bounds."""
    return np.sqrt(np.clip(np.array(lobe.k)[:channels], 1e-4, 1)), np.zeros(channels), np.ones(channels)


def _colour_start(lobe: Lobe) -> Floats:
    r0 = np.array(lobe.r0)
    if lobe.side == "transmission":
        return np.asarray(np.array(lobe.k) * (1 - r0) / (1 - _f0(lobe)))
    return np.asarray(np.array(lobe.k) * r0)


def _f0(lobe: Lobe) -> float:
    """Reflectance of a transmission lobe's wall, from its rounded ior."""
    return r0_of(_ior(lobe))


def _ior(lobe: Lobe) -> float:
    return round(ior_of(np.clip(np.mean(lobe.r0), *F0_RANGE)), 6)


def _rounded_others(roots: Floats) -> Floats:
    return np.sqrt(rounded(roots**2))


TOOL = Tool(NAME, _eval, _others, _colour_start, 1.0, lambda lobe: "ggx", _rounded_others)


def document(name: str, found: Likeness) -> str:
    """The MaterialX document."""
    root = ET.Element("materialx", version=VERSION, colorspace="lin_rec709")
    names = []
    if any(found.kd) or not (any(found.kt_d) or found.parts):
        names.append(_node(root, "oren_nayar_diffuse_bsdf", "diffuse", color=three(found.kd), roughness=0.0))
    if any(found.kt_d):
        names.append(_node(root, "translucent_bsdf", "diffuse_transmission", color=three(found.kt_d)))
    for number, part in enumerate(found.parts, 1):
        names.append(_lobe_node(root, part, f"lobe_{number}"))
    total = names[0]
    for number, other in enumerate(names[1:], 1):
        add = ET.SubElement(root, "add", name=f"sum_{number}", type="BSDF")
        ET.SubElement(add, "input", name="in1", type="BSDF", nodename=total)
        ET.SubElement(add, "input", name="in2", type="BSDF", nodename=other)
        total = f"sum_{number}"
    surface = ET.SubElement(root, "surface", name="thin_sheet", type="surfaceshader")
    ET.SubElement(surface, "input", name="bsdf", type="BSDF", nodename=total)
    ET.SubElement(surface, "input", name="thin_walled", type="boolean", value="true")
    own = _identifier(name, {element.get("name", "") for element in root})
    surface_material = ET.SubElement(root, "surfacematerial", name=own, type="material")
    ET.SubElement(surface_material, "input", name="surfaceshader", type="surfaceshader", nodename="thin_sheet")
    ET.indent(root, "  ")
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _lobe_node(root: ET.Element, part: Part, name: str) -> str:
    roughness, colour = (part.mx, part.my), three(part.colour)
    if part.lobe.side == "transmission":
        return _node(root, "dielectric_bsdf", name, tint=colour, ior=_ior(part.lobe), roughness=roughness, mode="T")
    colours = {"color0": colour, "color90": three(part.others**2)}
    return _node(root, "generalized_schlick_bsdf", name, **colours, exponent=5.0, roughness=roughness, mode="R")


def _node(root: ET.Element, kind: str, name: str, **inputs: float | str | tuple[float, ...]) -> str:
    """Append a BSDF node; an input's type follows from its number of values."""
    node = ET.SubElement(root, kind, name=name, type="BSDF")
    for key, value in inputs.items():
        if isinstance(value, str):
            ET.SubElement(node, "input", name="scatter_mode", type="string", value=value)
        elif isinstance(value, tuple):
            kind_of = {2: "vector2", 3: "color3"}[len(value)]
            ET.SubElement(node, "input", name=key, type=kind_of, value=", ".join(f"{v:.7g}" for v in value))
        else:
            ET.SubElement(node, "input", name=key, type="float", value=f"{value:.7g}")
    return name


def _identifier(name: str, taken: set[str]) -> str:
    """A MaterialX name: ASCII letters, digits and underscores, no digit in front, not taken."""
    plain = "".join(c if c.isascii() and c.isalnum() else "_" for c in name) or "material"
    plain = f"_{plain}" if plain[0].isdigit() else plain
    while plain in taken:
        plain += "_"
    return plain
