"""Edge blending: what it must leave alone, and how close it comes to the true edge."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import wgpu

from lambent.realtime.display.display import SmoothPass
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.pipelines import cover
from lambent.realtime.gpu.targets import DISPLAY_FORMAT

SIZE = 64


@pytest.fixture
def smoothed(device) -> Any:
    """Function that sends grey values (SIZE, SIZE) in [0, 1] through the pass."""
    sampler = device.create_sampler(mag_filter="linear", min_filter="linear")
    smooth = SmoothPass(Layouts(device))
    use = wgpu.TextureUsage
    size = (SIZE, SIZE, 1)
    given = device.create_texture(size=size, format=DISPLAY_FORMAT, usage=use.TEXTURE_BINDING | use.COPY_DST)
    target = device.create_texture(size=size, format=DISPLAY_FORMAT, usage=use.RENDER_ATTACHMENT | use.COPY_SRC)
    rows = {"bytes_per_row": SIZE * 4}

    def run(grey: np.ndarray, mixed: np.ndarray | None = None) -> np.ndarray:
        pixels = np.repeat(np.round(grey * 255).astype(np.uint8)[..., None], 4, axis=-1)
        pixels[..., 3] = 255 if mixed is None else np.where(mixed, 0, 255)
        device.queue.write_texture({"texture": given}, np.ascontiguousarray(pixels), rows, size)
        encoder = device.create_command_encoder()
        context = SimpleNamespace(
            unsmoothed=given, shown=target.create_view(), resources=SimpleNamespace(sampler=sampler),
            cover=lambda name, views, pipeline, groups: cover(encoder, views, pipeline, groups, {}),
        )  # fmt: skip
        smooth.encode(context)
        device.queue.submit([encoder.finish()])
        read = np.frombuffer(device.queue.read_texture({"texture": target}, rows, size), np.uint8)
        return read.reshape(SIZE, SIZE, 4)[..., 0] / 255

    return run


def half_plane(slope: float, per_pixel: int) -> np.ndarray:
    """1 below a line of this slope through the middle, from `per_pixel` squared samples of each pixel."""
    x = (np.arange(SIZE * per_pixel) + 0.5) / per_pixel - SIZE / 2
    below = x[:, None] > slope * x[None, :] + 0.21
    return below.reshape(SIZE, per_pixel, SIZE, per_pixel).mean(axis=(1, 3))


def test_what_needs_no_blending_stays(smoothed) -> None:
    edge = np.zeros((SIZE, SIZE))
    edge[:, 29:] = 0.8
    ramp = np.tile(np.arange(SIZE) / 255, (SIZE, 1))
    for image in (np.full((SIZE, SIZE), 0.4), edge, edge.T, ramp):
        np.testing.assert_allclose(smoothed(image), image, atol=0.5 / 255)


@pytest.mark.parametrize(("slope", "left"), [(0.1, 0.5), (0.3, 0.5), (-0.45, 0.5), (0.7, 0.55), (1.0, 0.9)])
def test_slanted_edges_come_near_the_truth(smoothed, slope: float, left: float) -> None:
    truth, hard = half_plane(slope, 16), half_plane(slope, 1)
    inside = np.s_[8:-8, 8:-8]
    for turn in (lambda p: p, np.transpose, lambda p: 1 - p):
        before = np.abs(turn(hard) - turn(truth))[inside].mean()
        after = np.abs(smoothed(turn(hard)) - turn(truth))[inside].mean()
        assert after < left * before
