"""The rate of a film changes how many cameras it shows, not where they go: in `lambent.render` and in the window."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lambent.core.views.camera import Camera, CameraPath
from lambent.realtime.frame_state import FrameState
from lambent.render import Settings, film, output
from lambent.viewer.modes.walk.views.filming import Filming
from tests.viewer.small_store import write_small_store

SECONDS, LENGTH_M = 2.0, 6.0
START, MIDDLE, END = (Camera(f"at {x:g} m", (x, 1.0, 0.0), (x, 1.0, 9.0)) for x in (0.0, 1.0, LENGTH_M))
EVEN = CameraPath("even", (START, END), SECONDS)
TIMED = CameraPath("timed", (START, MIDDLE, END), SECONDS, (0.0, 1.0, SECONDS))
PIXELS = np.zeros((2, 2, 3), np.uint8)
Filmed = Callable[[CameraPath, int], list[Camera]]


@pytest.fixture(params=["render", "window", "window, traced"])
def filmed(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Filmed:
    """Cameras of the frames that a film along a path writes, at a number of frames per second."""
    cameras: list[Camera] = []

    def draw(camera: Camera) -> np.ndarray:
        cameras.append(camera)
        return PIXELS

    def by_render(path: CameraPath, fps: int) -> int:
        drawn = SimpleNamespace(
            displayed=draw, radiance=None, settings=Settings(2, 2), exposure_ev=0.0, light_fields={}, samples=None,
            noise=None,
        )  # fmt: skip
        monkeypatch.setattr(output, "images", lambda *_, **__: drawn)
        store = write_small_store(tmp_path / f"{path.name}-{fps}.store")
        return film(store, tmp_path / f"{path.name}-{fps}-#.png", path, Settings(2, 2), fps=fps).frames

    def in_the_window(path: CameraPath, fps: int) -> int:
        renderer = SimpleNamespace(display_image=lambda view: draw(view.camera))
        asked: list[FrameState] = []
        traced = SimpleNamespace(ask=asked.append, radiance=PIXELS, display=lambda light, view: draw(view.camera))
        under_way = Filming(
            renderer,
            tmp_path / f"{path.name}-{fps}-#.png",
            path,
            FrameState(START, 2, 2),
            fps,
            traced if request.param == "window, traced" else None,
        )
        while not under_way.step():
            pass
        assert under_way.error is None and under_way.done == under_way.total
        return under_way.total

    def of(path: CameraPath, fps: int) -> list[Camera]:
        cameras.clear()
        frames = by_render(path, fps) if request.param == "render" else in_the_window(path, fps)
        assert frames == len(cameras)
        return list(cameras)

    return of


@pytest.mark.parametrize("path", [EVEN, TIMED], ids=lambda path: path.name)
def test_rates_share_the_cameras_of_the_same_times(filmed: Filmed, path: CameraPath) -> None:
    slow, fast = filmed(path, 24), filmed(path, 60)
    assert (len(slow), len(fast)) == (48, 120), "both last as long as the path"
    assert slow[0] == fast[0] and slow[0].position == START.position
    for early, late in zip(slow[::2], fast[::5], strict=True):  # every twelfth of a second
        np.testing.assert_allclose(early.position, late.position, atol=1e-9)
        np.testing.assert_allclose(early.target, late.target, atol=1e-9)
    if path is EVEN:  # the last frame is shown until the end, so it lies one frame before it
        x, step_m = [camera.position[0] for camera in fast], LENGTH_M / (SECONDS * 60)
        np.testing.assert_allclose(np.diff(x), step_m, atol=1e-4)
        assert x[-1] + step_m == pytest.approx(LENGTH_M, abs=1e-4)
