"""The materials and environments of `quality`: built-in ones, and the caller's.

A caller's file is a lat-long image (an environment), a material document (.json), or a measured table, which is fitted
first with one lobe, as by `lambent fit`.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.plain import Triple
from lambent.core.progress import Progress, silent
from lambent.materials.document import Lobe, Material, load_material
from lambent.materials.fitting.fit import fit
from lambent.materials.measured import registry
from lambent.scenes.sky.environment_images import read_lat_long
from lambent.scenes.sky.environments import dusk, from_lat_long, night, studio

OWN_ENVIRONMENTS = {"studio": studio, "night": night, "dusk": dusk}


def one_lobe(name: str, mx: float, my: float, r0: Triple | float, alpha: float) -> Material:
    rgb = (r0, r0, r0) if isinstance(r0, float) else r0
    return Material(name=name, lobes=(Lobe(mx=mx, my=my, r0=rgb, alpha=alpha),))


MATERIALS = (
    one_lobe("polished .02", 0.02, 0.02, (0.9, 0.7, 0.4), 0.5),
    one_lobe("satin .05", 0.05, 0.05, 0.8, 0.5),
    one_lobe("satin .1", 0.1, 0.1, 0.9, 0.3),
    one_lobe("matte .15", 0.15, 0.15, (0.95, 0.6, 0.5), 0.5),
    one_lobe("matte .25", 0.25, 0.25, 0.8, 0.5),
    one_lobe("rough .4", 0.4, 0.4, 0.7, 0.5),
    one_lobe("dielectric .1", 0.1, 0.1, 0.04, 0.0),
    one_lobe("alanod .11/.072", 0.11, 0.072, 0.89, 0.43),
    one_lobe("miro .013/.12", 0.013, 0.1199, 0.84, 0.38),
    one_lobe("brushed .3/.1", 0.3, 0.1, 0.8, 0.5),
)


def read_inputs(paths: Iterable[Path], progress: Progress = silent) -> tuple[dict[str, Floats], tuple[Material, ...]]:
    """Environments (6, N, N, 3) by name, and the specular part of the materials, each named after its file.

    Raises
    ------
    UserError
        If a file is of none of the three kinds, is broken, or is a material without specular reflection.
    """
    environments: dict[str, Floats] = {}
    materials: list[Material] = []
    for path in paths:
        if path.suffix.lower() == ".json":
            materials.append(specular_part(load_material(path), path))
        elif registry.is_known(path):
            materials.append(specular_part(fit(registry.load(path), progress=progress).material, path))
        else:
            environments[path.stem] = from_lat_long(read_lat_long(path))
    return environments, tuple(materials)


def specular_part(material: Material, file: Path) -> Material:
    """The lobes of reflection alone: the bench shows closed shapes and compares specular light."""
    if not material.reflection_lobes:
        raise UserError("reflects nothing specularly", file=file, expected="a lobe of reflection")
    return Material(name=file.stem, lobes=material.reflection_lobes)
