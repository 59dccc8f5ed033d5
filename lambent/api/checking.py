"""Whether materials, tables and models are physical."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from lambent.api.converting import material_or_table
from lambent.api.materials import Material
from lambent.api.progress import Wanted, progress_of
from lambent.api.tables import Reconstruction, Table
from lambent.core.errors import UserError, did_you_mean

if TYPE_CHECKING:
    from lambent.materials.checking.check import CheckReport
    from lambent.materials.checking.check_table import TableReport


def check(
    subject: Material | Table | str | Path,
    *,
    seed: int = 0,
    reconstruction: Reconstruction = "auto",
    progress: Wanted = None,
    **values: float | tuple[float, ...],
) -> CheckReport | TableReport:
    """Check reciprocity, energy, and the sampler by chi-square and hemisphere integrals.

    Parameters
    ----------
    subject : Material, Table, str or Path
        Or the file of one, or the name of a model.
    seed : int
        The same seed gives the same report.
    reconstruction
        As of `lambent.read`.
    progress : bool or callable, optional
        As of `Table.fit`.
    **values
        Parameters of a model: numbers, or RGB.

    Returns
    -------
    CheckReport or TableReport
        `passed`, `failures` and `warnings` in words, and the figures.

    Raises
    ------
    UserError
        If the file cannot be read, or the model or a parameter is unknown.
    """
    from lambent.materials.checking.check import check as check_bsdf
    from lambent.materials.checking.check_table import check_table
    from lambent.materials.models import models

    with progress_of(progress) as bar:
        if isinstance(subject, str) and not Path(subject).exists():
            if subject not in (known := models()):
                expected = f"a file, or a model: {', '.join(known)}"
                hint = did_you_mean(subject, known)
                raise UserError("is neither a file nor a model", got=subject, expected=expected, hint=hint)
            return check_bsdf(known[subject](**values), seed=seed, progress=bar)
        if values:
            raise UserError("only a model takes parameters", field="--set", got=next(iter(values)))
        found = material_or_table(subject, reconstruction)
        if isinstance(found, Material):
            return check_bsdf(found.document, seed=seed, progress=bar)
        return check_table(found.table, seed=seed, progress=bar)
