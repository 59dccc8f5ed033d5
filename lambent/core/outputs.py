"""Which existing files a command may overwrite.

Pictures, films, plots and reports drawn by Lambent carry a mark in their metadata, and the next run overwrites them:
nobody edits them by hand. Any other existing file is overwritten only on request: users edit documents and converted
tables, and other programs' files are not ours. A command's own input is never overwritten without a request.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from lambent.core.errors import UserError
from lambent.core.files import check_place
from lambent.core.inputs import open_input

MARK = "Lambent made this file and may replace it"
OF_FILES = (
    ".binary", ".blend", ".bmp", ".bpt", ".bsdf", ".csv", ".exr", ".gif", ".gldf", ".glb", ".gltf", ".gonio", ".hdr",
    ".htm", ".html", ".ies", ".jpeg", ".jpg", ".json", ".ldt", ".mp4", ".mtlx", ".obj", ".pdf", ".ply", ".png", ".svg",
    ".tga", ".tif", ".tiff", ".toml", ".txt", ".webp", ".xml", ".zip",
)  # endings of files, never of a folder  # fmt: skip
_HEAD_BYTES, _TAIL_BYTES = 8 << 20, 1 << 16  # a film's mark follows the sizes of its frames, 8 bytes each


def check_output(path: Path, suffixes: Iterable[str] = (), *, force: bool, inputs: Iterable[Path | str] = ()) -> None:
    """Raise `UserError` if a command cannot, or may not, write `path`; called before long work.

    Parameters
    ----------
    path : Path
        The file to write.
    suffixes : iterable of str
        Allowed suffixes; any if empty.
    force : bool
        Overwrite any existing file, as the user requested.
    inputs : iterable of path
        Files that the command reads.
    """
    allowed = tuple(suffixes)
    if allowed and path.suffix.lower() not in allowed:
        raise UserError("unknown kind of file", file=path, got=path.suffix or None, expected=", ".join(allowed))
    check_place(path)
    if force or not path.exists():
        return
    if any(Path(other).exists() and path.samefile(other) for other in inputs):
        raise UserError("output is the input", file=path, hint="write to another file, or add --force to replace it")
    if not is_marked(path):
        raise UserError("exists already", file=path, hint="write to another file, or add --force to replace it")


def check_new_folder(path: Path, what: str) -> None:
    """Raise `UserError` if a folder for `what`, such as "a site", is to be made and named like a file."""
    if not path.exists() and path.suffix.lower() in OF_FILES:
        expected = f"the name of a folder, such as {path.stem}"
        raise UserError(f"names a file, and {what} is a folder", file=path, expected=expected)


def is_marked(path: Path) -> bool:
    """Whether the file at `path` carries Lambent's mark; False if it cannot be read."""
    try:
        with open_input(path) as file:
            head = file.read(_HEAD_BYTES)
            file.seek(max(file.tell(), path.stat().st_size - _TAIL_BYTES))
            return MARK.encode("ascii") in head or MARK.encode("ascii") in file.read(_TAIL_BYTES)
    except (OSError, UserError):
        return False
