"""Clear glass: what it passes straight on is the albedo of its lobes of transmission."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.clear import MOST, MOST_TERMS, STRAIGHT, clear_terms, transmittance
from lambent.materials.document import Lobe, Material
from lambent.realtime.gpu.shader_source import assemble
from tests.tools.shader_parity import assert_parity, run_wgsl

SHEET = Lobe(side="transmission", mx=0.003, my=0.003, r0=0.04, k=(0.9, 0.5, 0.2), alpha=0.52, distribution="ggx")
MIRRORED = Lobe(mx=0.003, my=0.003, r0=0.08)


def passed(material: Material, degrees: float) -> np.ndarray:
    terms = clear_terms(material)
    assert terms is not None
    return np.array(transmittance(np.cos(np.radians(degrees)), terms))


@pytest.mark.parametrize("degrees", [0.0, 35.0, 60.0, 75.0])
@pytest.mark.parametrize(
    "lobes", [(SHEET, MIRRORED), (SHEET.model_copy(update={"alpha": 0.2, "distribution": "beckmann"}), SHEET)]
)
def test_passes_the_albedo_of_its_lobes(degrees: float, lobes: tuple[Lobe, ...]) -> None:
    through = Material(lobes=tuple(lobe for lobe in lobes if lobe.side == "transmission"))
    wo = np.array([np.sin(np.radians(degrees)), 0.0, np.cos(np.radians(degrees))])
    expected = MaterialBSDF(through).albedo(wo, 1 << 16)
    assert np.allclose(passed(Material(lobes=lobes), degrees), np.minimum(expected, MOST), rtol=0.01)


def test_bright_and_grazing_glass_stays_within_bounds() -> None:
    steep = Material(lobes=(SHEET.model_copy(update={"alpha": 1.0, "k": (1e3, 1.0, 0.0)}),))
    for degrees in (0.0, 89.0, 90.0, 180.0):
        value = passed(steep, degrees)
        assert np.isfinite(value).all() and value[0] == MOST and (value >= 0).all() and value[2] == 0


@pytest.mark.parametrize(
    "material",
    [
        Material(kd=0.5),
        Material(lobes=(MIRRORED,)),
        Material(lobes=(SHEET, SHEET.model_copy(update={"my": 2 * STRAIGHT}))),
        Material(lobes=(SHEET.model_copy(update={"k": (0.0, 0.0, 0.0)}),)),
        Material(kt_d=0.1, lobes=(SHEET,)),
        Material(lobes=(SHEET,) * 5),
    ],
)
def test_what_spreads_light_or_passes_none_is_not_clear(material: Material) -> None:
    assert clear_terms(material) is None


def test_shader_is_the_twin() -> None:
    lobes = tuple(SHEET.model_copy(update={"alpha": alpha, "k": (0.4, alpha, 0.1)}) for alpha in (0.0, 0.48, 0.52, 0.9))
    terms = clear_terms(Material(lobes=lobes))
    assert terms is not None
    cosine = np.append(np.linspace(0, 1, 200), 1e-6).astype(np.float32)
    rows = ", ".join(f"vec4f({', '.join(f'{x:.9g}' for x in row)})" for row in terms)
    got = run_wgsl(
        assemble("lobes.wgsl", "clear.wgsl"), "lambent_clear(cosine, TERMS)", {"cosine": cosine}, components=3,
        declarations=f"const TERMS = array<vec4f, {MOST_TERMS}>({rows});",
    )  # fmt: skip
    assert_parity(got, np.stack(transmittance(cosine.astype(float), terms), axis=-1).astype(np.float32), rtol=1e-4)
