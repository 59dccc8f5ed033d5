"""One answer in GPU memory, from albedos to the irradiance of texels.

Each light group has its own arrays, so that a binding holds one group. Sweeps over the patches are split into several
submissions until every group has converged, so that a frame waits for few sweeps; everything else is one submission.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.answer import STEPS, SWEEPS, Albedos, Answer, Neighbours, least_light
from lambent.core.answer_rays import Rays
from lambent.core.arrays import Floats
from lambent.realtime.answered.stages import GROUP, Call, NoRoom, Stages

NEAR = 8  # points per texel, as in the shader
GPU_TOLERANCE = 1e-5  # largest relative change of a patch in the last sweep
GPU_SWEEPS = 2 * SWEEPS  # at most: Jacobi's method takes about twice as many as Gauss-Seidel
SWEEPS_AT_ONCE = 32  # most sweeps per submission
STEPS_AT_ONCE = 1 << 15  # loop steps per submission: frames wait little, and llvmpipe ends loops after 65535 steps
LIGHT_BYTES = 12  # three float32


@dataclass(frozen=True, eq=False)
class TexelsOnGpu:
    """Irradiance of T answering texels, in one buffer per light group."""

    stages: Stages
    buffers: tuple[Any, ...]
    texels: NDArray[np.uint32]

    def irradiance(self) -> NDArray[np.float32]:
        """(G, T, 3) W/m^2, read back; waits for the GPU."""
        count = 3 * len(self.texels)
        return np.stack([self.stages.read(one, np.float32, count).reshape(-1, 3) for one in self.buffers])

    def draw(self, texture: Any, sides: int, per_unit: float) -> None:
        """Write the light of one group, times `per_unit`, to its texels in a light map with 1 or 2 `sides`."""
        (buffer,) = self.buffers
        parameters = len(self.texels), texture.size[0], sides, float(per_unit)
        resources = self._places, buffer, texture.create_view(dimension="2d-array")
        self.stages.submit([self.stages.call("show", parameters, *resources, threads=len(self.texels))])

    @cached_property
    def _places(self) -> Any:
        return self.stages.buffer(self.texels)


class Unsolved(Exception):
    """Light between patches has not converged."""


class GpuAnswer:
    """An answer's arrays and calls on a device. Methods may run in any thread.

    Parameters
    ----------
    reference : (G, T, 3)
        `answer.reference()`.
    texels : (T,) uint32
        2 (row * width + column) in the light map, plus 1 on the back.

    Raises
    ------
    NoRoom
        If an array does not fit.
    """

    def __init__(self, device: Any, answer: Answer, reference: Floats, texels: NDArray[np.uint32]) -> None:
        self._stages, self._texels = Stages(device), texels
        self._lock = threading.Lock()  # keeps an edit's albedos and its submission together
        self._shared = _Shared(self._stages, answer)
        numbers = range(len(answer.direct))
        self._solvers = [_Solver(self._stages, self._shared, answer, group) for group in numbers]
        self._shared.colour(answer.albedos)
        _solve(self._stages, self._solvers)
        as_baked = answer.gathered_as_baked
        self._groups = [
            _Group(
                self._stages,
                self._shared,
                self._solvers[group],
                answer,
                group,
                as_baked[:, group, :3],
                reference[group],
            )
            for group in numbers
        ]

    def begin(self, albedos: Albedos) -> TexelsOnGpu:
        """Solve for the light of patches with new albedos; start the light of texels without waiting for it.

        Raises
        ------
        NoRoom
            If the adapter has no more memory.
        Unsolved
            If the light grows from sweep to sweep; the CPU's solver bounds it.
        """
        found = tuple(self._stages.empty(len(self._texels) * LIGHT_BYTES) for _ in self._groups)
        with self._lock:
            self._shared.colour(albedos)
            if not _solve(self._stages, self._solvers):
                raise Unsolved
            calls = (group.calls(to) for group, to in zip(self._groups, found, strict=True))
            self._stages.submit([call for of_group in calls for call in of_group])
        return TexelsOnGpu(self._stages, found, self._texels)

    def solved(self) -> NDArray[np.float32]:
        """Indirect irradiance (G, P, 3) of patches in the last edit, read back: for tests."""
        return np.stack([solver.light() for solver in self._solvers])

    def sweeps(self) -> list[tuple[int, bool]]:
        """Sweeps of each group in the last edit, and whether it converged: for tests."""
        return [solver.outcome() for solver in self._solvers]


class _Shared:
    """Buffers that all light groups read."""

    def __init__(self, stages: Stages, answer: Answer) -> None:
        patches, points, rays = answer.patches, answer.points, answer.rays
        self._stages = stages
        self.albedos = stages.empty(2 * 16 * len(answer.albedos.reflected))
        self.patches = stages.buffer(np.stack([patches.material, patches.paired], axis=1).astype(np.uint32))
        rows = patches.rows
        starts = np.append(rows.starts, rows.ends[-1:]).astype(np.uint32)
        entries = rows.senders.astype(np.uint32), rows.shares.astype(np.float32).view(np.uint32)
        self.row_starts, self.row_entries = stages.buffer(starts), stages.buffer(np.stack(entries, axis=1))
        self.longest_row = int((rows.ends - rows.starts).max(initial=0))
        about = [points.patch, points.material, points.other, np.zeros(len(points.patch))]
        self.points = stages.buffer(np.stack(about, axis=1).astype(np.uint32))
        self.rays, self.few_rays = (self._buffers(one) for one in (rays, answer.few_rays))
        self.around, self.near = (stages.buffer(packed_near(one)) for one in (answer.around, answer.near))

    def _buffers(self, rays: Rays) -> tuple[Any, ...]:
        arrays = rays.starts.astype(np.uint32), rays.points, rays.weights, rays.scale
        return tuple(self._stages.buffer(one) for one in arrays)

    def colour(self, albedos: Albedos) -> None:
        """Send albedos for the next calls."""
        both = np.concatenate([albedos.reflected, albedos.transmitted])
        self._stages.write(self.albedos, np.pad(both, ((0, 0), (0, 1))).astype(np.float32))


class _Solver:
    """Patches of one light group, and the calls that solve for their light."""

    def __init__(self, stages: Stages, shared: _Shared, answer: Answer, group: int) -> None:
        self._stages, self._patches = stages, answer.patches.direct.shape[1]
        size = self._patches * LIGHT_BYTES
        direct = np.asarray(answer.patches.direct[group], np.float32)
        self.indirect, sent, self._outcome = stages.empty(size), stages.empty(size), stages.empty(8)
        given = (shared.row_starts, shared.row_entries, shared.patches, shared.albedos, stages.buffer(direct),
                 self.indirect, sent, self._outcome)  # fmt: skip
        steps = -(-self._patches // GROUP) * (shared.longest_row + 3)  # per thread and sweep
        sweeps = max(1, min(SWEEPS_AT_ONCE, GPU_SWEEPS, STEPS_AT_ONCE // max(1, steps)))
        self.submissions = -(-GPU_SWEEPS // sweeps)  # at most
        self.begins, self.goes_on = (
            stages.call("solve", (self._patches, sweeps, anew, GPU_TOLERANCE), *given, threads=1) for anew in (1, 0)
        )

    def light(self) -> NDArray[np.float32]:
        """(P, 3) indirect irradiance of patches, read back."""
        return self._stages.read(self.indirect, np.float32, 3 * self._patches).reshape(-1, 3)

    def outcome(self) -> tuple[int, bool]:
        """Sweeps taken, and whether the solution has converged."""
        sweeps, stands = self._stages.read(self._outcome, np.uint32, 2)
        return int(sweeps), bool(stands)


def _solve(stages: Stages, solvers: Sequence[_Solver]) -> bool:
    """Solve for the light of patches in all groups; returns whether it converged. Waits for the GPU."""
    stages.submit([solver.begins for solver in solvers])
    submitted = 1
    while left := [one for one in solvers if submitted < one.submissions and not one.outcome()[1]]:
        stages.submit([solver.goes_on for solver in left])
        submitted += 1
    return all(one.outcome()[1] for one in solvers)


class _Group:
    """The arrays of one light group, and its calls after the solution for its patches."""

    def __init__(
        self, stages: Stages, shared: _Shared, solver: _Solver, answer: Answer, group: int, gathered: Floats,
        reference: Floats,
    ) -> None:  # fmt: skip
        self._stages, self._shared = stages, shared
        points = answer.points
        self._points, self._gathering, self._texels = len(points.other), len(answer.rays.scale), len(reference)
        self._sent = stages.empty(self._points * LIGHT_BYTES)
        self._found, self._smooth = (stages.empty(self._gathering * LIGHT_BYTES) for _ in range(2))
        lights = stages.buffer(np.concatenate([points.direct[group], points.light[group]], axis=1).astype(np.float32))
        both = lights, stages.buffer(np.asarray(gathered[: self._points], np.float32))
        self._first = self._exitance(*both, True, solver.indirect, solver.light(), 1.0)
        few = answer.few_as_baked[:, group, :3]
        self._next = [self._exitance(*both, False, self._found, few, step) for step in STEPS]
        self._gathers, self._gathers_last = (
            stages.call("gather", (count,), *rays, self._sent, self._found, threads=count)
            for count, rays in ((self._points, shared.few_rays), (self._gathering, shared.rays))
        )
        given = shared.around, self._found, self._smooth
        self._smooths = stages.call("smooth", (self._gathering,), *given, threads=self._gathering)
        arrays = reference, answer.direct[group], answer.baked[group]
        self._of_texels = [stages.buffer(np.asarray(one, np.float32)) for one in arrays]
        self._least = _least(reference)

    def calls(self, found: Any) -> Iterator[Call]:
        """Stages in order; the last writes the irradiance of texels to `found`."""
        yield self._first
        for sends in self._next:
            yield self._gathers
            yield sends
        yield self._gathers_last
        yield self._smooths
        given = self._shared.near, self._smooth, *self._of_texels, found
        yield self._stages.call("texels", (self._texels, self._least), *given, threads=self._texels)

    def _exitance(self, lights: Any, seen: Any, by_patch: bool, now: Any, baked: Floats, step: float) -> Call:
        before = self._stages.buffer(np.asarray(baked, np.float32))
        given = self._shared.points, lights, self._shared.albedos, now, before, seen, self._sent
        return self._stages.call(
            "exitance", (self._points, int(by_patch), _least(baked), step), *given, threads=self._points
        )  # fmt: skip


def _least(light: Floats) -> float:
    """Threshold for ratios to light (n, 3): with less light, the ratio is 1."""
    return float(least_light(light[None])[0, 0, 0]) if len(light) else 0.0


def packed_near(near: Neighbours) -> NDArray[np.uint32]:
    """(T, 10) words: eight points, then eight shares of 8 bits."""
    missing = NEAR - near.points.shape[1]
    if missing < 0:
        raise NoRoom
    points = np.pad(near.points, ((0, 0), (0, missing))).astype("<u4")
    shares = np.pad(near.shares, ((0, 0), (0, missing))).astype(np.uint8).view("<u4")
    return np.concatenate([points, shares], axis=1)


def gpu_answer(device: Any, answer: Answer, reference: Floats, texels: NDArray[np.uint32]) -> GpuAnswer | None:
    """An answer on a device; None if it does not fit, so that the CPU computes it."""
    try:
        return GpuAnswer(device, answer, reference, texels)
    except NoRoom:
        return None
