"""The whole flow, from specimen to film, at a size for tests; and the same again after an interruption."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import imageio_ffmpeg
import numpy as np
import pytest

from lambent.baking.quality import quality_named
from lambent.core.pictures.images import read_encoded
from lambent.core.progress import Cancelled, silent
from lambent.demo.flow import PACE_M_S, SPECIMEN_OF, STILLS, Effort, Flow, walked
from lambent.materials.document import load_material
from lambent.scenes.loaders.load import load_scene
from lambent.store.store import Store

TINY = Effort(
    quality=quality_named("preview").changed(
        "tiny",
        geometry={"texels": 64},
        light_map={"samples": (4, 4), "noise": 1.0, "max_depth": 4, "gather_samples": 8},
        environment={"texels": 32},
        probe={"texels": 16, "samples": 4},
    ),
    tuples=2000,
    still=(160, 100),
    film=(96, 60),
    film_fps=1,
    compared=(96, 60),
    path_spp=16,
    rest_spp=24,
    moving_frames=4,
)


@pytest.mark.long
def test_the_film_walks_at_a_persons_pace() -> None:
    (path,) = load_scene("builtin:room").paths
    eyes = np.array([camera.position for camera in walked(path, 20)])
    steps_m = np.linalg.norm(np.diff(eyes, axis=0), axis=1)
    assert np.allclose(20 * steps_m, PACE_M_S, rtol=0.02)
    assert 0.8 <= PACE_M_S <= 1.5


def test_steps_with_one_name_are_timed_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    times_s = iter((100.0, 102.0, 200.0, 203.0))
    monkeypatch.setattr("lambent.demo.flow.time", SimpleNamespace(perf_counter=lambda: next(times_s)))
    flow = Flow(tmp_path, TINY, silent)
    for _ in range(2):
        with flow._timed("fit"):
            pass
    assert flow.finish()["seconds"] == {"fit": 5.0, "total": 5.0}


class Interrupt:
    """Progress that stops the work once, in the middle of a step."""

    def __init__(self, where: str) -> None:
        self.where, self.done = where, False

    def __call__(self, done: float, total: float, what: str) -> None:
        if not self.done and self.where in what and done > 0:
            self.done = True
            raise Cancelled


@pytest.mark.long
def test_the_flow_ends_with_everything_it_names(tmp_path: Path) -> None:
    interrupt = Interrupt("light map")
    with pytest.raises(Cancelled):
        Flow(tmp_path, TINY, interrupt).prepare()
    assert not (tmp_path / "demo.json").exists()
    flow = Flow(tmp_path, TINY, interrupt)
    scene = flow.prepare()
    flow.walk()
    flow.compare(scene)
    flow.share()
    flow.finish()
    report = json.loads((tmp_path / "demo.json").read_text())
    _check_materials(tmp_path, report)
    manifest = json.loads((tmp_path / "site/manifest.json").read_text())
    assert manifest["name"] == "room" and [camera["name"] for camera in manifest["cameras"]]
    assert report["site"]["files"] == len(list((tmp_path / "site/data").iterdir()))
    assert not [a.name for a in Store.open(flow.store_path).artefacts() if not a.complete]
    for k in range(STILLS):
        picture = read_encoded(tmp_path / f"walk_{k + 1}.png")
        assert picture.shape == (100, 160, 3)
        assert 0.1 < picture.mean() < 0.95 and picture.std() > 0.05
    first = read_encoded(tmp_path / "first.png")
    assert first.shape == (400, 640, 3) and first.std() > 0.05
    frames, _ = imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "walk.mp4"))
    assert frames == 7
    # A coarse bake and few paths: what would fail here is a mirrored, shifted, black or wrongly lit picture.
    assert report["compare"]["change"]["psnr_db"] > 22
    assert report["compare"]["rest"]["psnr_db"] > 15


def _check_materials(folder: Path, report: dict[str, Any]) -> None:
    for name, specimen in SPECIMEN_OF.items():
        material = load_material(folder / "materials" / f"{name}.json")
        assert material.name == name and material.provenance is not None
        assert specimen in (folder / "measured" / f"{name}.txt").read_text()[:500]
        fit = report["fits"][name]
        assert fit["errors"]["cuberoot"] < 0.5 * fit["lambertian_errors"]["cuberoot"]
        assert list((folder / "materials").glob(f"{name}_*.png"))
    aluminium = load_material(folder / "materials" / "brushed_aluminium.json").lobes[0]
    assert np.array([aluminium.mx, aluminium.my]) == pytest.approx([0.05, 0.25], rel=0.15)
