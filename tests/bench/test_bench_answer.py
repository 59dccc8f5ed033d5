"""The bench of other colours: the light it answers with is nearer to path tracing than the light as it was."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import pytest

from lambent.baking.bake import bake
from lambent.baking.quality import quality_named
from lambent.bench import answer
from lambent.bench.measuring import answer_times
from lambent.core.errors import UserError
from lambent.scenes import builtin
from lambent.scenes.loaders.load import load_scene
from tests.viewer.small_store import write_small_store

SMALL = quality_named("preview").changed(
    "small",
    geometry={"texels": 64},
    light_map={"samples": (32, 32), "noise": 0.0, "gather_samples": 64},
    environment={"texels": 16},
    probe={"texels": 16, "samples": 8},
    answer={"patches": 100, "gather_rays": 64},
)
EFFORT = answer.Effort(texels=60, paths=128, edits=2, turns=1, contact_paths=512, drag_s=0.5)


@pytest.mark.long
@pytest.mark.usefixtures("adapter", "mi")
def test_rows_of_a_store(tmp_path: Path) -> None:
    lamp = '[[lights]]\nkind = "point"\nname = "bulb"\nposition = [0.3, 0.3, 0.3]\nintensity = [0.2, 0.1, 0.05]\n'
    (tmp_path / "box.toml").write_text((files(builtin) / "box.toml").read_text() + lamp)
    bake(load_scene(tmp_path / "box.toml"), tmp_path / "s", quality=SMALL, light_groups="scene").close()
    rows = answer.run(EFFORT, [tmp_path / "s"])["rows"]
    assert len(rows) == 2 and len({row["edit"] for row in rows}) == 2
    for row in rows:
        assert row["scene"] == "box" and row["texels"] == 60 and 10 < row["patches"] <= 110
        assert row["groups"] == 2
        assert row["rms"] < 0.5 * row["naive_rms"] and row["relative_rms"] < 0.5 * row["naive_relative_rms"]
        assert 0 < row["noise"] < row["naive_rms"] and row["shown_rms"] < row["naive_rms"] + row["baked_rms"]
        parts = [row[name] for name in ("solve_ms", "gather_ms", "upsample_ms", "upload_ms")]
        assert min(parts) > 0 and row["edit_to_picture_ms"] > row["upload_ms"] and row["sweeps"] >= 1
        assert row["edit_to_picture_cpu_ms"] > 0 and row["dimming_ms"] is not None
        assert row["drag_frames_per_s"] > 0 and row["drag_edits_per_s"] > 0
        assert 0 < row["drag_width_px"] <= answer_times.DRAG_WIDTH and row["drag_cpu_ms"] > 0
        assert row["rms"] < row["likely_error"] < row["naive_rms"]
        assert row["bytes"] > 1000 and row["precompute_s"] > 0
        assert row["precompute_cpu_s"] > 0 and row["light_map_cpu_s"] > 0
        if row["p95_contacts"] is not None:
            assert 0 <= row["relative_rms_most_contacts"] < 2 * row["p95_contacts"]
            assert row["p95_contacts_noise"] > 0 and row["relative_rms_contacts"] <= 2 * row["p95_contacts"]


@pytest.mark.long
def test_edits_of_a_scene_are_of_its_largest_materials() -> None:
    scene = load_scene("builtin:box")
    edits = answer.edits_of(scene, 4)
    assert len(edits) == 4 and "everything white" in edits and all(edit.keys() <= scene.materials.keys()
                                                                   for edit in edits.values())  # fmt: skip
    room = load_scene("builtin:room")
    white = answer.edits_of(room, 6)["everything white"]
    assert "walls dark blue" in answer.edits_of(room, 6)
    assert white["curtain"] == pytest.approx([0.85 - t for t in room.materials["curtain"].kt_d])


def test_a_store_without_an_answer_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="--only answer"):
        answer.run(EFFORT, [write_small_store(tmp_path / "s")])
