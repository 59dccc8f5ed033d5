"""The inspection names the content of a table and its faults."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import ENERGY_TOLERANCE
from lambent.materials.checking.check_table import _warnings, albedos
from lambent.materials.document import Material
from lambent.materials.fitting.account import _energy
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.inspection import inspect_table
from lambent.materials.measured.inspecting.synthetic import ISOTROPIC
from lambent.materials.measured.protocol import MeasuredSamples, MeasuredTable, TableInfo, collect

CLEAN = replace(ISOTROPIC, noise=0.0, floor=0.0, theta_i_deg=tuple(range(0, 80, 5)), sector_deg=0.0)


def test_every_format_and_json(files: dict[str, Path]) -> None:
    for path in files.values():
        report = inspect_table(load(path))
        assert json.loads(json.dumps(report)) == report
        assert report["symmetry"] == "isotropic" and report["tuples"]["used"] > 0


def test_real_files(shared_data: Path) -> None:
    faults = inspect_table(load(shared_data / "measured" / "rgl" / "cc_ibiza_sunset_rgb.bsdf"))["faults"]
    assert 3 < faults["non_reciprocal_percent"] < 25 and faults["negative_percent"] > 1


@pytest.mark.parametrize(("excess", "warned"), [(8e-10, False), (0.9, False), (1.1, True)])
def test_only_more_than_the_tolerance_is_more_than_arrives(excess: float, warned: bool) -> None:
    """`excess` over 1 in units of the tolerance, but for the first, which is rounding."""
    albedo = 1 + (excess if excess < 1e-6 else excess * ENERGY_TOLERANCE)

    class White(MeasuredTable):
        info = TableInfo("white", "made up", True, False, 1, "f")

        def eval(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
            return np.full((*np.broadcast_shapes(wi.shape, wo.shape)[:-1], 1), albedo / np.pi)

        def reflectivity(self, wi: np.ndarray) -> np.ndarray:
            return np.full((*wi.shape[:-1], 1), albedo)

        def samples(self, max_count: int | None = None) -> MeasuredSamples:
            wi, wo = (direction(np.linspace(0, 1.2, 40), phi) for phi in (0.0, np.pi))
            f = self.eval(wi, wo)
            return collect(wi, wo, f, np.ones(len(f)), self.info, np.zeros(len(f), dtype=bool))

    report = inspect_table(White())
    assert report["faults"]["energy_above_one"] is warned
    assert any("more than arrives" in line for line in report["findings"]) is warned
    furnace = albedos(White())
    assert any("more than arrives" in line or "measured well" in line for line in _warnings(0.0, furnace)) is warned
    document = Material(kd=albedo)
    assert any("more light than it receives" in line for line in _energy(document)) is warned
