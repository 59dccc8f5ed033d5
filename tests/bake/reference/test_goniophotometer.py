"""The virtual gonio-photometer measures what the path tracer renders."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.bake.reference.goniophotometer import SPECIMENS, measure
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.synthetic import ANISOTROPIC, ISOTROPIC
from lambent.materials.measured.parts.gonio_text import write_gonio

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


def test_the_highlight_stands_at_the_mirror_direction() -> None:
    sheet = measure("rough copper", incident=COARSE, noise=0).reflected[3][0]
    theta, phi = np.unravel_index(np.nanargmax(sheet.f[..., 0]), sheet.f.shape[:2])
    assert abs(sheet.theta_deg[theta] - 33) < 6 and abs(sheet.phi_deg[phi] - 180) < 3


def test_specimens(tmp_path: Path) -> None:
    expected = {"rough copper": False, "brushed aluminium": False, "varnished wood": False, "frosted glass": True}
    assert set(SPECIMENS) == set(expected)
    for name, transmits in expected.items():
        setup = replace(ANISOTROPIC, step_deg=7.5, fine_deg=2.5) if "brushed" in name else COARSE
        table = measure(name, incident=setup)
        assert table.info.transmits == transmits
        albedo = table.albedo(WI)
        assert ((albedo > 0.05) & (albedo < 1)).all()
        path = tmp_path / "a.txt"
        write_gonio(path, table)
        np.testing.assert_allclose(load(path).albedo(WI), albedo, rtol=1e-4)


def test_glass_scatters_forward_about_the_straight_direction() -> None:
    table = measure("frosted glass", incident=COARSE, noise=0)
    assert (table.transmissivity(WI) > 2 * table.reflectivity(WI)).all()
    sheet = table.transmitted[3][0]
    theta, phi = np.unravel_index(np.nanargmax(sheet.f[..., 0]), sheet.f.shape[:2])
    assert abs(sheet.theta_deg[theta] - 33) < 8 and abs(sheet.phi_deg[phi] - 180) < 3


def test_brushed_aluminium_is_anisotropic() -> None:
    table = measure("brushed aluminium", incident=replace(ANISOTROPIC, step_deg=5, fine_deg=2.5), noise=0)
    assert not table.info.isotropic
    along, across = direction(np.radians(10), 0.0), direction(np.radians(10), np.pi / 2)
    normal = np.array([0, 0, 1.0])
    assert (table.eval(normal, across) > 3 * table.eval(normal, along)).all()


def test_noise_follows_the_seed() -> None:
    first, again, other = (measure("rough copper", incident=COARSE, seed=seed).samples().f for seed in (0, 0, 1))
    np.testing.assert_array_equal(first, again)
    pairs = first[: len(other)], other[: len(first)]
    lit = pairs[0] > 0.01  # in the tails both read nothing
    assert (pairs[0] != pairs[1])[lit].mean() > 0.99


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
        ({"type": "dielectric"}, "cannot be measured"),
        ({"type": "plastic"}, "cannot be measured"),
        ({"type": "no such bsdf"}, "not a BSDF that Mitsuba can load"),
        ({"type": "diffuse", "reflectance": "red"}, "not a BSDF that Mitsuba can load"),
        ({"type": "sphere"}, "is not a BSDF"),
        ("gold", "unknown specimen"),
    ],
)
def test_what_cannot_be_measured(specimen: object, expected: str) -> None:
    with pytest.raises(UserError, match=expected):
        measure(specimen)
