"""Load any description of a material as terms and curves, with the error of the factorisation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import FLIP_Z
from lambent.core.inputs import read_head
from lambent.core.progress import Progress, silent
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Material, load_material
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import editable
from lambent.materials.factored.of_textures import of_textures
from lambent.materials.factored.quotients import One
from lambent.materials.factored.tabulated import Grid
from lambent.materials.factored.terms import Editable
from lambent.materials.fitting.factors import Factored, factorise, judged
from lambent.materials.measured.homomorphic import HomomorphicTable
from lambent.materials.measured.protocol import GRAZING_DEG, LeftOut, MeasuredSamples, MeasuredTable, TableInfo
from lambent.materials.measured.registry import load
from lambent.materials.models.model import Model

_JUDGED = Grid(40, 12, 8, 4, turns_d=2)


def editable_of(subject: Path | str | Material | Model | MeasuredTable, progress: Progress = silent) -> Factored:
    """Terms and curves of a material document, a model, a measured table or homomorphic factors.

    Parameters
    ----------
    subject
        The object, or the path of a measured file or a material document; the content decides which.

    Returns
    -------
    Factored
        The editable, and its errors by metric relative to a black surface: at the tuples of a table; for a document or
        a model, which have exact curves, at half and difference angles.

    Raises
    ------
    UserError
        If the file is missing, of no known kind or broken, or the model has no decomposition.
    """
    if isinstance(subject, Path | str):
        path = Path(subject)
        return editable_of(load_material(path) if _begins_as_json(path) else load(path), progress)
    if isinstance(subject, Material):
        return _judged_everywhere(of_material(subject), MaterialBSDF(subject).eval)
    if isinstance(subject, Model):
        return _judged_everywhere(editable(subject), subject.eval)
    if isinstance(subject, HomomorphicTable):
        found = of_textures(subject)
        plain = replace(found, terms=tuple(replace(term, quotient=One()) for term in found.terms))
        return judged(found, subject.samples(), plain)
    return factorise(subject, progress)


def _begins_as_json(path: Path) -> bool:
    return path.is_file() and read_head(path, 64).lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{")


def _judged_everywhere(found: Editable, evaluate: Callable[[Floats, Floats], Floats]) -> Factored:
    """Errors against a formula, at half and difference angles."""
    wi, wo = (w.reshape(-1, 3) for w in _JUDGED.directions())
    above = np.minimum(wi[:, 2], wo[:, 2]) > np.cos(np.radians(GRAZING_DEG))
    wi, wo, weight = wi[above], wo[above], _JUDGED.solid_angles()[above]
    across = any(term.side == "transmission" for term in found.terms)
    if across:
        wi, wo, weight = np.concatenate([wi, wi]), np.concatenate([wo, wo * FLIP_Z]), np.concatenate([weight, weight])
    info = TableInfo(found.name, "formula", False, across, 3, "f")
    return judged(found, MeasuredSamples(wi, wo, evaluate(wi, wo), weight, LeftOut(), info))
