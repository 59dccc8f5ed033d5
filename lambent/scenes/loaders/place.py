"""Files that a scene's files name: in the scene's folder or below, however they were written down."""

from __future__ import annotations

from pathlib import Path, PureWindowsPath

from lambent.core.errors import UserError
from lambent.core.files import inside

HINT = "put the file into the scene's folder or below"


def named(name: str, file: Path, root: Path, field: str) -> Path:
    """The path of `name` as written in `file`, which may be Windows's, below the folder `root`; it need not exist.

    Raises
    ------
    UserError
        Where the name leads out of `root`.
    """
    if not name.strip():
        raise UserError("is not a file name", file=file, field=field, got=repr(name))
    written = name.replace("\\", "/")
    if PureWindowsPath(name).drive:
        raise UserError("path leaves its folder", file=file, field=field, got=name, hint=HINT)
    try:
        return inside(root, str(file.resolve().parent / written))
    except UserError as error:
        raise UserError(error.message, file=file, field=field, got=name, hint=HINT) from error


def found(name: str, file: Path, root: Path, field: str) -> tuple[Path, bool]:
    """As `named`; a name that leads out, or nowhere, is also looked for beside `file`, without its folders.

    Returns
    -------
    path, moved : Path, bool
        Where the file is, and whether it was found beside `file` alone. The path need not exist.
    """
    last = PureWindowsPath(name.replace("/", "\\")).name
    beside = file.resolve().parent / last if last and "\0" not in name else None
    try:
        path = named(name, file, root, field)
    except UserError:
        if beside is not None and beside.is_file():
            return named(last, file, root, field), True
        raise
    if not path.is_file() and beside is not None and beside.is_file():
        return named(last, file, root, field), True
    return path, False
