"""The specular integrators: shader, constants and table of samples of each.

To add one, write a file in this folder with `integrate(index, wo, surface)`, and add a row here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.materials.document import Lobe
from lambent.realtime.integrators import patterns
from lambent.realtime.integrators.albedo import TABLE_ROWS, albedo_table, normalised_rings_table

# Kinds of MIP levels: smooth_chain or mip_chain of cube_mips.py, or prefiltered by roughness. Integrators from
# publications keep the published kind. `cleaned` is an array of smooth cube maps without lamps (probe_lamps.py).
Cube = Literal["smooth", "box", "prefiltered", "cleaned"]


@dataclass(frozen=True, eq=False)
class Integrator:
    """One integrator. `table(lobe, n)` gives (rows, 4) float32; `rows` is their number if it is not n."""

    shader: str
    table: Callable[[Lobe, int], Floats] = lambda lobe, n: np.zeros((n, 4), np.float32)
    constants: Mapping[str, float] = field(default_factory=dict)
    rows: int | None = None
    cube: Cube = "smooth"  # cube map of the probe; level 0 is the same for all kinds except prefiltered
    specular: bool = True
    progressive: bool = False  # unbiased: frames of few samples may be averaged
    lamps: str | None = None  # shader for a probe with lamps smaller than a lobe, which leave the cube map


SUN_SAMPLED = {"SUN_SAMPLED": 1}  # sampled, not in closed form: exact also for lobes narrower than the sun's disc
INTEGRATORS: dict[str, Integrator] = {
    "lamps": Integrator("rings.wgsl", normalised_rings_table, lamps="lamps.wgsl"),
    "rings": Integrator("rings.wgsl", normalised_rings_table),
    "lobe-4.24": Integrator("thesis.wgsl", patterns.lobe_table, {"FORMULA": 24}, cube="box"),
    "lobe-4.25": Integrator("thesis.wgsl", patterns.lobe_table, {"FORMULA": 25}, cube="box"),
    "fis": Integrator("quadrature.wgsl", patterns.fis_table, cube="box"),
    "split-sum": Integrator("split_sum.wgsl", lambda lobe, n: albedo_table(lobe), rows=TABLE_ROWS, cube="prefiltered"),
    "qmc": Integrator("qmc.wgsl", constants=SUN_SAMPLED, progressive=True),
    "diffuse": Integrator("diffuse.wgsl", specular=False),
}


def integrator(name: str) -> Integrator:
    """The integrator of that name; `UserError` for an unknown one."""
    return INTEGRATORS[known("integrator", name, INTEGRATORS)]
