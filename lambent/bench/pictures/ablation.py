"""`ablation`: what each heuristic gains. One switch at a time sets a constant or a special case to a neutral value.

Rows are store x switch, of the first camera's view. `flip`, `worst_tile` and `frame_s` are of a frame in motion;
`rest_flip`, `rest_worst_tile` and `rest_s` of the traced picture with a fixed number of samples. Switches of the bake
are measured on stores baked here, and have `bake_s`. Times are processor time over all cores, and of frames on a
graphics card seconds. Rows `as is` come first; errors to the same truth are compared, so its noise cancels.

`effect` is `none` where pictures are the same to the bit, and `not switchable` where a constant is read only while
modules are imported or numba compiles. The summary has, by switch, what the present value gains on all stores: FLIP on
average and at most, the worst tile at most, and time as that of the neutral value over that of the present one. What
gains less than LEAST_FLIP, LEAST_TILE and LEAST_TIME on every store `goes`.
"""

from __future__ import annotations

import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baking.quality import Quality
from lambent.bench.measuring.reference import Truth, compile_kernels, finished, path_traced_parts, with_samples
from lambent.bench.measuring.switches import BAKE, DRAW, SWITCHES, TRACE, Switch, is_frozen, switched
from lambent.bench.scenes.views import first_camera, inputs_or_baked
from lambent.core.errors import UserError
from lambent.core.progress import Progress, silent
from lambent.core.views.camera import Camera
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import adapter_info, open_device
from lambent.realtime.renderer import Renderer
from lambent.store.contract import scene_record
from lambent.store.source import scene_of
from lambent.store.store import Store
from lambent.traced.picture import TracedPicture
from lambent.traced.room import room_of_paths, room_of_store

NAME = "ablation"
LEAST_FLIP, LEAST_TILE, LEAST_TIME = 0.001, 0.02, 1.05  # gains of what stays
NONE, FROZEN, AS_IS = "none", "not switchable", "as is"
FLIPS, TILES, TIMES = ("flip", "rest_flip"), ("worst_tile", "rest_worst_tile"), ("frame_s", "rest_s", "bake_s")
Measured = tuple[dict[str, Any], list[NDArray[Any]]]  # figures, and the pictures that they are of


@dataclass(frozen=True)
class Effort:
    """Pixels, samples of the truth and of traced pictures, timed frames; of bakes; the scene if no store is given."""

    width: int = 480
    height: int = 270
    truth_spp: int = 2048
    samples: int = 32
    runs: int = 3
    covers: bool = False  # `FrameState.covers`
    quality: str | Quality = "preview"
    scene: str = "builtin:room"
    switches: tuple[Switch, ...] = SWITCHES


FULL, QUICK = Effort(), Effort(160, 90, 64, 4, 1, scene="builtin:box", switches=SWITCHES[:3])


def run(
    effort: Effort, inputs: Sequence[Path] = (), reference: Sequence[Path] = (), progress: Progress = silent
) -> dict[str, Any]:
    """Rows of the inputs, which are baked stores; without inputs, of a scene baked here in `preview`.

    `reference`: finished pictures of first cameras, with equal samples and different seeds. With several inputs, those
    of NAME.store are named NAME-*.exr.
    """
    rows: list[dict[str, Any]] = []
    with inputs_or_baked(inputs, effort.scene, progress) as stores:
        for number, store in enumerate(stores):
            view = View.of(store, effort, _references(store, inputs, reference), progress)
            for row in rows_of(view):
                rows.append(row)
                progress(number + 1, len(stores) + 1, f"{row['scene']}, {row['switch']}")
    return {"rows": rows, "summary": summary(rows)}


def _references(store: Store, inputs: Sequence[Path], reference: Sequence[Path]) -> list[NDArray[Any]]:
    name = store.folder.stem
    mine = [path for path in reference if len(inputs) < 2 or path.stem.startswith(f"{name}-")]
    if reference and not mine:
        raise UserError("a store has no reference", file=store.folder, field="--reference", expected=f"{name}-*.exr")
    return finished(mine, inputs if len(inputs) < 2 else [store.folder])


@dataclass(frozen=True)
class View:
    """The first view of a store, and its truth."""

    store: Store
    camera: Camera
    truth: Truth
    effort: Effort

    @classmethod
    def of(cls, store: Store, effort: Effort, pictures: Sequence[NDArray[Any]], progress: Progress = silent) -> View:
        """`pictures` (H, W, 3) are finished references, which set the size; without any, they are traced here."""
        if pictures:
            effort = replace(effort, width=pictures[0].shape[1], height=pictures[0].shape[0])
        camera = first_camera(store, scene_record(store))
        if not pictures:
            tracer, size = room_of_paths(scene_of(store)).tracer, (effort.width, effort.height)
            pictures = path_traced_parts(tracer, camera, size, effort.truth_spp, 2, progress)
        return cls(store, camera, Truth.of(pictures), effort)

    def measured(self, when: str, folder: Path) -> Measured:
        """What a switch that acts in `when` can change; `folder` is for a baked store."""
        if when == DRAW:
            return self.frame(self.store)
        if when == TRACE:
            return self.rest(self.store)
        from lambent.baking.bake import bake

        baked, bake_s = _timed(lambda: bake(scene_of(self.store), folder, quality=self.effort.quality))
        parts = [self.frame(baked), self.rest(baked)]
        figures = {name: value for part in parts for name, value in part[0].items()}
        return {**figures, "bake_s": bake_s}, [picture for part in parts for picture in part[1]]

    def frame(self, store: Store) -> Measured:
        """Of a frame in motion, as displayed."""
        device, effort = open_device(), self.effort
        clock = time.process_time if adapter_info(device).is_software else time.perf_counter
        renderer = Renderer(device, store)
        state = FrameState(
            self.camera, effort.width, effort.height, exposure_ev=self.truth.exposure_ev, view_transform="linear",
            covers=effort.covers,
        )  # fmt: skip
        shown = renderer.display_image(state)  # compiles
        taken = [_timed(lambda: renderer.display_image(state), clock)[1] for _ in range(effort.runs)]
        errors = self.truth.errors_shown(shown.astype(np.float32) / 255)
        return {"flip": errors["flip"], "worst_tile": errors["flip_worst_tile"], "frame_s": min(taken)}, [shown]

    def rest(self, store: Store) -> Measured:
        """Of a traced picture."""
        tracer, size = room_of_store(store, scene_of(store)).tracer, (self.effort.width, self.effort.height)
        compile_kernels(tracer, self.camera, path=False)
        picture = TracedPicture(tracer, self.camera, size)
        radiance, seconds = _timed(lambda: with_samples(picture, self.effort.samples).denoised())
        errors = self.truth.errors(radiance)
        figures = {"rest_flip": errors["flip"], "rest_worst_tile": errors["flip_worst_tile"], "rest_s": seconds}
        return figures, [radiance]


def _timed(work: Callable[[], Any], clock: Callable[[], float] = time.process_time) -> tuple[Any, float]:
    begun = clock()
    return work(), round(clock() - begun, 4)


def rows_of(view: View) -> Iterator[dict[str, Any]]:
    """For each kind of switch a row as is, then one row per switch."""
    for when in (DRAW, TRACE, BAKE):
        as_is: Measured = {}, []
        mine = [switch for switch in view.effort.switches if switch.when == when]
        for switch in (None, *mine) if mine else ():
            row = {"scene": view.store.folder.stem, "switch": AS_IS if switch is None else str(switch), "when": when}
            if switch is not None and is_frozen(switch):
                yield {**row, "effect": FROZEN}
                continue
            with switched(switch) if switch else nullcontext(), tempfile.TemporaryDirectory() as folder:
                measured = view.measured(when, Path(folder) / "store")
            if switch is None:
                as_is = measured
            same = switch is not None and all(map(np.array_equal, as_is[1], measured[1]))
            yield {**row, "effect": NONE if same else "", **measured[0]}


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """By switch, what the present value gains; see the module's head."""
    as_is = {(row["scene"], row["when"]): row for row in rows if row["switch"] == AS_IS}
    by_switch = defaultdict(list)
    for row in rows:
        if row["switch"] != AS_IS:
            by_switch[row["switch"]].append((row, as_is[row["scene"], row["when"]]))
    return {name: _gains(pairs) for name, pairs in by_switch.items()}


def _gains(pairs: Sequence[tuple[dict[str, Any], dict[str, Any]]]) -> dict[str, Any]:
    """Of pairs of rows, at the neutral value and as is."""
    effects = {row["effect"] for row, _ in pairs}
    if FROZEN in effects:
        return {"verdict": FROZEN}

    def gains(names: Sequence[str]) -> list[float]:
        return [row[name] - present[name] for row, present in pairs for name in names if name in row]

    flips, tiles = gains(FLIPS), gains(TILES)
    times = {
        name: sum(r[name] for r, _ in pairs) / sum(p[name] for _, p in pairs) for name in TIMES if name in pairs[0][0]
    }
    stays = max(flips) >= LEAST_FLIP or max(tiles) >= LEAST_TILE or max(times.values()) >= LEAST_TIME
    return {
        "flip": round(float(np.mean(flips)), 5), "flip_most": round(max(flips), 4), "flip_least": round(min(flips), 4),
        "worst_tile": round(max(tiles), 4), **{name: round(value, 3) for name, value in times.items()},
        "verdict": NONE if effects == {NONE} else "stays" if stays else "goes",
    }  # fmt: skip
