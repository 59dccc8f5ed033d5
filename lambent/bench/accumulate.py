"""What a still camera gains from frame to frame: the error of 1, 2, 4 ... 256 accumulated `qmc` frames.

The truth is the mean of `REPLICAS` longer series of other samples: the picture moved by whole pixels, so that every
place has another pixel's rotation of the sequence. Replicas of `qmc-lobe`, which aims at no lamp and so shares
no density with `qmc`, tell whether the two agree, pixel by pixel, within what the replicas scatter. Frames are counted,
not seconds: how many of them two seconds hold is the adapter's affair; `PROMISED` is 2 s at 30 frames per second.
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
TRUTH_SPP = {True: 8192, False: 32768}  # by quick; of all replicas together
TRUTH_N = 64  # samples per frame of the truth
REPLICAS, REPLICAS_ALONE = 8, 16  # of the truth, and of `qmc-lobe`, whose rare bright samples skew a small sample
MOST_MOVED = 2  # pixels
BLOCK = 8  # pixels along the squares whose means are compared too: nearer to normal than single pixels
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


def replicas(case: Case, integrator: str, chosen: list[tuple[int, int]], spp: int) -> Floats:
    """(R, H, W, 3) series of at least `spp` samples each, one per move, all moved back."""
    pictures, frames = [], max(1, -(-spp // TRUTH_N))
    for right, down in chosen:
        state = replace(case.of(case.lobe), integrator=integrator, n=TRUTH_N, jitter_px=(float(right), float(down)))
        for index in range(frames - 1):
            case.renderer.draw(replace(state, accumulate=index))
            if index % 16 == 15:
                case.renderer.finish()
        last = case.renderer.image(replace(state, accumulate=frames - 1))
        pictures.append(np.roll(last, (down, right), axis=(0, 1)))
    return np.stack(pictures)


def moves() -> list[tuple[int, int]]:
    """Whole pixels (right, down) by which replicas look elsewhere; none is (0, 0), where a series itself looks."""
    steps = range(-MOST_MOVED, MOST_MOVED + 1)
    return [(right, down) for right in steps for down in steps if (right, down) != (0, 0)]


def z_of(a: Floats, b: Floats) -> Floats:
    """(...) z of two means of replicas (R, ...): Welch's t, as the normal deviate of the same probability."""
    from scipy.stats import norm, t

    share_a, share_b = (x.var(axis=0, ddof=1) / len(x) for x in (a, b))
    both = np.maximum(share_a + share_b, 1e-30)
    freedom = both**2 / np.maximum((share_a**2) / (len(a) - 1) + (share_b**2) / (len(b) - 1), 1e-60)
    found = (a.mean(axis=0) - b.mean(axis=0)) / np.sqrt(both)
    return np.asarray(np.sign(found) * norm.isf(np.clip(t.sf(np.abs(found), freedom), 1e-15, 0.5)))


def agreement(aimed: Floats, lobe_alone: Floats, shown: NDArray[np.bool_]) -> dict[str, float]:
    """How two sets of replicas (R, H, W, 3) agree: by pixels shown, by blocks of them, and z_whole of their mean.

    z_rms is 1 of unbiased ones, z_above_3 .0027, as far as means are distributed normally. Where rare samples are
    bright those of pixels are not: most are too dark and seem exact. Those of blocks are nearer to it.
    """
    a, b = (x[:, shown].astype(np.float64).mean(axis=-1) for x in (aimed, lobe_alone))
    z, by_block = z_of(a, b), z_of(block_means(a, shown), block_means(b, shown))
    whole = float(np.sqrt(sum((x.var(axis=0, ddof=1) / len(x)).sum() for x in (a, b)))) / a.shape[1]
    return {
        "z_rms": round(float(np.sqrt(np.mean(z * z))), 3),
        "z_mean": round(float(z.mean()), 3),
        "z_above_3": round(float(np.mean(np.abs(z) > 3)), 5),
        "z_blocks_rms": round(float(np.sqrt(np.mean(by_block**2))), 3),
        "z_whole": round(float(a.mean() - b.mean()) / max(whole, 1e-30), 2),
        "difference_percent": round(100 * float(a.mean() - b.mean()) / float(b.mean()), 4),
    }


def block_means(values: Floats, shown: NDArray[np.bool_]) -> Floats:
    """(R, B) means of values (R, P) of the P pixels of shown (H, W), over squares of `BLOCK` pixels."""
    row, column = np.nonzero(shown)
    _, block = np.unique(row // BLOCK * shown.shape[1] + column // BLOCK, return_inverse=True)
    return np.stack([np.bincount(block, of_one) / np.bincount(block) for of_one in values])


def errors_of(case: Case, truth_spp: int) -> list[dict[str, Any]]:
    """One row per number of frames: the error of the mean so far, and how the truth agrees with `qmc-lobe`.

    mse is relative to the truth's mean square. bias is the mean difference as a share of the mean, its standard error
    from the differences of the pixels, whose samples are rotated independently.
    """
    spp, chosen = truth_spp // REPLICAS, moves()
    aimed = replicas(case, "qmc", chosen[:REPLICAS], spp)
    alone = replicas(case, "qmc-lobe", chosen[REPLICAS : REPLICAS + REPLICAS_ALONE], spp)
    truth = aimed.mean(axis=0)
    inside = np.zeros(truth.shape[:2], bool)
    inside[MOST_MOVED:-MOST_MOVED, MOST_MOVED:-MOST_MOVED] = True
    # a silhouette may fall on either side of a pixel's centre once the picture is moved
    shown = inside & np.all(aimed.max(axis=-1) > 0, axis=0) & np.all(alone.max(axis=-1) > 0, axis=0)
    agrees = agreement(aimed, alone, shown)
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
                **agrees,
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
    """Per case the slope, the PSNR after `PROMISED` frames, the agreement of the truths; bias_z_max of last frames."""
    cases: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        cases[f"{row['case']} {row['mx']:g}/{row['my']:g}"].append(row)
    last = {name: series[-1] for name, series in cases.items()}
    return {
        "slope": {name: round(slope_of(series), 2) for name, series in cases.items()},
        "psnr_promised": {
            name: next(row["psnr"] for row in series if row["frames"] == PROMISED) for name, series in cases.items()
        },
        "bias_z_max": max(abs(row["bias_z"]) for row in last.values()),
        "z_rms": {name: row["z_rms"] for name, row in last.items()},
        "z_above_3": {name: row["z_above_3"] for name, row in last.items()},
        "z_blocks_rms": {name: row["z_blocks_rms"] for name, row in last.items()},
        "z_whole": {name: row["z_whole"] for name, row in last.items()},
    }
