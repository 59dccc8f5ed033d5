"""How close a few samples come: every integrator against the converged picture of the same frame (spec: bench).

The specular term of a sphere and a torus, ten materials under several environments. Pictures are compared as
clip(e L)^(1/2.2) with e such that the reference has mean .3, PSNR over the pixels that show an object. The error
against qmc is the sampling's; against path tracing it holds what a probe cannot know too: the light between the shapes.
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
from lambent.core import metrics
from lambent.core.images import read_image
from lambent.core.progress import Progress, silent
from lambent.materials.document import Lobe, Material
from lambent.realtime.device import open_device
from lambent.realtime.frame import FrameState, Renderer
from lambent.store.contract import Triple

NAME = "quality"
Floats = NDArray[np.floating]
INTEGRATORS = ("rings", "lobe-4.24", "lobe-4.25", "fis", "split-sum")
NS = (3, 5, 7, 9, 11, 13, 15, 17, 19)
REFERENCE_SPP, PATH_SPP = 4096, 512
OWN_ENVIRONMENTS = {
    "studio": specular_scene.studio,
    "night": specular_scene.night,
    "dusk": specular_scene.dusk,
}


def _material(name: str, mx: float, my: float, r0: Triple | float, alpha: float) -> Material:
    rgb = (r0, r0, r0) if isinstance(r0, float) else r0
    return Material(name=name, lobes=(Lobe(mx=mx, my=my, r0=rgb, alpha=alpha),))


MATERIALS = (
    _material("polished .02", 0.02, 0.02, (0.9, 0.7, 0.4), 0.5),
    _material("satin .05", 0.05, 0.05, 0.8, 0.5),
    _material("satin .1", 0.1, 0.1, 0.9, 0.3),
    _material("matte .15", 0.15, 0.15, (0.95, 0.6, 0.5), 0.5),
    _material("matte .25", 0.25, 0.25, 0.8, 0.5),
    _material("rough .4", 0.4, 0.4, 0.7, 0.5),
    _material("dielectric .1", 0.1, 0.1, 0.04, 0.0),
    _material("alanod .11/.072", 0.11, 0.072, 0.89, 0.43),
    _material("miro .013/.12", 0.013, 0.1199, 0.84, 0.38),
    _material("brushed .3/.1", 0.3, 0.1, 0.8, 0.5),
)


@dataclass(frozen=True)
class Case:
    """One reference picture: a material under an environment."""

    material: Material
    environment: str
    reference: Floats
    path: Floats | None  # path traced, where there was time for it
    shown: NDArray[np.bool_]  # pixels that show an object


def run(quick: bool, inputs: list[Path], progress: Progress = silent) -> dict[str, Any]:
    """Rows material x environment x n x integrator; `inputs` are lat-long HDR pictures, added to our environments.

    `split-sum` does not know n: its one picture stands in every row of its material and environment. `quick` leaves
    out path tracing.
    """
    device = open_device()
    environments = {name: make() for name, make in OWN_ENVIRONMENTS.items()}
    environments |= {path.stem: specular_scene.from_lat_long(read_image(path)) for path in inputs}
    size = 48 if quick else 256
    rows: list[dict[str, Any]] = []
    cases = _cases(device, environments, size, paths=not quick)
    total = len(environments) * len(MATERIALS)
    for done, (renderer, case) in enumerate(cases):
        rows += _compare(renderer, case, FrameState(specular_scene.CAMERA, size, size))
        progress(done + 1, total, f"{case.material.name}, {case.environment}")
    return {
        "bench": NAME,
        "machine": machine(device),
        "inputs": inputs_of(inputs),
        "rows": rows,
        "summary": summary(rows),
    }


def _cases(
    device: Any, environments: dict[str, Floats], size: int, paths: bool = False
) -> Iterable[tuple[Renderer, Case]]:
    meshes = specular_scene.sphere_and_torus(detail=48 if size < 128 else 192)
    camera = specular_scene.CAMERA
    state = FrameState(camera, size, size, n=64, show="specular", lookup="plain", antialias=False)
    base = MATERIALS[0].model_copy(update={"name": "shown"})
    for environment, cube in environments.items():
        renderer = Renderer(device, specular_scene.baked_scene(meshes, base, cube))
        rough = _material("rough", 0.4, 0.4, 0.7, 0.5)
        shown = renderer.image(replace(state, n=1, materials={"shown": rough}))[..., 1] > 0
        for material in MATERIALS:
            reference = renderer.converged(replace(state, materials={"shown": material}), REFERENCE_SPP)
            path = path_traced(meshes, material, cube, camera, size, PATH_SPP) if paths else None
            yield renderer, Case(material, environment, reference, path, shown)


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
    """psnr, mean flip and its worst 16x16 tile against qmc and against path tracing (None where it was left out)."""
    errors: dict[str, float | None] = _errors(case.reference, image, case.shown, "qmc")
    if case.path is None:
        return errors | {"psnr_path": None, "flip_path": None, "flip_path_worst_tile": None}
    inner = _eroded(case.shown)  # the path tracer's pixels are areas: at silhouettes they show what is behind
    return errors | _errors(case.path * inner[..., None], image * inner[..., None], inner, "path")


def _errors(truth: Floats, image: Floats, shown: NDArray[np.bool_], name: str) -> dict[str, float | None]:
    reference, test = metrics.display_pair(truth, image)
    flip = metrics.flip_error(reference, test)
    return {
        f"psnr_{name}": round(metrics.psnr(reference[shown], test[shown]), 3),
        f"flip_{name}": round(float(flip.mean()), 5),
        f"flip_{name}_worst_tile": round(float(metrics.tile_means(flip).max()), 5),
    }


def _eroded(shown: NDArray[np.bool_]) -> NDArray[np.bool_]:
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
