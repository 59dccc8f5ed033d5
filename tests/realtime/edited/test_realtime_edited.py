"""Edited pictures on a GPU: the same sums, folds and pictures as `lambent.editing` makes in memory."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lambent.core.arrays import Image
from lambent.editing.canvas import HostCanvas
from lambent.editing.folding import folded
from lambent.editing.incremental import RENEWED_IN, IncrementalPicture
from lambent.editing.products import HostProducts
from lambent.materials.factored.curve import Curve
from lambent.realtime.edited import commands
from lambent.realtime.edited.canvas import FORMAT, GpuCanvas
from lambent.realtime.edited.commands import OutOfGpuMemory
from lambent.realtime.edited.layer import GpuLayer
from lambent.realtime.gpu.targets import pixels
from tests.editing.test_folding import sparse

BLACK = np.zeros((4, 8, 3), np.float32)


def layer_of(canvas: GpuCanvas, count: int) -> GpuLayer:
    return canvas.layer(np.arange(count), np.zeros(count))


def wide(count: int) -> Image:
    return np.zeros((1, max(count, 1), 3), np.float32)


def random_transport(bands: int, count: int) -> np.ndarray:
    rng = np.random.default_rng(3)
    return (rng.normal(size=(bands, 3, count)) * rng.random((bands, 1, 1))).astype(np.float16)


def assert_close(found: np.ndarray, expected: np.ndarray, tolerance: float) -> None:
    assert found.shape == expected.shape
    assert np.abs(found - expected).max(initial=0) <= tolerance * np.abs(expected).max(initial=0)


def test_the_published_example(device: Any) -> None:
    """Ben-Artzi 2007, table 7.1: T = (3, 5, 2), one multiplication a frame."""
    held = layer_of(GpuCanvas(device, BLACK), 1).hold(np.array([3, 5, 2], np.float16).repeat(3).reshape(3, 3, 1))
    picture, shown = IncrementalPicture(held), []
    for curve in ([4, 2, 1, 0], [4, 3, 1, 0], [4, 2, 0, 0]):
        picture.want(np.array(curve[:3], float)[:, None])
        picture.step(terms=1)
        shown.append(picture.picture.ravel().tolist())
    assert shown == [[value] * 3 for value in (12, 27, 22)]


@pytest.mark.parametrize(("bands", "count"), [(1, 7), (64, 0), (64, 1001)])
def test_frames_add_up_as_in_memory(device: Any, monkeypatch: pytest.MonkeyPatch, bands: int, count: int) -> None:
    """With more terms than bands, fewer, and through all blocks that are drawn anew; in one piece and in many."""
    transport, rng = random_transport(bands, count), np.random.default_rng(5)
    light = np.abs(transport.astype(float)).sum(axis=0).max(initial=0)  # without its cancellations
    host = IncrementalPicture(HostProducts(transport))
    whole = IncrementalPicture(layer_of(GpuCanvas(device, wide(count)), count).hold(transport))
    layer = layer_of(GpuCanvas(device, wide(count)), count)
    monkeypatch.setattr(commands.Commands, "largest", max(bands, 2) * 12 * 150)  # bytes of 300 pixels
    pieces = IncrementalPicture(layer.hold(transport))
    for frame in range(RENEWED_IN + 5):
        curve = rng.normal(size=(bands, 3))
        curve[:, 1] *= frame % 2  # rows without weight in a channel
        for picture in (host, whole, pieces):
            picture.want(curve)
            picture.step(terms=(7, 30, 100)[frame % 3])
        if frame % 23 == 0:
            assert np.abs(whole.picture - host.picture).max(initial=0) <= 1e-5 * light
            assert np.array_equal(whole.picture, pieces.picture)
    for picture in (host, whole, pieces):
        picture.draw()
    assert np.abs(whole.picture - host.picture).max(initial=0) <= 1e-6 * light
    assert np.array_equal(whole.picture, pieces.picture)
    whole.want(np.zeros((bands, 3)))
    whole.draw()
    assert not whole.picture.any()


def test_part_of_the_pixels_is_drawn_anew(device: Any) -> None:
    """Between odd pixels too, which share a word with a neighbour that stays."""
    transport = random_transport(2, 11)
    held = layer_of(GpuCanvas(device, wide(11)), 11).hold(transport)
    held.add_rows(np.array([0]), np.ones((1, 3)))
    held.add_rows(np.array([1]), np.full((1, 3), 2.0), slice(3, 8), anew=True)
    expected = transport[0].astype(np.float32)
    expected[:, 3:8] = 2 * transport[1, :, 3:8].astype(np.float32)
    assert np.array_equal(held.picture, expected)


@pytest.mark.parametrize(
    ("bands", "edited", "points"), [((1, 1), 0, 1), ((16, 8), 1, 70), ((2, 128), 0, 70), ((256, 4), 1, 70)]
)
def test_folding_is_as_in_memory(
    device: Any, monkeypatch: pytest.MonkeyPatch, bands: tuple[int, int], edited: int, points: int
) -> None:
    stored = sparse(points + 1, bands, min(300, 2 * bands[0] * bands[1]))  # the last has none
    stored[0][points // 2] = 0, 0  # nor has this one
    idle = np.random.default_rng(1).uniform(0, 3e4, (bands[1 - edited], 3))
    rows, scale = folded(*stored, idle, edited, bands[edited])
    pictures: list[list[np.ndarray]] = []
    for most in (128 << 20, 256 * 3 * 4 * 10):  # bytes of at least 20 points
        layer = layer_of(GpuCanvas(device, wide(points + 1)), points + 1)
        monkeypatch.setattr(commands.Commands, "largest", most)
        for which in (1 - edited, edited):  # switched there and back, from the pairs that are there
            other = np.random.default_rng(2).random((bands[1 - which], 3)) if which != edited else idle
            found, unit = layer.fold_pairs(*stored, other, which, bands[which])
        assert unit == scale
        assert found.shape == rows.shape
        pictures.append([])
        for row in range(bands[edited]):
            found.add_rows(np.array([row]), np.ones((1, 3)), anew=True)
            pictures[-1].append(found.picture)
    assert_close(np.stack(pictures[0]), rows.astype(np.float32), 1e-3)
    assert np.array_equal(pictures[0], pictures[1])


def test_pictures_are_composed_as_in_memory(device: Any) -> None:
    """Odd sizes, the viewer's curve, two layers on the same pixels, and what is not edited."""
    rng = np.random.default_rng(0)
    background, pixel = rng.random((5, 19, 3)).astype(np.float32), np.sort(rng.permutation(95)[:41])
    theta_o = rng.uniform(0, 1.65, 41)
    curve, images = Curve.of(lambda x: np.stack([np.cos(x), x, 1 + x * x], axis=1)), []
    for canvas in (HostCanvas(background), GpuCanvas(device, background)):
        shown: list[Any] = []
        for k in range(2):
            layer: Any = canvas.layer(pixel, theta_o)
            layer.view(curve)
            layer.view(None if k else curve)
            layer.hold(random_transport(4, 41)).add_rows(np.arange(4), np.ones((4, 3)))
            shown.append((layer, np.array([1, 1e5, 0.5 + k], np.float32)))
        canvas.compose(shown[:1])
        canvas.compose(shown)
        images.append(canvas.image())
    assert_close(images[1], images[0], 1e-6)
    still = np.setdiff1d(np.arange(95), pixel)
    assert np.array_equal(images[1].reshape(-1, 3)[still], background.reshape(-1, 3)[still])


def test_the_texture_is_what_is_shown(device: Any) -> None:
    canvas = GpuCanvas(device, np.full((3, 5, 3), 1e6, np.float32))
    canvas.compose([])
    assert canvas.texture.format == FORMAT
    assert canvas.texture.size[:2] == (5, 3)
    assert np.array_equal(pixels(device, canvas.texture), canvas.image())
    assert (canvas.image() == 1e6).all()


def test_what_the_adapter_cannot_hold_is_said(device: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    import wgpu

    with pytest.raises(OutOfGpuMemory, match="no room for another"):
        GpuCanvas(device, np.broadcast_to(np.float32(0), (3000, 3000, 3)))
    canvas = GpuCanvas(device, BLACK)

    def full(**_: Any) -> None:
        raise wgpu.GPUOutOfMemoryError("full")

    monkeypatch.setattr(device, "create_buffer", full)
    with pytest.raises(OutOfGpuMemory, match="edit without this adapter"):
        layer_of(canvas, 8)
