"""Switches set constants and shaders to neutral values and back; rows tell what changes, what does not, what cannot."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lambent.baking.light import sampling
from lambent.bench.measuring.switches import BAKE, SWITCHES, TRACE, Switch, is_frozen, switched
from lambent.bench.pictures import ablation
from lambent.core.errors import UserError
from lambent.realtime.gpu import cube_mips, shader_source
from lambent.realtime.incident import planes
from lambent.realtime.integrators.integrators import INTEGRATORS
from lambent.realtime.light import probe_lamps, probe_light
from tests.bench.conftest import COARSE

WHITE = Switch("colour.wgsl:srgb_encode", "    return vec3f(1.0);")
UNREAD = Switch("lambent.realtime.overlays.outline.REACH_PX", 7)
FROZEN = Switch("lambent.baking.surfaces.clusters.MIXED", 0.0)


def test_a_name_changes_wherever_it_was_imported() -> None:
    before = cube_mips.smooth_chain
    with switched(Switch("lambent.realtime.gpu.cube_mips.smooth_chain", cube_mips.mip_chain)):
        assert cube_mips.smooth_chain is probe_lamps.smooth_chain is probe_light.smooth_chain is cube_mips.mip_chain
    assert cube_mips.smooth_chain is probe_lamps.smooth_chain is probe_light.smooth_chain is before


def test_attributes_items_and_several_places_change() -> None:
    before = INTEGRATORS["lamps"].lamps
    with switched(Switch("lambent.realtime.integrators.integrators.INTEGRATORS.lamps.lamps", None)):
        assert INTEGRATORS["lamps"].lamps is None
    assert INTEGRATORS["lamps"].lamps == before
    with switched(
        Switch(
            "lambent.realtime.light.probe_lamps.FIRST lambent.realtime.light.probe_lamps.LAST", lambda value: 2 * value
        )
    ):
        assert (probe_lamps.FIRST, probe_lamps.LAST) == (0.94, 1.08)
    with pytest.raises(ZeroDivisionError), switched(Switch("lambent.realtime.incident.planes.PREFERENCE", -1)):
        assert planes.PREFERENCE == -1
        raise ZeroDivisionError
    assert (probe_lamps.FIRST, probe_lamps.LAST, planes.PREFERENCE) == (0.47, 0.54, 2)


def test_shaders_change_where_they_include_the_file() -> None:
    before = shader_source.assemble("smooth.wgsl")
    with switched(Switch("smooth.wgsl:DETAIL", 0.5)):
        assert "const DETAIL = 0.5;" in shader_source.assemble("smooth.wgsl")
    with switched(Switch("smooth.wgsl:luma", "    return encoded.g;")):
        found = shader_source.assemble("smooth.wgsl")
        assert "fn luma(encoded: vec3f) -> f32 {\n    return encoded.g;\n}" in found and "0.587" not in found
    assert shader_source.assemble("smooth.wgsl") == before


@pytest.mark.parametrize(
    "place", ["lambent.realtime.light.probe_lamps.FIRSTS", "lambent.nowhere.X", "smooth.wgsl:DETAILS", "nowhere.wgsl:X"]
)
def test_a_place_that_is_not_there_is_named(place: str) -> None:
    with pytest.raises(UserError, match="no such constant or function"), switched(Switch(place, 0)):
        pass


@pytest.mark.long
def test_switches_are_of_what_there_is() -> None:
    for switch in SWITCHES:
        assert not is_frozen(switch), switch
        with switched(switch):
            pass


@pytest.mark.long
@pytest.mark.usefixtures("adapter")
def test_rows_say_what_changes(coarse_box):
    noisy = Switch("lambent.traced.picture.ENDED", 0, TRACE)
    darker = Switch("lambent.baking.light.sampling.closed", lambda *given: 0.5 * before(*given), BAKE)
    before = sampling.closed
    effort = replace(ablation.QUICK, width=64, height=48, truth_spp=16, quality=COARSE,
                     switches=(WHITE, UNREAD, FROZEN, noisy, darker))  # fmt: skip
    report = ablation.run(effort, inputs=[coarse_box])
    rows = {row["switch"]: row for row in report["rows"] if row["switch"] != ablation.AS_IS}
    assert [row["when"] for row in report["rows"] if row["switch"] == ablation.AS_IS] == ["draw", "trace", "bake"]
    as_is = report["rows"][0]
    white, same, frozen = rows[str(WHITE)], rows[str(UNREAD)], rows[str(FROZEN)]
    assert white["flip"] > as_is["flip"] + 0.05 and white["effect"] == "" and white["frame_s"] > 0
    assert same["effect"] == "none" and (same["flip"], same["worst_tile"]) == (as_is["flip"], as_is["worst_tile"])
    assert frozen["effect"] == "not switchable" and "flip" not in frozen
    assert rows[str(noisy)]["effect"] == "" and rows[str(noisy)]["rest_s"] > 0
    assert rows[str(darker)].keys() >= {"flip", "rest_flip", "bake_s"}
    verdicts = {name: found["verdict"] for name, found in report["summary"].items()}
    assert verdicts[str(WHITE)] == "stays" and verdicts[str(UNREAD)] == "none"
    assert verdicts[str(FROZEN)] == "not switchable"


def test_what_gains_nothing_goes():
    def row(switch: str, scene: str, flip: float, tile: float, seconds: float) -> dict:
        return {"scene": scene, "switch": switch, "when": "draw", "effect": "",
                "flip": flip, "worst_tile": tile, "frame_s": seconds}  # fmt: skip

    rows = [row("as is", "a", 0.05, 0.3, 1.0), row("as is", "b", 0.06, 0.4, 3.0)]
    for name, *gains in (
        ("flip", 0.001, 0, 0),
        ("tile", 0, 0.02, 0),
        ("time", 0, 0, 0.2),
        ("little", 0.0009, 0.019, 0.1),
    ):
        rows += [row(name, "a", 0.04, 0.3, 1.0), row(name, "b", 0.06 + gains[0], 0.4 + gains[1], 3 + gains[2])]
    found = ablation.summary(rows)
    assert {name: of["verdict"] for name, of in found.items()} == {
        "flip": "stays", "tile": "stays", "time": "stays", "little": "goes"
    }  # fmt: skip
    assert (found["flip"]["flip"], found["flip"]["flip_most"], found["flip"]["flip_least"]) == (-0.0045, 0.001, -0.01)
    assert found["time"]["frame_s"] == 1.05
