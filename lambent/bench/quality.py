"""How close a few samples come: every integrator against the converged picture of the same frame (spec: bench).

The specular term of a sphere and a torus, ten materials and the caller's under several environments. Pictures are
compared as clip(e L)^(1/2.2) with e such that the reference has mean .3, PSNR over the pixels that show an object. The
error against qmc is the sampling's; against path tracing it holds what a probe cannot know too: the light between the
shapes. The converged picture's own error against path tracing stands beside it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.bench import specular_scene
from lambent.bench.machine import inputs_of, machine
from lambent.bench.path_reference import path_traced
from lambent.bench.quality_inputs import MATERIALS, OWN_ENVIRONMENTS, one_lobe, read_inputs
from lambent.core import metrics
from lambent.core.progress import Progress, silent
from lambent.materials.document import Material
from lambent.realtime.device import open_device
from lambent.realtime.frame import FrameState, Renderer

NAME = "quality"
Floats = NDArray[np.floating]
INTEGRATORS = ("rings", "lobe-4.24", "lobe-4.25", "fis", "split-sum")
NS = (3, 5, 7, 9, 11, 13, 15, 17, 19)
REFERENCE_SPP, PATH_SPP = 4096, 512
SIZES = {True: 48, False: 128}  # pixels, by quick


@dataclass(frozen=True)
class Truth:
    """A reference picture (H, W, 3), the pixels (H, W) compared, and the exposure it is seen at."""

    name: str
    radiance: Floats
    shown: NDArray[np.bool_]
    exposure_ev: float
    encoded: Floats

    @classmethod
    def of(cls, name: str, radiance: Floats, shown: NDArray[np.bool_]) -> Truth:
        radiance = radiance * shown[..., None]
        exposure_ev = metrics.display_exposure(radiance)
        return cls(name, radiance, shown, exposure_ev, metrics.displayed(radiance, exposure_ev))

    def errors(self, image: Floats) -> dict[str, float | None]:
        """psnr, mean flip and its worst 16x16 tile."""
        test = metrics.displayed(image * self.shown[..., None], self.exposure_ev)
        flip = metrics.flip_error(self.encoded, test)
        return {
            f"psnr_{self.name}": round(metrics.psnr(self.encoded[self.shown], test[self.shown]), 3),
            f"flip_{self.name}": round(float(flip.mean()), 5),
            f"flip_{self.name}_worst_tile": round(float(metrics.tile_means(flip).max()), 5),
        }


@dataclass(frozen=True)
class Case:
    """A material under an environment, converged and, where there was time for it, path traced."""

    material: Material
    environment: str
    qmc: Truth
    path: Truth | None


def run(quick: bool, inputs: list[Path], progress: Progress = silent) -> dict[str, Any]:
    """Rows material x environment x n x integrator; `inputs` are environments and materials, added to ours.

    `split-sum` does not know n: its one picture stands in every row of its material and environment. `quick` leaves
    out path tracing.
    """
    device = open_device()
    more, measured = read_inputs(inputs, progress)
    environments = {name: make() for name, make in OWN_ENVIRONMENTS.items()} | more
    materials = (*MATERIALS, *measured)
    size = SIZES[quick]
    rows: list[dict[str, Any]] = []
    ours: dict[str, list[float]] = defaultdict(list)
    total = len(environments) * len(materials)
    for done, (renderer, case) in enumerate(_cases(device, environments, materials, size, paths=not quick)):
        rows += _compare(renderer, case, FrameState(specular_scene.CAMERA, size, size))
        for key, value in errors_of(case, case.qmc.radiance).items():
            if case.path is not None and value is not None and key.endswith("_path"):
                ours[key].append(value)
        progress(done + 1, total, f"{case.material.name}, {case.environment}")
    converged = {f"converged_{key}": round(float(np.mean(values)), 4) for key, values in ours.items()}
    return {
        "bench": NAME,
        "machine": machine(device),
        "inputs": inputs_of(inputs),
        "rows": rows,
        "summary": summary(rows) | converged,
    }


def _cases(
    device: Any, environments: dict[str, Floats], materials: tuple[Material, ...], size: int, paths: bool
) -> Iterable[tuple[Renderer, Case]]:
    meshes = specular_scene.sphere_and_torus(detail=48 if size < 100 else 192)
    camera = specular_scene.CAMERA
    state = FrameState(camera, size, size, n=64, show="specular", lookup="plain", antialias=False)
    base = MATERIALS[0].model_copy(update={"name": "shown"})
    for environment, cube in environments.items():
        renderer = Renderer(device, specular_scene.baked_scene(meshes, base, cube))
        rough = one_lobe("rough", 0.4, 0.4, 0.7, 0.5)
        shown = renderer.image(replace(state, n=1, materials={"shown": rough}))[..., 1] > 0
        for material in materials:
            qmc = renderer.converged(replace(state, materials={"shown": material}), REFERENCE_SPP)
            path = path_traced(meshes, material, cube, camera, size, PATH_SPP) if paths else None
            # the path tracer's pixels are areas: at silhouettes they show what is behind
            traced = None if path is None else Truth.of("path", path, eroded(shown))
            yield renderer, Case(material, environment, Truth.of("qmc", qmc, shown), traced)


def _compare(renderer: Renderer, case: Case, state: FrameState) -> list[dict[str, Any]]:
    state = replace(state, show="specular", lookup="plain", antialias=False, materials={"shown": case.material})
    split_sum = errors_of(case, renderer.image(replace(state, integrator="split-sum")))
    rows = []
    for n in NS:
        for name in INTEGRATORS:
            if name == "split-sum":
                errors = split_sum
            else:
                errors = errors_of(case, renderer.image(replace(state, integrator=name, n=n)))
            row = {"material": case.material.name, "environment": case.environment, "n": n, "integrator": name}
            rows.append(row | errors)
    return rows


def errors_of(case: Case, image: Floats) -> dict[str, float | None]:
    """Against qmc and against path tracing (None where it was left out)."""
    missing = {"psnr_path": None, "flip_path": None, "flip_path_worst_tile": None}
    return case.qmc.errors(image) | (missing if case.path is None else case.path.errors(image))


def eroded(shown: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels whose four neighbours are shown too."""
    inner = shown.copy()
    for axis in (0, 1):
        for step in (1, -1):
            inner &= np.roll(shown, step, axis)
    return inner


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Mean psnr_qmc per integrator and n, and how far `rings` stands above the others."""
    groups: dict[tuple[str, int], list[float]] = defaultdict(list)
    for row in rows:
        groups[row["integrator"], row["n"]].append(row["psnr_qmc"])
    means = {name: {str(n): round(float(np.mean(groups[name, n])), 2) for n in NS} for name in INTEGRATORS}
    above = {
        name: {n: round(means["rings"][n] - means[name][n], 2) for n in means[name]}
        for name in INTEGRATORS
        if name != "rings"
    }
    return {"psnr_qmc": means, "rings_above": above}
