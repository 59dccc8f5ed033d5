"""Rows of frames: those of benches walk-cube and walk-planar, and those of a walk in a baked scene."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

from lambent.bench.card_rows.baking import baked
from lambent.bench.card_rows.effort import Effort
from lambent.bench.card_rows.row import THESIS_M, Figure, Published, Row, adapter_name, median_ms
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.store.contract import scene_record
from lambent.store.store import Store
from lambent.viewer.cameras.cameras import look

TURN_PX = 4.0  # of a drag: what a camera of a walk turns by between frames
CURVED_FPS = {3: "70", 7: "41", 11: "30", 15: "24", 19: "20"}
PLANAR_FPS = {3: "47", 7: "33", 11: "25", 15: "20", 19: "17"}
AT = "1680x1050"
Scenes = Callable[[int, int], Mapping[str, tuple[Renderer, FrameState]]]


def curved(effort: Effort, work: Path) -> Iterator[Figure]:
    """Every pixel specular, on a bulging wall."""
    from lambent.bench.pictures.walk_cube import scenes

    yield from _by_n(effort, scenes)


def planar(effort: Effort, work: Path) -> Iterator[Figure]:
    """Every pixel a planar reflector."""
    from lambent.bench.pictures.walk_planar import scenes

    yield from _by_n(effort, scenes)


def _by_n(effort: Effort, scenes: Scenes) -> Iterator[Figure]:
    device = adapter_name()
    for width, height in effort.sizes:
        renderer, state = scenes(width, height)["full"]
        for n in effort.ns:
            frame = partial(drawn, renderer, replace(state, integrator="rings", n=n))
            yield Figure(f"{width}x{height}, n = {n}", 1e3 / median_ms(frame, effort.rounds), "frames/s", device)


def walk(effort: Effort, work: Path) -> Iterator[Figure]:
    """Frames of a camera that turns, with the default integrator and samples of each material."""
    yield from of_store(baked(effort, work), effort, "auto")


def of_store(store: Store, effort: Effort, lookup: str, what: str = "") -> Iterator[Figure]:
    """Frames per second of a store's first camera, in all sizes."""
    from lambent.realtime.gpu.device import open_room_device
    from lambent.render.images import DRAWN

    device, record = adapter_name(), scene_record(store)
    renderer, camera = Renderer(open_room_device(), store), record.cameras[0]
    for width, height in effort.sizes:
        frame = partial(
            drawn, renderer, FrameState(camera, width, height, integrator=DRAWN, lookup=lookup, covers=True)
        )
        yield Figure(f"{width}x{height}{what}", 1e3 / median_ms(frame, effort.rounds), "frames/s", device)


def drawn(renderer: Renderer, state: FrameState, turn: int = 0) -> None:
    """Draw a frame, with the camera turned on the spot by some steps, and wait for it."""
    renderer.draw(replace(state, camera=look(state.camera, turn * TURN_PX, 0.0)))
    renderer.finish()


def _published(fps: Mapping[int, str]) -> dict[str, Published]:
    return {f"{AT}, n = {n}": Published(figure, THESIS_M) for n, figure in fps.items()}


ROWS = {
    "frames, curved": Row(curved, 25, 2, _published(CURVED_FPS)),
    "frames, planar": Row(planar, 25, 3, _published(PLANAR_FPS)),
    "frames of a walk": Row(walk, 40, 4, {AT: Published("30 to 40", f"{THESIS_M}, its apartment")}),
}
