"""Readings below zero are counted by every command that uses a table's tuples, and each says what it does with them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.cli.materials.check import describe
from lambent.materials.checking import check, check_table
from lambent.materials.measured import load
from lambent.materials.measured.tables.half_vector_grid import GridShape
from tests.materials.measured.measured_files import rgl_fields, tensor_bytes


@pytest.fixture
def spoilt(tmp_path: Path) -> Path:
    """An RGL file with blue below zero over half of each incident direction."""
    fields = rgl_fields(np.zeros(1))
    fields["rgb"][:, :, 2, ::2] = -0.005
    (tmp_path / "spoilt.bsdf").write_bytes(tensor_bytes(fields))
    return tmp_path / "spoilt.bsdf"


def test_inspect_and_fit_count_alike(lambent, spoilt):
    samples = load(spoilt).samples()
    words = f"{samples.below_zero} of {len(samples)} tuples"
    assert samples.below_zero > 0.3 * len(samples)
    inspected = lambent("inspect", spoilt)
    assert words in inspected.out and "below zero: blue in" in inspected.out and "a fit keeps them" in inspected.out
    fitted = lambent("fit", spoilt)
    assert words in fitted.err and "a fit keeps them, and the cuberoot metric counts them as 0" in fitted.err


def test_check_finds_them_and_no_fault_in_them(spoilt, monkeypatch):
    monkeypatch.setattr(check, "SAMPLER_THETA_DEG", (45.0,))
    monkeypatch.setattr(check_table, "INTEGRAL_THETA_DEG", (40.0,))
    samples = load(spoilt).samples()
    report = check_table.check_table(load(spoilt), shape=GridShape(24, 1, 64, 32))
    facts = report.to_json()
    words = f"{samples.below_zero} of {len(samples)} tuples"
    assert facts["tuples"]["below_zero"] == samples.below_zero and words in facts["negative_readings"]
    assert not any("zero" in text for text in (*report.warnings, *report.failures))
    (line,) = (line for line in describe(report).splitlines() if words in line)
    assert line.startswith("readings below zero") and line.endswith("drawn as 0")
