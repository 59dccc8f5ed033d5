"""Lambent's material document, of the least version that holds the material."""

from __future__ import annotations

from pathlib import Path

from lambent.core.progress import Progress, silent
from lambent.materials.document import load_material
from lambent.materials.export.contract import Cost, Kind, Subject
from lambent.materials.export.matching import cost_of, material_of
from lambent.materials.export.resampling.resampled import CHECK_LOG2, pairs_of
from lambent.materials.fitting.account import evaluate

NAME = "Lambent material document"
ENDINGS = (".json",)
TAKES: tuple[Kind, ...] = ("material",)


def write(subject: Subject, path: Path, progress: Progress = silent) -> Cost:
    """Write the document as it is."""
    material = material_of(subject)
    material.save(path)
    pairs = pairs_of(material, CHECK_LOG2, seed=1)
    return cost_of(pairs, evaluate(load_material(path), pairs.samples), [])
