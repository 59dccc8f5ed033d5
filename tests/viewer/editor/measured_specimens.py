"""Materials and measurements of them, made in memory and written as gonio text, for the tests of the editor."""

from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.inspecting.synthetic import Setup, record
from lambent.materials.measured.parts.gonio_text import write_gonio

BRASS = Material(
    name="brass", kd=(0.05, 0.04, 0.03), lobes=(Lobe(mx=0.15, my=0.15, r0=(0.6, 0.6, 0.6), k=(0.9, 0.8, 0.5)),)
)
BRUSHED = Material(name="brushed", kd=0.04, lobes=(Lobe(mx=0.08, my=0.3, r0=0.7),))
FROSTED = Material(
    name="frosted", kd=0.1, kt_d=(0.2, 0.15, 0.1),
    lobes=(Lobe(mx=0.2, my=0.2), Lobe(side="transmission", mx=0.25, my=0.25, r0=0.0, k=0.5)),
)  # fmt: skip
FEW = Setup((0, 20, 45, 65), step_deg=6.0, fine_deg=3.0, noise=0.0, floor=0.0)
TURNED = Setup((0, 30, 60), (0, 45, 90), "quadrant", step_deg=8.0, fine_deg=4.0, noise=0.0, floor=0.0)


def write_measurement(path, material, setup=FEW):
    table = record(MaterialBSDF(material).eval, material.name, setup, transmits=material.transmits)
    write_gonio(path, table)
    return path
