"""The folder of an export: a new one, or an earlier export, which stays whole until the new one takes its place.

What is large is in files that are named by their content, so those of both exports stand beside each other. Files with
names of their own are written beside the former ones and renamed at the end, the manifest last; then the files that
are no longer named go. A kill between these renames mixes the pages of two exports, which are the same unless two
versions of Lambent made them.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from importlib.resources import as_file, files
from pathlib import Path

from lambent.core.errors import UserError
from lambent.core.files import atomic_path, write_text
from lambent.core.inputs import read_head
from lambent.core.outputs import check_new_folder

MANIFEST = "manifest.json"
UNFINISHED = '"version":0}'  # how the manifest of a new export ends until the rest of it is there


class Replacement:
    """What is to take the place of an export."""

    def __init__(self, folder: Path, renames: ExitStack) -> None:
        self._folder, self._renames = folder, renames
        self.named: set[str] = set()  # files that are named by their content

    def add(self, name: str, content: bytes) -> None:
        """Write a file that takes its place at the end, after those that are added later."""
        self._renames.enter_context(atomic_path(self._folder / name)).write_bytes(content)

    def add_page(self, page: str, suffixes: Iterable[str]) -> None:
        """Add the files of a folder of the package that have these suffixes."""
        with as_file(files("lambent.site").joinpath(page)) as source:
            for file in source.iterdir():
                if file.suffix in suffixes:
                    self.add(file.name, file.read_bytes())


@contextmanager
def replacing(folder: Path, form: str, parts: Iterable[str]) -> Iterator[Replacement]:
    """Context of an export into a checked folder, in which `parts` are the folders of files named by their content.

    If the block raises, the former export stays, or a new folder is said to hold an unfinished one.
    """
    if not (folder / MANIFEST).is_file():
        write_text(folder / MANIFEST, f'{{"format":{json.dumps(form)},{UNFINISHED}')
    former = set(_names(folder, parts))
    with ExitStack() as renames:
        one = Replacement(folder, renames)
        try:
            yield one
        except BaseException:
            _remove(folder, set(_names(folder, parts)) - former)
            raise
    _remove(folder, set(_names(folder, parts)) - one.named)


def is_unfinished(folder: Path) -> bool:
    """Whether a folder holds an export that did not come to its end."""
    return (folder / MANIFEST).is_file() and read_head(folder / MANIFEST, 128).endswith(UNFINISHED.encode())


def check_folder(folder: Path, form: str, what: str) -> None:
    """Raise `UserError` if the folder holds anything but an export of this format, or has the name of a file."""
    check_new_folder(folder, "an export")
    if not folder.exists():
        return
    if not folder.is_dir():
        raise UserError("is no folder", file=folder, expected="a folder to write")
    if any(folder.iterdir()):
        manifest = folder / MANIFEST
        head = f'{{"format":"{form}"'.encode()
        if not manifest.is_file() or not read_head(manifest, len(head)).startswith(head):
            raise UserError(f"holds other files than {what}", file=folder, hint="choose a new folder")


def _names(folder: Path, parts: Iterable[str]) -> Iterator[str]:
    for part in parts:
        yield from (f"{part}/{one.name}" for one in (folder / part).glob("*") if one.is_file())


def _remove(folder: Path, names: Iterable[str]) -> None:
    for name in names:
        (folder / name).unlink(missing_ok=True)
