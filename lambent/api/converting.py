"""Measurements and materials in other tools' formats."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, cast

from lambent.api.materials import Material
from lambent.api.progress import Wanted, progress_of
from lambent.api.reading import kind_of, read
from lambent.api.tables import Reconstruction, Table
from lambent.core.errors import UserError

if TYPE_CHECKING:
    from lambent.materials.export.contract import Cost


def convert(
    subject: Material | Table | str | Path,
    file: str | Path,
    *,
    as_: str | None = None,
    reconstruction: Reconstruction = "auto",
    progress: Wanted = None,
) -> Cost:
    """Write a material or a measured table in another format.

    Parameters
    ----------
    subject : Material, Table, str or Path
        Or the file of one.
    file : str or Path
        To write; replaced if it exists. Its ending selects the format.
    as_ : str, optional
        Format by name, where several have the ending.
    reconstruction
        As of `lambent.read`.
    progress : bool or callable, optional
        As of `Table.fit`.

    Returns
    -------
    Cost
        What is `lost` in words, `errors` and `share` by metric, and a `verdict`: faithful, approximate or unusable.

    Raises
    ------
    UserError
        If the ending or format is unknown, the format cannot hold the subject, or the file cannot be written.
    """
    from lambent.materials.export.contract import writer_for
    from lambent.materials.export.resampling.resampled import read_back
    from lambent.materials.measured.registry import is_known

    file, writer = Path(file), writer_for(Path(file), as_)
    found = material_or_table(subject, reconstruction)
    kind = "material" if isinstance(found, Material) else "table"
    if kind not in writer.TAKES:
        hint = f"fit it first: lambent fit {found.name} -o material.json" if kind == "table" else None
        raise UserError(f"is a {kind}, which {writer.NAME} cannot hold", file=found.name, hint=hint)
    content = found.document if isinstance(found, Material) else found.table
    with progress_of(progress) as bar:
        cost = writer.write(content, file, bar)
        return cost if cost.errors or not is_known(file) else read_back(content, file, cost.lost)


def material_or_table(
    subject: Material | Table | str | Path, reconstruction: Reconstruction = "auto"
) -> Material | Table:
    """The material or table of a file, if it is not one already; `UserError` for files of other kinds."""
    if not isinstance(subject, str | Path):
        return subject
    if (kind := kind_of(subject)) not in ("material", "table"):
        got = "a folder" if Path(subject).is_dir() else f"a {kind}"
        raise UserError("cannot be used", file=str(subject), got=got, expected="a material or a measured table")
    return cast(Material | Table, read(subject, reconstruction=reconstruction))
