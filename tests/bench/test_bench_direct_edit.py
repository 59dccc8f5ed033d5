from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
import pytest

from lambent.bench import direct_edit
from lambent.bench.direct_edit import CASES, Effort, drag, held_bytes, run
from lambent.bench.measuring.reference import path_traced
from lambent.editing.rows import coefficients_of
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import same_quotients

SMALL = Effort(48, (60,), frames=4, edits=10, reference_spp=64, rival_s=0.5, checked=4)


@pytest.mark.long
def test_rows_of_a_scene_and_of_the_full_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(direct_edit, "CASES", {"builtin:teatray": CASES["builtin:teatray"]})
    report = run(SMALL)
    row, full = report["rows"]
    assert (row["scene"], row["lights"], row["terms"]) == ("builtin:teatray", 60, 5)
    assert 0.2 * 48**2 < row["points"] < 0.35 * 48**2 and full["points"] == 48**2
    assert row["bake_seconds"] >= row["transport_seconds"] > 0
    assert row["stored_mib"] > 0.1 and row["memory_mib"] > 0.1
    assert 0 < row["sum_error"] < 0.04 and 0 < row["curve_error"] < 0.06
    assert row["drift"] < 1e-5
    for one in (row, full):
        assert 0 < one["frame_ms"] <= one["frame_worst_ms"] and one["dense_ms"] > 0
    assert 0 < row["switch_ms"] <= row["switch_worst_ms"]
    assert 1 <= row["frames_to_exact"] < 20 and 0 <= row["inexact_share"] <= 1
    assert 0 < row["flip"] < 0.3 and 0 < row["reference_flip"] < 0.3
    close, slow = row["rival_flip"] <= row["flip"], isinstance(row["rival_seconds"], str)
    assert close != slow, "either it came as close, or it says how long it tried"
    json.dumps(report)


@pytest.mark.long
def test_the_rival_comes_closer_with_more_samples() -> None:
    from lambent.baking.engine import engine

    engine()
    from lambent.baking.reference.path_traced import tracer_of
    from lambent.scenes.loaders.load import load_scene

    scene = load_scene("builtin:teatray")
    view = tracer_of(scene, max_depth=1), scene.cameras[0], (48, 48)
    reference = np.log(1e-2 + path_traced(*view, 1024, seed=1).mean())
    pictures = {spp: path_traced(*view, spp, seed=2) for spp in (2, 64)}
    errors = {spp: np.abs(np.log(1e-2 + one.denoised()) - reference).mean() for spp, one in pictures.items()}
    noisy = np.abs(np.log(1e-2 + pictures[2].mean()) - reference).mean()
    assert errors[64] < errors[2] < noisy


def test_arrays_are_counted_once() -> None:
    @dataclass
    class Held:
        one: np.ndarray
        again: dict[str, list[np.ndarray]]

    Held.__module__ = "lambent.held"
    array = np.zeros(1000, np.float32)
    assert held_bytes(Held(array, {"part": [array[:10], array]})) == 4000


@pytest.mark.parametrize("lobe", [Lobe(mx=0.1, my=0.1), Lobe(mx=0.1, my=0.3, distribution="beckmann")])
def test_a_drag_is_shown_by_the_transport_of_its_start(lobe: Lobe) -> None:
    """Each frame brightens or widens the highlight further, by one curve alone."""
    start = Material(kd=0.2, lobes=(lobe,))
    frames = drag(start)
    first, second = next(frames), next(frames)
    assert same_quotients(of_material(start), first) and same_quotients(first, second)
    changed = [
        name for name in first.curves if not np.array_equal(first.curves[name].values, second.curves[name].values)
    ]
    assert changed == ["highlight" if lobe.mx == lobe.my else "highlight along"]


def test_a_frame_of_a_drag_changes_few_wavelets() -> None:
    frames = drag(Material(lobes=(Lobe(mx=0.045, my=0.045),)))
    one, other = (coefficients_of(next(frames).curves["highlight"], 128, 2) for _ in range(2))
    size = np.abs(other - one).max(axis=1)
    assert 0 < (size > 1e-3 * size.max()).sum() < 40
