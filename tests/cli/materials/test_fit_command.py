"""`lambent fit` says what it left out, and how far the albedo is from the table's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.materials.document import Lobe, Material
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.synthetic import ISOTROPIC, synthesise
from lambent.materials.measured.parts.gonio_text import write_gonio
from tests.materials.measured.lbnl_files import lbnl_xml, words

PAINT = Material(name="paint", kd=0.2, lobes=(Lobe(k=(0.7,) * 3, mx=0.15, my=0.15, r0=(0.06,) * 3, alpha=0.3),))


@pytest.fixture
def measured(tmp_path):
    path = tmp_path / "paint.txt"
    few = replace(ISOTROPIC, theta_i_deg=(0.0, 30.0, 60.0, 86.0), step_deg=10.0, fine_deg=5.0, grazing_deg=88.0)
    write_gonio(path, synthesise(PAINT, few))
    return path


def test_everything_left_out_is_printed_with_its_count(lambent, measured):
    left_out = load(measured).samples().left_out
    assert min(left_out.shadowed, left_out.grazing) > 0
    text = " ".join(lambent("fit", measured).out.split())
    assert f"{left_out.shadowed} left out: marked as not measured, or hidden by the device" in text
    assert f"{left_out.grazing} left out: theta_i or theta_o beyond 84" in text
    facts = lambent("fit", measured, "--json").json["tuples"]
    assert sum(facts["left_out"].values()) == left_out.total
    assert f"{facts['used']} tuples fitted" in text


def test_the_other_side_of_a_sheet_is_left_out_and_counted(lambent, tmp_path):
    path = tmp_path / "sheet.xml"
    values, quarter = words(np.full((41, 41), 0.1)), "LBNL/Klems Quarter"
    blocks = [("Visible", f"Reflection {side}", values) for side in ("Front", "Back")]
    path.write_text(lbnl_xml("Columns", blocks, column=quarter))
    both = lambent("fit", path, "--json").json["tuples"]
    behind = both["left_out"]["light from -z, the other side of the sheet"]
    assert (
        behind == both["used"] + both["left_out"]["theta_i or theta_o beyond 84°, where devices see their own errors"]
    )
    path.write_text(lbnl_xml("Columns", blocks[1:], column=quarter))
    assert "light from -z" not in lambent("fit", path).out


def test_the_albedo_is_in_the_summary_and_can_be_kept(lambent, measured):
    for options in ((), ("--keep-albedo",)):
        outcome = lambent("fit", measured, *options)
        assert outcome.code == 0
        assert "albedo in reflection at worst" in outcome.out
    facts = lambent("fit", measured, "--keep-albedo", "--json").json
    assert facts["albedos"][0]["side"] == "reflection"
    assert "albedo kept" in facts["material"]["provenance"]["method"]
