"""The bench of light fields: its truth is that of its maps, its methods come in the published order."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.bench import oslf
from lambent.bench.scenes.light_field_view import Compared, LightFieldView
from lambent.published.surface_light_fields import surface
from lambent.scenes.loaders.load import load_scene

TEXELS = 48


@pytest.fixture(scope="module")
def view(mi: Any, tmp_path_factory: pytest.TempPathFactory) -> LightFieldView:
    folder = tmp_path_factory.mktemp("oslf") / "store"
    return LightFieldView(load_scene("builtin:box"), "sphere", 0, (128, 128), 8, folder, oslf.SMALL)


@pytest.mark.long
def test_maps_hold_what_the_traced_rays_meet(view: LightFieldView) -> None:
    """Where the maps are read at the true hits, only their texels are left as an error."""
    field = view.field(144, TEXELS, 1)
    place, w = view.place(field), view.shown.w
    found = oslf.true_hit(field, place, w, view.distance_m)
    off = np.abs(found - view.truth).max(axis=-1)
    assert np.median(off) < 0.05 * np.median(view.truth)
    assert np.isfinite(view.distance_m).mean() > 0.5  # the box is open in front
    used = np.unique(place.points[place.known])
    black = np.setdiff1d(np.arange(len(field.points)), used)
    assert len(black) and not field.radiance[black].any() and field.radiance[used].any(axis=(1, 2, 3)).all()


@pytest.mark.long
def test_a_diffuse_object_is_seen_by_its_own_light_field(view: LightFieldView, tmp_path: Path) -> None:
    folder = tmp_path / "store"
    block = LightFieldView(load_scene("builtin:box"), "block", 0, (96, 96), 1, folder, oslf.SMALL)
    field = block.field(100, TEXELS, 1)
    light, seen = surface(field, block.place(field))
    assert seen.mean() > 0.97 and block.surface.any()
    assert np.median(np.abs(light / block.surface - 1)[seen]) < 0.02


def test_errors_are_those_of_the_object_alone() -> None:
    pixel = np.array([12, 13, 14, 22, 23, 24])  # two rows of three in a picture of 10 x 10
    truth = np.linspace(0.1, 1, 18).reshape(6, 3)
    compared = Compared.of(pixel, (10, 10), truth)
    assert compared.shape == (2, 3)
    same = compared.errors(truth)
    assert same["flip"] == 0 and same["rmse_lab"] == [0, 0, 0] and same["psnr"] == float("inf")
    off = compared.errors(truth * 0.8)
    assert off["flip"] > 0.01 and min(off["rmse_rgb"]) > 0.01


@pytest.mark.long
def test_the_whole_run_is_json(mi: Any) -> None:
    report = oslf.run(replace(oslf.QUICK, size=(48, 48), paths=1))
    assert json.loads(json.dumps(report))["summary"]["64 x 32"]["march 4"][0] < 1
    by = {row["method"]: row for row in report["rows"] if "method" in row}
    assert by["march 4, in blocks"]["psnr"] > by["march 4"]["psnr"] - 0.5 and by["march 4, in blocks"]["light_mb"] > 0
    cached = [row for row in report["rows"] if "reads" in row]
    assert len(cached) == 5 * 2 * len(oslf.QUICK.capacities)  # of five kinds of reads, in two orders
    for row in cached:
        missed = row["miss_percent"]
        assert 100 * row["first"] / row["count"] <= missed["least-recent"] + 1e-3, "each map is read once, at least"
        assert 0 < missed["known future"] <= min(missed["least-recent"], missed["adaptive"]) <= 100
