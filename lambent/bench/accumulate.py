"""Convergence for a still camera: the error of 1, 2, 4 ... 256 accumulated `qmc` frames.

The truth is the mean of `REPLICAS` longer series with other samples: each replica shifts the image by whole pixels, so
that every place gets another pixel's rotation of the sequence. Replicas of `qmc-lobe`, which does not sample lamps and
so shares no density with `qmc`, test pixel by pixel whether the two agree within the scatter of the replicas. The bench
counts frames, not seconds, because the adapter decides how many fit into two seconds; `PROMISED` is 2 s at 30 frames
per second.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from lambent.bench import planar_scene
from lambent.bench.planar_quality import lobe_of
from lambent.bench.quality_inputs import MATERIALS, OWN_ENVIRONMENTS
from lambent.bench.reference import Reference
from lambent.bench.specular_scene import sphere_and_torus
from lambent.core import metrics
from lambent.core.arrays import Flags, Floats
from lambent.core.progress import Progress, silent
from lambent.materials.document import Lobe, Material
from lambent.realtime.device import open_device
from lambent.realtime.frame_state import QMC_N, FrameState
from lambent.realtime.renderer import Renderer
from lambent.realtime.unbaked import CAMERA, unbaked_scene

NAME = "accumulate"
PROMISED = 60
TRUTH_N = 64  # samples per frame of the truth
REPLICAS, REPLICAS_ALONE = 8, 16  # of the truth, and of `qmc-lobe`, whose rare bright samples skew small sets
MOST_MOVED = 2  # pixels
BLOCK = 8  # side of squares whose means are also compared: more nearly normal than single pixels
LOBES = tuple(material.lobes[0] for material in MATERIALS if material.name in ("satin .1", "rough .4", "miro .013/.12"))


@dataclass(frozen=True)
class Effort:
    """Pixels along each side, samples per pixel summed over the truth's replicas, and the cases."""

    size_px: int = 64
    truth_spp: int = 32768
    frames: tuple[int, ...] = (1, 2, 4, 8, 16, 32, PROMISED, 64, 128, 256)
    lobes: tuple[Lobe, ...] = LOBES
    environments: Mapping[str, Callable[[], Floats]] = field(default_factory=lambda: OWN_ENVIRONMENTS)


FULL, QUICK = Effort(), Effort(32, 8192)


@dataclass(frozen=True)
class Case:
    """A lobe in a scene, and the frame that shows it: `name` is the environment, or "planar"."""

    name: str
    renderer: Renderer
    state: FrameState
    lobe: Lobe


def run(effort: Effort, progress: Progress = silent) -> dict[str, Any]:
    """Rows case x frames."""
    cases = list(_cases(open_device(), effort))
    rows: list[dict[str, Any]] = []
    for done, case in enumerate(cases):
        rows += errors_of(case, effort)
        progress(done + 1, len(cases), f"{case.name} {case.lobe.mx:g}")
    return {"rows": rows, "summary": summary(rows)}


def _cases(device: Any, effort: Effort) -> Iterator[Case]:
    size, base = effort.size_px, Material(name="shown", lobes=(LOBES[0],))
    meshes, planar = sphere_and_torus(detail=48), lobe_of(0.1, 0.1)
    state = FrameState(CAMERA, size, size, show="specular", lookup="plain", antialias=False)
    for name, make in effort.environments.items():
        renderer = Renderer(device, unbaked_scene(meshes, base, make()))
        for lobe in effort.lobes:
            material = base.model_copy(update={"lobes": (lobe,)})
            yield Case(name, renderer, replace(state, materials={"shown": material}), lobe)
    renderer = Renderer(device, planar_scene.planar_scene(planar))
    yield Case("planar", renderer, replace(planar_scene.floor_state(planar, size, size), lookup="plain"), planar)


def replicas(case: Case, integrator: str, chosen: list[tuple[int, int]], spp: int) -> Floats:
    """(R, H, W, 3) series of at least `spp` samples each, one per shift, all shifted back."""
    state = replace(case.state, integrator=integrator, n=TRUTH_N)
    moved = (case.renderer.converged(replace(state, jitter_px=(float(x), float(y))), spp) for x, y in chosen)
    return np.stack([np.roll(image, (y, x), axis=(0, 1)) for image, (x, y) in zip(moved, chosen, strict=True)])


def moves() -> list[tuple[int, int]]:
    """Whole-pixel shifts (right, down) of replicas; (0, 0) is reserved for the series itself."""
    steps = range(-MOST_MOVED, MOST_MOVED + 1)
    return [(right, down) for right in steps for down in steps if (right, down) != (0, 0)]


def z_of(a: Floats, b: Floats) -> Floats:
    """(...) z of two means of replicas (R, ...): Welch's t, as the normal deviate of equal probability."""
    from scipy.stats import norm, t

    share_a, share_b = (x.var(axis=0, ddof=1) / len(x) for x in (a, b))
    both = np.maximum(share_a + share_b, 1e-30)
    freedom = both**2 / np.maximum((share_a**2) / (len(a) - 1) + (share_b**2) / (len(b) - 1), 1e-60)
    found = (a.mean(axis=0) - b.mean(axis=0)) / np.sqrt(both)
    return np.asarray(np.sign(found) * norm.isf(np.clip(t.sf(np.abs(found), freedom), 1e-15, 0.5)))


def agreement(aimed: Floats, lobe_alone: Floats, shown: Flags) -> dict[str, float]:
    """Agreement of two sets of replicas (R, H, W, 3): over the shown pixels, over blocks, and z_whole of their mean.

    If both are unbiased, z_rms is 1 and z_above_3 .0027, as far as means are normally distributed. With rare bright
    samples pixel means are not: most are too dark and have too small an estimated error. Block means are more nearly
    normal.
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


def block_means(values: Floats, shown: Flags) -> Floats:
    """(R, B) means of values (R, P) of the P pixels of shown (H, W), over squares of `BLOCK` pixels."""
    row, column = np.nonzero(shown)
    _, block = np.unique(row // BLOCK * shown.shape[1] + column // BLOCK, return_inverse=True)
    return np.stack([np.bincount(block, of_one) / np.bincount(block) for of_one in values])


def errors_of(case: Case, effort: Effort) -> list[dict[str, Any]]:
    """One row per number of frames: the error of the mean so far, and the truth's agreement with `qmc-lobe`.

    mse is relative to the truth's mean square. bias is the mean difference relative to the mean; its standard error
    comes from the differences of pixels, whose samples are rotated independently.
    """
    spp, chosen = effort.truth_spp // REPLICAS, moves()
    aimed = replicas(case, "qmc", chosen[:REPLICAS], spp)
    alone = replicas(case, "qmc-lobe", chosen[REPLICAS : REPLICAS + REPLICAS_ALONE], spp)
    truth = aimed.mean(axis=0)
    inside = np.zeros(truth.shape[:2], bool)
    inside[MOST_MOVED:-MOST_MOVED, MOST_MOVED:-MOST_MOVED] = True
    # shifting the image can move a silhouette across a pixel's centre
    shown = inside & np.all(aimed.max(axis=-1) > 0, axis=0) & np.all(alone.max(axis=-1) > 0, axis=0)
    agrees, reference = agreement(aimed, alone, shown), Reference.of(truth, shown)
    rows = []
    for frames, image in _series(case, effort.frames):
        difference = (image - truth)[shown].astype(np.float64).mean(axis=-1)
        light = float(truth[shown].mean())
        error = float(difference.std(ddof=1) / np.sqrt(difference.size))
        encoded = metrics.displayed(image, reference.exposure_ev)
        rows.append(
            {
                "case": case.name,
                "mx": case.lobe.mx,
                "my": case.lobe.my,
                "frames": frames,
                "samples": frames * QMC_N,
                "mse": float(np.mean((image - truth)[shown] ** 2) / np.mean(truth[shown] ** 2)),
                "psnr": round(metrics.psnr(reference.encoded[shown], encoded[shown]), 2),
                "bias_percent": round(100 * float(difference.mean()) / light, 4),
                "bias_z": round(float(difference.mean()) / max(error, 1e-12), 2),
                **agrees,
            }
        )
    return rows


def _series(case: Case, wanted: tuple[int, ...]) -> Iterator[tuple[int, Floats]]:
    """The mean of the first n frames, for each n of `wanted`."""
    state = replace(case.state, integrator="qmc")
    for index in range(wanted[-1]):
        now = replace(state, accumulate=index)
        if index + 1 in wanted:
            yield index + 1, case.renderer.image(now)
        else:
            case.renderer.draw(now)


def slope_of(rows: list[dict[str, Any]]) -> float:
    """Exponent of mse against frames: -1 for independent samples, lower for a low-discrepancy sequence."""
    frames, mse = ([row[key] for row in rows] for key in ("frames", "mse"))
    return float(np.polyfit(np.log(frames), np.log(mse), 1)[0])


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Slope, PSNR after `PROMISED` frames and agreement of the truths per case; bias_z_max over the last frames."""
    cases: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        cases[f"{row['case']} {row['mx']:g}/{row['my']:g}"].append(row)
    last = {name: series[-1] for name, series in cases.items()}
    promised = {name: next(row for row in series if row["frames"] == PROMISED) for name, series in cases.items()}
    agree = ("z_rms", "z_above_3", "z_blocks_rms", "z_whole")
    return {
        "slope": {name: round(slope_of(series), 2) for name, series in cases.items()},
        "psnr_promised": {name: row["psnr"] for name, row in promised.items()},
        "bias_z_max": max(abs(row["bias_z"]) for row in last.values()),
        **{key: {name: row[key] for name, row in last.items()} for key in agree},
    }
