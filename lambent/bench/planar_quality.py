"""How close planar reflectors come: every way to draw them against exact ray casting and the converged picture.

The specular light of the floor of planar_scene, seven lobes. Pictures are compared as clip(e L)^(1/2.2), e such that
the reference has mean .3; PSNR over the floor's pixels, FLIP over the picture, black where no floor is, and over the
floor's pixels alone. The error against `qmc` is the sampling's; against exact casting it holds what the mirror picture
cannot know.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.bench import planar_scene
from lambent.bench.machine import inputs_of, machine
from lambent.core import metrics
from lambent.core.errors import UserError
from lambent.core.progress import Progress, silent
from lambent.materials.document import Lobe
from lambent.realtime.device import open_device
from lambent.realtime.frame import FrameState, Renderer

NAME = "planar-quality"
Floats = NDArray[np.floating]
WAYS = {
    "marched": ("rings", "marched"),
    "interleaved": ("rings", "interleaved"),
    "fixed": ("rings", "fixed"),
    "thesis": ("lobe-4.25", "thesis"),
}
NS = (3, 5, 7, 9, 11, 15, 19)
ROUGHNESSES = ((0.01, 0.01), (0.02, 0.02), (0.05, 0.05), (0.1, 0.1), (0.2, 0.2), (0.02, 0.1), (0.1, 0.02))
SIZES = {True: (192, 144), False: (1024, 768)}  # by quick
SPP = {True: 64, False: 512}
STEPS = 1000  # of progress per lobe


def lobe_of(mx: float, my: float) -> Lobe:
    """A bright metal."""
    return Lobe(mx=mx, my=my, r0=(0.9, 0.9, 0.9), alpha=0.5)


def run(quick: bool, inputs: list[Path], progress: Progress = silent) -> dict[str, Any]:
    """Rows roughness x n x way; it reads no inputs. `quick` is smaller and leaves out `qmc`."""
    if inputs:
        raise UserError("this bench reads no inputs", got=inputs[0])
    device = open_device()
    width, height = SIZES[quick]
    renderer = Renderer(device, planar_scene.planar_scene(lobe_of(*ROUGHNESSES[0])))
    rows: list[dict[str, Any]] = []
    converged_errors: list[dict[str, Any]] = []
    for done, (mx, my) in enumerate(ROUGHNESSES):
        lobe, name = lobe_of(mx, my), f"roughness {mx}/{my}"
        exact, floor = planar_scene.exact_reflection(
            lobe, planar_scene.CAMERA, width, height, SPP[quick], _within(progress, done, 0.0, f"{name}, exact")
        )
        state = FrameState(
            planar_scene.CAMERA, width, height, show="specular", antialias=False,
            materials={planar_scene.FLOOR: planar_scene.floor_material(lobe)},
        )  # fmt: skip
        converged = None
        if not quick:
            converged = renderer.converged(state, SPP[quick], _within(progress, done, 0.5, f"{name}, converged"))
            converged_errors.append({"mx": mx, "my": my} | _errors(converged, exact, floor))
        for n in NS:
            for way, (integrator, planar) in WAYS.items():
                image = renderer.image(replace(state, integrator=integrator, planar=planar, n=n))
                row = {"mx": mx, "my": my, "n": n, "way": way}
                rows.append(row | errors(image, exact, converged, floor))
        progress((done + 1) * STEPS, len(ROUGHNESSES) * STEPS, name)
    return {
        "machine": machine(device),
        "inputs": inputs_of(inputs),
        "rows": rows,
        "converged": converged_errors,
        "summary": {"width": width, "height": height, "spp": SPP[quick], **summary(rows, converged_errors)},
    }


def _within(progress: Progress, lobe: int, begin: float, label: str) -> Progress:
    """Progress of one half of a lobe's work as that of the whole bench."""

    def said(done: int, total: int, _: str) -> None:
        progress(int(STEPS * (lobe + begin + 0.5 * done / max(total, 1))), len(ROUGHNESSES) * STEPS, label)

    return said


def errors(image: Floats, exact: Floats, converged: Floats | None, floor: NDArray[np.bool_]) -> dict[str, float | None]:
    """Of one picture, against exact casting and, where it was drawn, against `qmc`."""
    found: dict[str, float | None] = {"psnr_qmc": None, "flip_qmc": None}
    if converged is not None:
        against = _errors(image, converged, floor)
        found = {"psnr_qmc": against["psnr"], "flip_qmc": against["flip"]}
    return found | {f"{name}_path": value for name, value in _errors(image, exact, floor).items()}


def _errors(image: Floats, truth: Floats, floor: NDArray[np.bool_]) -> dict[str, float]:
    reference, test = metrics.display_pair(truth * floor[..., None], image * floor[..., None])
    flip = metrics.flip_error(reference, test)
    return {
        "psnr": round(metrics.psnr(reference[floor], test[floor]), 3),
        "flip": round(float(flip.mean()), 5),
        "flip_floor": round(float(flip[floor].mean()), 5),
        "flip_worst_tile": round(float(metrics.tile_means(flip).max()), 5),
    }


def summary(rows: list[dict[str, Any]], converged: list[dict[str, Any]]) -> dict[str, Any]:
    """Means over the lobes by way and n, and of the converged picture's own error; of the worst tiles the worst."""
    groups: dict[tuple[str, int], list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        groups[row["way"], row["n"]].append(row)
    said: dict[str, Any] = {}
    for name in ("psnr_path", "flip_path", "flip_floor_path"):
        said[name] = {
            way: {str(n): round(float(np.mean([r[name] for r in groups[way, n]])), 4) for n in NS} for way in WAYS
        }
    said["flip_worst_tile_path"] = {
        way: {str(n): max(r["flip_worst_tile_path"] for r in groups[way, n]) for n in NS} for way in WAYS
    }
    if converged:
        means = {
            name: round(float(np.mean([c[name] for c in converged])), 4) for name in ("psnr", "flip", "flip_floor")
        }
        said["converged_path"] = means | {"flip_worst_tile": max(c["flip_worst_tile"] for c in converged)}
        said["psnr_qmc"] = {
            way: {str(n): round(float(np.mean([r["psnr_qmc"] for r in groups[way, n]])), 4) for n in NS} for way in WAYS
        }
    return said
