"""What is proposed before a bake with interreflections, and whether the bake then takes that much."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from lambent.baking.artefacts import interreflection
from lambent.baking.bake import bake
from lambent.baking.interreflection import paths, trial
from lambent.baking.interreflection.proposal import Proposal, held_by, propose, propose_all, same_materials
from lambent.baking.interreflection.settings import Bounces
from lambent.baking.interreflection.trial import Cost, passes
from lambent.baking.transport.view import View
from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.editing.interreflection.stored import interreflections
from lambent.materials.document import Material
from lambent.materials.factored.of_lobes import of_material
from lambent.scenes.geometry import patch, placed, sphere
from lambent.scenes.scene import Scene, SceneObject
from lambent.store.source import materials_in_views
from lambent.store.store import Store
from tests.baking.interreflection.test_interreflection import FROM_ABOVE, corner

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


@pytest.mark.long
@pytest.mark.usefixtures("short_trials")
def test_what_is_small_in_the_view_and_in_its_light_is_fixed() -> None:
    found = propose(with_small_things(), VIEW, replace(BOUNCES, fixed=frozenset({"ball"})))
    assert found.bounces.fixed == {"ball", "bead", "black"}  # the lamp reflects nothing
    rows = {row.material: row for row in found.rows}
    assert rows["screen"].points == 0 and rows["screen"].passed_on > 0.01 and rows["screen"].role == "edited"
    assert sum(row.in_view for row in found.rows) == pytest.approx(1)
    assert sum(row.passed_on for row in found.rows) == pytest.approx(1)
    assert rows["bead"].cells < rows["floor"].cells
    away = Camera("away", (0, 50, 0), (0, 90, 0.1))
    with pytest.raises(UserError, match="away: the view shows no surface"):
        propose(corner(KINDS), View(away, 8, 8), BOUNCES)


@pytest.fixture(scope="module")
def found() -> Proposal:
    return propose(corner(KINDS), VIEW, BOUNCES)


@pytest.mark.long
def test_what_the_bake_takes_was_said_before(found: Proposal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene, counts = corner(KINDS), {"calls": 0, "tiles": 0}

    def count(place: ModuleType, name: str, what: str) -> None:
        work = getattr(place, name)

        def counted(*args: object) -> Any:
            counts[what] += 1
            return work(*args)

        monkeypatch.setattr(place, name, counted)

    count(paths, "trace", "calls")
    count(interreflection, "_write", "tiles")
    store = bake(scene, tmp_path / "s", only={"interreflection"}, views=[VIEW], bounces=found.bounces)
    tiles = [a for a in store.artefacts("interreflection") if "unit" in a.meta]
    for row in found.rows:
        mine = [a for a in tiles if a.meta["material"] == row.material]
        points = sum(a.meta["points"] for a in mine)
        assert points == row.points
        if points > 200:
            entries = sum((a.shape[0] - a.meta["points"]) // 2 for a in mine) / points
            assert entries == pytest.approx(row.entries, rel=0.1)
    points = [row.points for row in found.rows]
    assert counts["calls"] == sum(Cost(call_s=1.0).seconds(n, found.bounces) for n in points)
    assert counts["tiles"] == sum(Cost(tile_s=1.0).seconds(n, found.bounces) for n in points)
    start = {name: of_material(material) for name, material in scene.materials.items()}
    light = interreflections(store, FROM_ABOVE, (48, 48), start)
    terms = [term for part in light.parts.values() for term in part.terms]
    held = sum(term.values.nbytes + term.steps.nbytes for term in terms)
    assert held <= found.edit_bytes <= 1.3 * held
    on_disk = sum(f.stat().st_size for f in (tmp_path / "s").rglob("*") if f.is_file() and f.suffix != ".json")
    assert 0.5 * on_disk < found.disk_bytes < 2 * on_disk  # folders of a small store count more
    assert found.seconds > 0
    lines = found.lines()
    assert [line.split()[0] for line in lines[1:6]] == [row.material for row in found.rows]
    assert lines[-2].startswith("16,1,1 with 256 samples: ") and " on disk, " in lines[-1]


def test_seconds_are_of_paths_calls_tiles_and_passes() -> None:
    assert passes(16) == [16] and passes(100) == [16, 32, 64, 100] and passes(5) == [5]
    fast = Bounces((16, 1, 1), 16384)
    of_large_tile = 2 + sum(-(-(after - before) // 256) for before, after in pairwise(passes(16384)) if before > 16)
    assert Cost(call_s=1.0).seconds(4096, fast) == of_large_tile
    assert Cost(call_s=1.0).seconds(2 * 4096, fast) == 2 * of_large_tile
    assert Cost(tile_s=1.0).seconds(4097, fast) == 2 * 11 and Cost(kept_s=1.0).seconds(7, fast) == 7 * 11
    assert Cost(path_s=1.0).seconds(7, fast) == 7 * 16384
    slow = replace(fast, series=(64, 16), samples=512)
    assert Cost(call_s=1.0).seconds(4096, slow) > Cost(call_s=1.0).seconds(4096, replace(fast, samples=512))


@pytest.fixture
def short_trials(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few points and paths, where no test asks for seconds."""
    monkeypatch.setattr(trial, "TIMED", 64)
    monkeypatch.setattr(trial, "MANY", 64)
    monkeypatch.setattr(trial, "paths_at_once", lambda slow: 1 << 12)


@pytest.mark.long
@pytest.mark.usefixtures("short_trials")
def test_what_the_user_wants_to_edit_is_kept_and_views_agree() -> None:
    scene, quick = with_small_things(), replace(BOUNCES, samples=16)
    tight = propose(scene, VIEW, quick, kept={"bead", "ball"}, most_bytes=1)
    assert tight.edited == {"bead", "ball"} and {"floor", "back"} <= tight.bounces.fixed
    assert Proposal.of(json.loads(json.dumps(tight.said()))) == tight
    close = View(Camera("close", (-0.3, 0.3, 0.3), (-0.3, 0.3, -0.3), fov_y_deg=3.0), 16, 16)
    far, near = propose_all(scene, [VIEW, close], quick)
    assert far.bounces == near.bounces and {"floor", "bead"} <= far.edited
    assert far.same == near.same == {}


@pytest.mark.long
@pytest.mark.usefixtures("short_trials")
def test_materials_that_look_the_same_are_merged_where_the_store_would_not_fit() -> None:
    twins = corner({**KINDS, "side": KINDS["back"]})
    assert same_materials(twins) == {"side": "back"} and not same_materials(twins, keep={"side"})
    few = replace(BOUNCES, samples=16)
    roomy = propose(twins, VIEW, few)
    assert (roomy.same, roomy.alike, roomy.reasons) == ({}, {"side": "back"}, ())
    most = roomy.edit_bytes * 2 // 3
    tight = propose(twins, VIEW, few, most_bytes=most)
    assert tight.same == {"side": "back"} and tight.reasons
    assert tight.edit_bytes <= most or [row.role for row in tight.rows].count("edited") == 1
    assert {o.material for o in tight.merged(twins).objects} == {"floor", "back", "ball", "black"}


def test_a_store_goes_on_with_what_was_merged_for_it(tmp_path: Path) -> None:
    twins = corner({**KINDS, "side": KINDS["back"]})
    merged = replace(
        twins, objects=tuple(replace(o, material="back" if o.material == "side" else o.material) for o in twins.objects)
    )
    folder, bounces = tmp_path / "s", Bounces((4, 1), 2, frozenset({"ball", "black", "floor"}))
    assert held_by(folder, twins, VIEW, bounces.series) is None
    bake(merged, folder, only={"interreflection"}, views=[VIEW], bounces=bounces).close()
    held = held_by(folder, twins, VIEW, bounces.series)
    assert held is not None and (held.edited, held.same) == ({"back"}, {"side": "back"})
    assert held.merged(twins).objects == merged.objects and materials_in_views(Store.open(folder))["side"] == "back"
    repainted = replace(twins, materials={**twins.materials, "side": KINDS["floor"]})
    changed = held_by(folder, repainted, VIEW, bounces.series)
    assert changed is not None and not changed.same, "they no longer look the same"
    assert held_by(folder, twins, VIEW, (8, 1)) is None
