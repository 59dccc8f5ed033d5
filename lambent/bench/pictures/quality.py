"""Errors of a few samples per pixel: every integrator against the converged image of the same frame.

The test is the specular term of a sphere and a torus, ten materials plus the caller's, under several environments. The
error against qmc is sampling error; the error against path tracing also includes light between the shapes, which a
probe does not know. The converged image's own error against path tracing is reported with it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from lambent.bench.measuring.reference import Reference, by_n, mean
from lambent.bench.scenes.quality_inputs import MATERIALS, OWN_ENVIRONMENTS, one_lobe, read_inputs
from lambent.bench.scenes.specular_scene import path_traced, sphere_and_torus
from lambent.core.arrays import Flags, Floats
from lambent.core.progress import Progress, silent
from lambent.materials.document import Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import open_device
from lambent.realtime.objects.unbaked import CAMERA, unbaked_scene
from lambent.realtime.renderer import Renderer

NAME = "quality"
INTEGRATORS = ("lamps", "rings", "lobe-4.24", "lobe-4.25", "fis", "split-sum")


@dataclass(frozen=True)
class Effort:
    """Pixels along each side; samples per pixel of the references (0: no path tracing); the cases."""

    size_px: int = 128
    qmc_spp: int = 32768
    path_spp: int = 512
    ns: tuple[int, ...] = (3, 5, 7, 9, 11, 13, 15, 17, 19)
    materials: tuple[Material, ...] = MATERIALS
    environments: Mapping[str, Callable[[], Floats]] = field(default_factory=lambda: OWN_ENVIRONMENTS)


FULL, QUICK = Effort(), Effort(size_px=48, path_spp=0)


@dataclass(frozen=True)
class Case:
    """A material under an environment: the frame that shows it, converged and, on request, path traced."""

    material: Material
    environment: str
    renderer: Renderer
    state: FrameState
    qmc: Reference
    path: Reference | None

    def errors(self, image: Floats) -> dict[str, float | None]:
        """Against qmc and against path tracing; None if omitted."""
        found: dict[str, float | None] = {}
        for name, reference in (("qmc", self.qmc), ("path", self.path)):
            errors: Mapping[str, float] = reference.errors(image) if reference else {}
            found[f"psnr_{name}"], found[f"flip_{name}"] = errors.get("psnr"), errors.get("flip")
            found[f"flip_{name}_worst_tile"] = errors.get("flip_worst_tile")
        return found


def run(effort: Effort, inputs: Sequence[Path] = (), progress: Progress = silent) -> dict[str, Any]:
    """Rows material x environment x n x integrator; `inputs` are environments and materials, added to ours.

    `split-sum` does not depend on n: its one image appears in every row of its material and environment.
    """
    more, measured = read_inputs(inputs, progress)
    environments = {name: make() for name, make in effort.environments.items()} | more
    materials = (*effort.materials, *measured)
    rows: list[dict[str, Any]] = []
    own: dict[str, list[float]] = defaultdict(list)
    for done, case in enumerate(_cases(environments, materials, effort)):
        rows += _rows(case, effort.ns)
        for key, value in case.errors(case.qmc.radiance).items():
            if key.endswith("_path") and value is not None:
                own[key].append(value)
        progress(done + 1, len(environments) * len(materials), f"{case.material.name}, {case.environment}")
    return {"rows": rows, "summary": summary(rows) | {f"converged_{key}": mean(4)(own[key]) for key in own}}


def _cases(environments: Mapping[str, Floats], materials: Sequence[Material], effort: Effort) -> Iterator[Case]:
    device, size = open_device(), effort.size_px
    meshes = sphere_and_torus(detail=48 if size < 100 else 192)
    state = FrameState(CAMERA, size, size, show="specular", lookup="plain", antialias=False)
    base = MATERIALS[0].model_copy(update={"name": "shown"})
    for environment, cube in environments.items():
        renderer = Renderer(device, unbaked_scene(meshes, base, cube))
        rough = one_lobe("rough", 0.4, 0.4, 0.7, 0.5)
        shown = renderer.image(replace(state, n=1, materials={"shown": rough}))[..., 1] > 0
        for material in materials:
            frame = replace(state, materials={"shown": material})
            qmc, path = renderer.converged(replace(frame, n=64), effort.qmc_spp), None
            if effort.path_spp:
                traced = path_traced(meshes, material, cube, CAMERA, size, effort.path_spp)
                path = Reference.of(traced, eroded(shown))  # pixels are areas, and silhouettes include background
            yield Case(material, environment, renderer, frame, Reference.of(qmc, shown), path)


def _rows(case: Case, ns: Sequence[int]) -> list[dict[str, Any]]:
    def errors(integrator: str, n: int | None = None) -> dict[str, float | None]:
        return case.errors(case.renderer.image(replace(case.state, integrator=integrator, n=n)))

    split_sum = errors("split-sum")
    about = {"material": case.material.name, "environment": case.environment}
    return [
        {**about, "n": n, "integrator": name, **(split_sum if name == "split-sum" else errors(name, n))}
        for n in ns
        for name in INTEGRATORS
    ]


def eroded(shown: Flags) -> Flags:
    """Shown pixels whose four neighbours are shown too."""
    beside = (np.roll(shown, step, axis) for axis in (0, 1) for step in (1, -1))
    return np.asarray(np.logical_and.reduce([shown, *beside]))


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Mean psnr_qmc per integrator and n, and the lead of `rings` over the others."""
    means = by_n(rows, "integrator", "psnr_qmc", mean(2))
    rings = means["rings"]
    others = {name: series for name, series in means.items() if name != "rings"}
    above = {name: {n: round(rings[n] - psnr, 2) for n, psnr in series.items()} for name, series in others.items()}
    return {"psnr_qmc": means, "rings_above": above}
