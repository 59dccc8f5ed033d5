"""What a still camera gains from frame to frame: the error of 1, 2, 4 ... 256 accumulated `qmc` frames.

The truth is a far longer series of other samples: the same lobe in the second place of a material, behind one that
reflects nothing, where every pixel's sequence is rotated anew. Frames are counted, not seconds: how many of them two
seconds hold is the adapter's affair; `PROMISED` is 2 s at 30 frames per second.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.bench import planar_scene, specular_scene
from lambent.bench.machine import inputs_of, machine
from lambent.bench.quality_inputs import MATERIALS, OWN_ENVIRONMENTS
from lambent.core import metrics
from lambent.core.errors import UserError
from lambent.core.progress import Progress, silent
from lambent.materials.document import Lobe, Material
from lambent.realtime.device import open_device
from lambent.realtime.frame import QMC_N, FrameState, Renderer

NAME = "accumulate"
Floats = NDArray[np.floating]
PROMISED = 60
FRAMES = (1, 2, 4, 8, 16, 32, PROMISED, 64, 128, 256)
TRUTH_SPP = {True: 8192, False: 32768}  # by quick
SIZES = {True: 32, False: 64}
LOBES = tuple(material.lobes[0] for material in MATERIALS if material.name in ("satin .1", "rough .4", "miro .013/.12"))
PLANAR_LOBE = Lobe(mx=0.1, my=0.1, r0=0.9, alpha=0.5)


@dataclass(frozen=True)
class Case:
    """A lobe in a scene: `name` is the environment, or planar."""

    name: str
    renderer: Renderer
    state: FrameState
    material: str  # the one that the lobe stands in for
    lobe: Lobe

    def of(self, *lobes: Lobe) -> FrameState:
        return replace(self.state, materials={self.material: Material(name=self.material, lobes=lobes)})


def run(quick: bool, inputs: list[Path], progress: Progress = silent) -> dict[str, Any]:
    """Rows case x frames; it reads no inputs."""
    if inputs:
        raise UserError("this bench reads no inputs", got=inputs[0])
    device = open_device()
    cases = list(_cases(device, SIZES[quick]))
    rows: list[dict[str, Any]] = []
    for done, case in enumerate(cases):
        rows += errors_of(case, TRUTH_SPP[quick])
        progress(done + 1, len(cases), f"{case.name} {case.lobe.mx:g}")
    return {
        "bench": NAME,
        "machine": machine(device),
        "inputs": inputs_of(inputs),
        "rows": rows,
        "summary": summary(rows),
    }


def _cases(device: Any, size: int) -> Iterator[Case]:
    state = FrameState(specular_scene.CAMERA, size, size, show="specular", lookup="plain", antialias=False)
    meshes = specular_scene.sphere_and_torus(detail=48)
    for name, make in OWN_ENVIRONMENTS.items():
        base = Material(name="shown", lobes=(LOBES[0],))
        renderer = Renderer(device, specular_scene.baked_scene(meshes, base, make()))
        for lobe in LOBES:
            yield Case(name, renderer, state, "shown", lobe)
    renderer = Renderer(device, planar_scene.planar_scene(PLANAR_LOBE))
    yield Case("planar", renderer, replace(state, camera=planar_scene.CAMERA), planar_scene.FLOOR, PLANAR_LOBE)


def truth_of(case: Case, spp: int) -> Floats:
    """Converged from samples that no series of the lobe alone takes."""
    nothing = case.lobe.model_copy(update={"k": (0.0, 0.0, 0.0)})
    return case.renderer.converged(replace(case.of(nothing, case.lobe), n=64), spp)


def errors_of(case: Case, truth_spp: int) -> list[dict[str, Any]]:
    """One row per number of frames: the error of the mean so far.

    mse is relative to the truth's mean square. bias is the mean difference as a share of the mean, its standard error
    from the differences of the pixels, whose samples are rotated independently.
    """
    truth = truth_of(case, truth_spp)
    shown = truth.max(axis=-1) > 0
    exposure_ev = metrics.display_exposure(truth * shown[..., None])
    encoded = metrics.displayed(truth, exposure_ev)[shown]
    rows = []
    for frames, mean in _series(case):
        difference = (mean - truth)[shown].astype(np.float64).mean(axis=-1)
        light = float(truth[shown].mean())
        error = float(difference.std(ddof=1) / np.sqrt(difference.size))
        rows.append(
            {
                "case": case.name,
                "mx": case.lobe.mx,
                "my": case.lobe.my,
                "frames": frames,
                "samples": frames * QMC_N,
                "mse": float(np.mean((mean - truth)[shown] ** 2) / np.mean(truth[shown] ** 2)),
                "psnr": round(metrics.psnr(encoded, metrics.displayed(mean, exposure_ev)[shown]), 2),
                "bias_percent": round(100 * float(difference.mean()) / light, 4),
                "bias_z": round(float(difference.mean()) / max(error, 1e-12), 2),
            }
        )
    return rows


def _series(case: Case) -> Iterator[tuple[int, Floats]]:
    state = case.of(case.lobe)
    for index in range(FRAMES[-1]):
        now = replace(state, integrator="qmc", accumulate=index)
        if index + 1 in FRAMES:
            yield index + 1, case.renderer.image(now)
        else:
            case.renderer.draw(now)


def slope_of(rows: list[dict[str, Any]]) -> float:
    """Exponent of mse against frames: -1 for independent samples, less for a sequence that covers its domain evenly."""
    frames, mse = ([row[key] for row in rows] for key in ("frames", "mse"))
    return float(np.polyfit(np.log(frames), np.log(mse), 1)[0])


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Per case the slope and the PSNR after `PROMISED` frames, and the largest |z| of a bias in the last frame."""
    cases: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        cases[f"{row['case']} {row['mx']:g}/{row['my']:g}"].append(row)
    last = [series[-1] for series in cases.values()]
    return {
        "slope": {name: round(slope_of(series), 2) for name, series in cases.items()},
        "psnr_promised": {
            name: next(row["psnr"] for row in series if row["frames"] == PROMISED) for name, series in cases.items()
        },
        "bias_z_max": max(abs(row["bias_z"]) for row in last),
    }
