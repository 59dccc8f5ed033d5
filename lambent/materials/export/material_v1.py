"""Lambent's material document of version 1, without curves: lobes of numbers are fitted to what the curves scatter."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lambent.core.plain import triple
from lambent.core.progress import Progress, silent
from lambent.materials.document import BLACK, Material
from lambent.materials.export.contract import Cost, Kind, Subject
from lambent.materials.export.matching import cost_of, material_of
from lambent.materials.export.resampling.resampled import CHECK_LOG2, pairs_of
from lambent.materials.fitting.account import evaluate
from lambent.materials.fitting.fit import fit

NAME = "Lambent material document, version 1"
ENDINGS = (".json",)
TAKES: tuple[Kind, ...] = ("material",)
LOBES = 3  # fitted to each side


def write(subject: Subject, path: Path, progress: Progress = silent) -> Cost:
    """Write the document, with its curves fitted."""
    material = material_of(subject)
    plain = without_curves(material, progress)
    plain.save(path)
    lost = [] if plain is material else [f"curves: {LOBES} lobes a side were fitted to them"]
    pairs = pairs_of(material, CHECK_LOG2, seed=1)
    return cost_of(pairs, evaluate(plain, pairs.samples), lost)


def without_curves(material: Material, progress: Progress = silent) -> Material:
    """The material as version 1 can hold it: what has curves is fitted, the rest is kept."""
    if material.version == 1:
        return material
    bent = material.kd_curve is not None
    curved, kept = ([one for one in material.lobes if one.has_curves is on] for on in (True, False))
    rest = material.model_copy(
        update={"kd": material.kd if bent else BLACK, "kt_d": BLACK, "kd_coupled": False, "lobes": tuple(curved)}
    )
    samples = pairs_of(rest, CHECK_LOG2, seed=0).samples
    found = fit(samples, lobes=LOBES, distribution="best", progress=progress).material
    update = {
        "kd": triple(np.add(found.kd, BLACK if bent else material.kd)),
        "kt_d": triple(np.add(found.kt_d, material.kt_d)),
        "kd_curve": None,
        "lobes": (*kept, *found.lobes),
    }
    return material.model_copy(update=update)
