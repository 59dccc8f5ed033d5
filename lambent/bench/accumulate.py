"""Convergence for a still camera: the error of the mean of 1, 2, 4 ... 256 `qmc` frames.

The truth is a longer series for the image shifted by one pixel: every place gets another pixel's rotation of the
sequence. The bench counts frames, not seconds, because the adapter decides how many fit into a second.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from lambent.bench.quality_inputs import MATERIALS, OWN_ENVIRONMENTS
from lambent.bench.reference import Reference
from lambent.bench.specular_scene import sphere_and_torus
from lambent.core.arrays import Floats
from lambent.core.progress import Progress, silent
from lambent.materials.document import Lobe
from lambent.realtime.device import open_device
from lambent.realtime.frame_state import QMC_N, FrameState
from lambent.realtime.renderer import Renderer
from lambent.realtime.unbaked import CAMERA, unbaked_scene

NAME = "accumulate"
TRUTH_N = 64  # samples per frame of the truth
LOBES = tuple(material.lobes[0] for material in MATERIALS if material.name in ("satin .1", "rough .4", "miro .013/.12"))


@dataclass(frozen=True)
class Effort:
    """Pixels along each side, samples per pixel of the truth, and the cases."""

    size_px: int = 64
    truth_spp: int = 65536
    frames: tuple[int, ...] = (1, 2, 4, 8, 16, 32, 64, 128, 256)
    lobes: tuple[Lobe, ...] = LOBES
    environments: Mapping[str, Callable[[], Floats]] = field(default_factory=lambda: OWN_ENVIRONMENTS)


FULL, QUICK = Effort(), Effort(32, 16384)


def run(effort: Effort, progress: Progress = silent) -> dict[str, Any]:
    """Rows environment x lobe x frames; the summary has the slope and the last PSNR per case."""
    device, base = open_device(), MATERIALS[0].model_copy(update={"name": "shown"})
    meshes, size = sphere_and_torus(detail=48), effort.size_px
    state = FrameState(CAMERA, size, size, show="specular", lookup="plain", antialias=False, integrator="qmc")
    rows: list[dict[str, Any]] = []
    cases = [(name, lobe) for name in effort.environments for lobe in effort.lobes]
    renderers = {
        name: Renderer(device, unbaked_scene(meshes, base, make())) for name, make in effort.environments.items()
    }
    for done, (name, lobe) in enumerate(cases):
        shown = replace(state, materials={"shown": base.model_copy(update={"lobes": (lobe,)})})
        about = {"environment": name, "mx": lobe.mx, "my": lobe.my}
        rows += [about | row for row in errors_of(renderers[name], shown, effort)]
        progress(done + 1, len(cases), f"{name} {lobe.mx:g}")
    return {"rows": rows, "summary": summary(rows)}


def errors_of(renderer: Renderer, state: FrameState, effort: Effort) -> list[dict[str, Any]]:
    """One row per number of frames: the error of the mean so far.

    mse is relative to the truth's mean square. bias is the mean difference relative to the mean; its standard error
    comes from the differences of pixels, whose samples are rotated independently.
    """
    shifted = renderer.converged(replace(state, n=TRUTH_N, jitter_px=(1.0, 0.0)), effort.truth_spp)
    truth = np.roll(shifted, 1, axis=1)
    first = renderer.image(replace(state, accumulate=0))
    shown = (truth.max(axis=-1) > 0) & (
        first.max(axis=-1) > 0
    )  # the shift can move a silhouette across a pixel's centre
    shown[:, 0] = False  # rolled in from the other side
    reference, rows = Reference.of(truth, shown), []
    for frames, image in _series(renderer, state, effort.frames):
        difference = (image - truth)[shown].astype(np.float64).mean(axis=-1)
        error = float(difference.std(ddof=1) / np.sqrt(difference.size))
        rows.append(
            {
                "frames": frames,
                "samples": frames * QMC_N,
                "mse": float(np.mean((image - truth)[shown] ** 2) / np.mean(truth[shown] ** 2)),
                "psnr": reference.errors(image)["psnr"],
                "bias_percent": round(100 * float(difference.mean()) / float(truth[shown].mean()), 4),
                "bias_z": round(float(difference.mean()) / max(error, 1e-12), 2),
            }
        )
    return rows


def _series(renderer: Renderer, state: FrameState, wanted: tuple[int, ...]) -> Iterator[tuple[int, Floats]]:
    """The mean of the first n frames, for each n of `wanted`."""
    for index in range(wanted[-1]):
        now = replace(state, accumulate=index)
        if index + 1 in wanted:
            yield index + 1, renderer.image(now)
        else:
            renderer.draw(now)


def slope_of(rows: list[dict[str, Any]]) -> float:
    """Exponent of mse against frames: -1 for independent samples, lower for a low-discrepancy sequence."""
    frames, mse = ([row[key] for row in rows] for key in ("frames", "mse"))
    return float(np.polyfit(np.log(frames), np.log(mse), 1)[0])


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Slope, and PSNR and bias of the last mean, per case."""
    cases: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        cases[f"{row['environment']} {row['mx']:g}/{row['my']:g}"].append(row)
    return {
        "slope": {name: round(slope_of(series), 2) for name, series in cases.items()},
        "psnr": {name: series[-1]["psnr"] for name, series in cases.items()},
        "bias_z_max": max(abs(series[-1]["bias_z"]) for series in cases.values()),
    }
