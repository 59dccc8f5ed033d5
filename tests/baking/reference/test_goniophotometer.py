"""The virtual gonio-photometer measures what the path tracer renders."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.reference.goniophotometer import SPECIMENS, measure
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.synthetic import ANISOTROPIC, ISOTROPIC
from lambent.materials.measured.parts.gonio_text import GonioTable, write_gonio

COARSE = replace(ISOTROPIC, step_deg=5, fine_deg=2.5, floor=0.0)
WI = direction(np.radians([5, 33, 61]), 0.0)


def test_diffuse_is_its_albedo() -> None:
    grey = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.2, 0.5, 0.8]}}
    table = measure(grey, incident=COARSE, noise=0)
    samples = table.samples()
    np.testing.assert_allclose(
        samples.f, np.broadcast_to(np.array([0.2, 0.5, 0.8]) / np.pi, samples.f.shape), rtol=1e-5
    )
    assert table.info.isotropic and not table.info.transmits


@pytest.fixture(scope="module")
def tables() -> dict[str, GonioTable]:
    """Every specimen without noise."""
    brushed = replace(ANISOTROPIC, step_deg=7.5, fine_deg=2.5)
    return {name: measure(name, incident=brushed if "brushed" in name else COARSE, noise=0) for name in SPECIMENS}


@pytest.mark.long
def test_specimens_are_measured_and_written(tables: dict[str, GonioTable], tmp_path: Path) -> None:
    transmits = {"rough copper": False, "brushed aluminium": False, "varnished wood": False, "frosted glass": True}
    assert {name: table.info.transmits for name, table in tables.items()} == transmits
    for table in tables.values():
        albedo = table.albedo(WI)
        assert ((albedo > 0.05) & (albedo < 1)).all()
        write_gonio(tmp_path / "a.txt", table)
        np.testing.assert_allclose(load(tmp_path / "a.txt").albedo(WI), albedo, rtol=1e-4)


@pytest.mark.parametrize(("name", "part"), [("rough copper", "reflected"), ("frosted glass", "transmitted")])
def test_peaks_stand_at_the_mirror_direction_and_straight_on(
    tables: dict[str, GonioTable], name: str, part: str
) -> None:
    sheet = getattr(tables[name], part)[3][0]
    theta, phi = np.unravel_index(np.nanargmax(sheet.f[..., 0]), sheet.f.shape[:2])
    assert abs(sheet.theta_deg[theta] - 33) < 8 and abs(sheet.phi_deg[phi] - 180) < 3
    if part == "transmitted":
        assert (tables[name].transmissivity(WI) > 2 * tables[name].reflectivity(WI)).all()


def test_brushed_aluminium_is_anisotropic(tables: dict[str, GonioTable]) -> None:
    table, normal = tables["brushed aluminium"], np.array([0, 0, 1.0])
    assert not table.info.isotropic
    along, across = direction(np.radians(10), 0.0), direction(np.radians(10), np.pi / 2)
    assert (table.eval(normal, across) > 3 * table.eval(normal, along)).all()


def test_noise_follows_the_seed() -> None:
    grey = Material(kd=0.5)
    first, again, other = (measure(grey, incident=COARSE, seed=seed).samples().f for seed in (0, 0, 1))
    np.testing.assert_array_equal(first, again)
    assert (first != other).mean() > 0.99


def test_a_material_document_needs_no_path_tracer() -> None:
    material = Material(name="m", kd=(0.1, 0.2, 0.3), lobes=(Lobe(mx=0.3, my=0.3),))
    table = measure(material, incident=COARSE, noise=0, name="named")
    samples = table.samples()
    np.testing.assert_allclose(samples.f, MaterialBSDF(material).eval(samples.wi, samples.wo), rtol=1e-9)
    assert table.name == "named"


@pytest.mark.parametrize(
    ("specimen", "expected"),
    [
        ({"type": "conductor"}, "cannot be measured"),
        ({"type": "no such bsdf"}, "not a BSDF that Mitsuba can load"),
        ({"type": "sphere"}, "is not a BSDF"),
        ("gold", "unknown specimen"),
    ],
)
def test_what_cannot_be_measured(specimen: object, expected: str) -> None:
    with pytest.raises(UserError, match=expected):
        measure(specimen)
