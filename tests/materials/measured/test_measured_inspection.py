"""The inspection names the content of a table and its faults."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.materials.measured import load
from lambent.materials.measured.inspection import inspect_table
from lambent.materials.measured.synthetic import ISOTROPIC, record, synthesise
from tests.materials.measured.measured_files import GLOSSY

CLEAN = replace(ISOTROPIC, noise=0.0, floor=0.0, theta_i_deg=tuple(range(0, 80, 5)), sector_deg=0.0)


def test_every_format_and_json(files: dict[str, Path]) -> None:
    for path in files.values():
        report = inspect_table(load(path))
        assert json.loads(json.dumps(report)) == report
        assert report["symmetry"] == "isotropic" and report["tuples"]["used"] > 0


def test_a_sound_table_has_no_faults() -> None:
    faults = inspect_table(synthesise(GLOSSY, CLEAN))["faults"]
    assert faults["non_reciprocal_percent"] < 2 and faults["not_measured_percent"] == 0
    assert not faults["energy_above_one"] and 0.3 < faults["albedo_max"] < 1


def test_faults_are_found() -> None:
    def lopsided(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return (0.2 + wi[:, 2:]) * np.ones(1)

    report = inspect_table(record(lopsided, "lopsided", replace(CLEAN, sector_deg=10.0, floor=0.4)))
    faults = report["faults"]
    assert faults["energy_above_one"] and faults["albedo_max"] == pytest.approx(1.2 * np.pi, rel=0.1)
    assert faults["non_reciprocal_percent"] > 10 and faults["negative_percent"] > 1
    assert faults["not_measured_percent"] > 0.3
    assert np.shape(report["albedo"]["reflectivity"]) == (6, 1)


def test_real_files(shared_data: Path) -> None:
    faults = inspect_table(load(shared_data / "measured" / "rgl" / "cc_ibiza_sunset_rgb.bsdf"))["faults"]
    assert 3 < faults["non_reciprocal_percent"] < 25 and faults["negative_percent"] > 1
