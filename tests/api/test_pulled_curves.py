"""Curves of materials, benches and errors as Python sees them."""

from __future__ import annotations

import numpy as np
import pytest

import lambent
from lambent.core.geometry.directions import direction
from lambent.materials.document import Lobe
from lambent.materials.document import Material as Document

METAL = lambent.Material(Document(name="metal", kd=0.2, lobes=(Lobe(mx=0.4, my=0.4, r0=0.8),)))


def test_a_curve_is_pulled_at_one_node():
    angles, values = METAL.curves["highlight"]
    assert list(METAL.curves) == ["highlight", "reflectance by angle", "diffuse by angle"]
    pulled = METAL.with_curve("highlight", np.where(angles[:, None] > 20, 3 * values, values))
    halves = np.radians([5.0, 35.0])  # theta_h; light and eye stand symmetrically about it
    wi, wo = direction(np.zeros(2), 0.0), direction(2 * halves, 0.0)
    lobe = [one.eval(wi, wo) - METAL.with_curve("highlight", 1e-9 * values).eval(wi, wo) for one in (METAL, pulled)]
    assert np.allclose(lobe[1][:, 0] / lobe[0][:, 0], [1.0, 3.0], rtol=0.05)
    for title, wrong, message in (
        ("highlihgt", values, "unknown curve.*highlight"),
        ("highlight", values[1:], "highlight: cannot be taken"),
        ("highlight", -values, "not all 0"),
        ("diffuse by angle", 0 * METAL.curves["diffuse by angle"][1], "not all 0"),
    ):
        with pytest.raises(lambent.UserError, match=message):
            METAL.with_curve(title, wrong)


@pytest.mark.long
def test_a_bench_runs_at_other_sizes(adapter):
    report = lambent.run_bench("walk-cube", quick=True, width=64, height=48, ns=(3,), rounds=1)
    assert {row["width"] for row in report["rows"]} == {64} and report["machine"]["cores"] > 0
    with pytest.raises(lambent.UserError, match=r"unknown bench.*walk-cube"):
        lambent.run_bench("walk-cub")
    with pytest.raises(lambent.UserError, match=r"walk-cube: unknown size; found widht; expected width"):
        lambent.run_bench("walk-cube", widht=64)


def test_a_notebook_shows_the_line_of_an_error():
    error = lambent.UserError("does not exist", file="a.txt")
    assert error._render_traceback_() == ["UserError: a.txt: does not exist"]
