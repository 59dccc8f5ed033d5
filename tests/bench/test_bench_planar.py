"""Planar benches: their truth is right, their rows are whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.bench.pictures import planar_quality
from lambent.bench.scenes import planar_scene
from lambent.bench.scenes.planar_scene import floor_state
from lambent.core.pictures import metrics
from lambent.realtime.gpu.device import open_device
from lambent.realtime.renderer import Renderer


@pytest.mark.long
def test_ray_casting_and_a_sharp_mirror_agree() -> None:
    """Two independent methods give the same image: ray casting on the CPU, the reflection buffer on the GPU."""
    lobe = planar_quality.lobe_of(0.001, 0.001)
    exact, floor = planar_scene.exact_reflection(lobe, planar_scene.CAMERA, 160, 120, 16)
    renderer = Renderer(open_device(), planar_scene.planar_scene(lobe))
    image = renderer.image(replace(floor_state(lobe, 160, 120), n=1))
    assert 0.3 < floor.mean() < 0.7
    assert ((image[..., 1] > 0) != floor).sum() < 12  # edges
    reference, test = metrics.display_pair(exact * floor[..., None], image * floor[..., None])
    assert metrics.psnr(reference[floor], test[floor]) > 30
    assert np.median(np.abs(reference - test)[floor]) < 0.01


@pytest.mark.long
def test_interleaving_beats_the_thesis_and_the_probe() -> None:
    """At n = 7 it is 8 dB at full size; here a tile of 8 x 8 pixels is much of the image."""
    effort = planar_quality.Effort(160, 120, 64, ns=(7,), roughnesses=((0.05, 0.05), (0.1, 0.1)))
    report = planar_quality.run(effort)
    assert len(report["rows"]) == 2 * 2
    psnr = {method: by_n["7"] for method, by_n in report["summary"]["psnr_path"].items()}
    assert psnr["marched"] > psnr["thesis"] + 2
    assert all(0 < row["flip_path"] < row["flip_worst_tile_path"] < 1 for row in report["rows"])
