"""What is proposed before a bake with interreflections, and whether the bake then takes that much."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from lambent.bake.bake import bake
from lambent.bake.bounces import Bounces
from lambent.bake.interreflection.proposal import Proposal, propose, same_materials
from lambent.bake.view import View
from lambent.core.camera import Camera
from lambent.core.errors import UserError
from lambent.materials.document import Material
from lambent.scenes.geometry import patch, placed, sphere
from lambent.scenes.scene import Scene, SceneObject
from tests.bake.test_interreflection import FROM_ABOVE, corner

VIEW = View(FROM_ABOVE, 48, 48)
KINDS = {"floor": Material(kd=0.6), "back": Material(kd=0.5), "side": Material(kd=0.4), "ball": Material(kd=0.7)}
BOUNCES = Bounces((16, 1, 1), samples=256)


def with_small_things() -> Scene:
    """A bead that hardly shows, and a large screen behind the camera, which lights what shows."""
    scene = corner(KINDS)
    bead = SceneObject("bead", placed(sphere(0.01, 8, 4), (-0.3, 0.3, -0.3)), "bead")
    screen = SceneObject("screen", patch((-2, -0.2, 2.6), (0, 4, 0), (4, 0, 0)), "screen")
    more = {"bead": Material(kd=0.31), "screen": Material(kd=0.92)}
    return replace(scene, objects=(*scene.objects, bead, screen), materials={**scene.materials, **more})


def test_what_is_small_in_the_view_and_in_its_light_is_fixed() -> None:
    found = propose(with_small_things(), VIEW, replace(BOUNCES, fixed=frozenset({"ball"})))
    assert found.bounces.fixed == {"ball", "bead", "black"}  # the lamp reflects nothing
    rows = {row.material: row for row in found.rows}
    assert rows["screen"].points == 0 and rows["screen"].passed_on > 0.01 and rows["screen"].role == "edited"
    assert sum(row.in_view for row in found.rows) == pytest.approx(1)
    assert sum(row.passed_on for row in found.rows) == pytest.approx(1)
    assert rows["bead"].cells < rows["floor"].cells


@pytest.fixture(scope="module")
def found() -> Proposal:
    return propose(corner(KINDS), VIEW, BOUNCES)


def test_what_the_bake_takes_was_said_before(found: Proposal, tmp_path: Path) -> None:
    scene = corner(KINDS)
    store = bake(scene, tmp_path / "s", only={"interreflection"}, views=[VIEW], bounces=found.bounces)
    tiles = [a for a in store.artefacts("interreflection") if "unit" in a.meta]
    for row in found.rows:
        mine = [a for a in tiles if a.meta["material"] == row.material]
        points = sum(a.meta["points"] for a in mine)
        assert points == row.points
        if points > 200:
            entries = sum((a.shape[0] - a.meta["points"]) // 2 for a in mine) / points
            assert entries == pytest.approx(row.entries, rel=0.1)
    raw = sum(4 * a.shape[0] for a in tiles)
    assert raw == pytest.approx(found.edit_bytes, rel=0.1)
    on_disk = sum(f.stat().st_size for f in (tmp_path / "s").rglob("*") if f.is_file() and f.suffix != ".json")
    assert 0.5 * on_disk < found.disk_bytes < 2 * on_disk  # folders of a small store count more
    assert 0 < found.seconds < 300


def test_materials_that_look_the_same_are_merged_where_the_store_would_not_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    from lambent.bake.interreflection import trial

    monkeypatch.setattr(trial, "TIMED", 64)
    monkeypatch.setattr(trial, "MANY", 64)
    twins = corner({**KINDS, "side": KINDS["back"]})
    assert same_materials(twins) == {"side": "back"} and not same_materials(twins, keep={"side"})
    roomy = propose(twins, VIEW, BOUNCES)
    assert (roomy.same, roomy.alike, roomy.reasons) == ({}, {"side": "back"}, ())
    most = roomy.edit_bytes * 2 // 3
    tight = propose(twins, VIEW, BOUNCES, most_bytes=most)
    assert tight.same == {"side": "back"} and tight.reasons
    assert tight.edit_bytes <= most or [row.role for row in tight.rows].count("edited") == 1
    assert {o.material for o in tight.merged(twins).objects} == {"floor", "back", "ball", "black"}


def test_the_table_names_every_material_and_the_sums(found: Proposal) -> None:
    lines = found.lines()
    assert [line.split()[0] for line in lines[1:6]] == [row.material for row in found.rows]
    assert lines[-2].startswith("16,1,1 with 256 samples: ") and " on disk, " in lines[-1]


def test_a_view_of_nothing() -> None:
    away = Camera("away", (0, 50, 0), (0, 90, 0.1))
    with pytest.raises(UserError, match="away: the view shows no surface"):
        propose(corner(KINDS), View(away, 8, 8), BOUNCES)
