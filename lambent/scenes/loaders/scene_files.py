"""Files that a scene's files refer to: in the scene's folder or below, with paths in any notation."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path, PureWindowsPath

from lambent.core.errors import UserError
from lambent.core.files import inside
from lambent.core.inputs import read_bytes

HINT = "put the file into the scene's folder or below"


class SceneFiles:
    """The files of one scene, below the folder `root`, by default that of its first file.

    `sources` are the files used so far, in order; `notes` tell which of them are spelt differently in the scene.
    """

    def __init__(self, first: Path, root: Path | None = None) -> None:
        self.root = first.resolve().parent if root is None else root
        self.sources = [first]
        self.notes: list[str] = []

    def use(self, path: Path) -> Path:
        """`path`, recorded as a source."""
        if path not in self.sources:
            self.sources.append(path)
        return path

    def read(self, path: Path, limit_bytes: int) -> bytes:
        """Content of a file, recorded as a source."""
        return read_bytes(self.use(path), limit_bytes)

    def path(self, name: str, file: Path, field: str) -> Path:
        """The path of `name` as written in `file`, possibly in Windows notation; it need not exist.

        If it does not exist, a single file whose path differs only in case is used instead.

        Raises
        ------
        UserError
            If the name leads out of the scene's folder.
        """
        if not name.strip():
            raise UserError("is not a file name", file=file, field=field, got=repr(name))
        if PureWindowsPath(name).drive:
            raise UserError("path leaves its folder", file=file, field=field, got=name, hint=HINT)
        try:
            path = inside(self.root, str(file.resolve().parent / name.replace("\\", "/")))
        except UserError as error:
            raise UserError(error.message, file=file, field=field, got=name, hint=HINT) from error
        spelt = path if _is_file(path) else _in_other_case(path, self.root)
        if spelt is None or spelt == path:
            return path
        note = f"{name} is spelt {spelt.relative_to(self.root).as_posix()} on disk"
        if note not in self.notes:
            self.notes.append(note)
        return spelt

    def find(self, name: str, file: Path, field: str) -> tuple[Path, bool]:
        """Like `path`; a name that leads out, or to a missing file, is also looked for beside `file`, without folders.

        Returns
        -------
        path, moved : Path, bool
            The file's path, which need not exist, and whether it was found only beside `file`.
        """
        last = PureWindowsPath(name.replace("/", "\\")).name
        is_beside = bool(last) and _is_file(file.resolve().parent / last)
        try:
            path = self.path(name, file, field)
        except UserError:
            if not is_beside:
                raise
        else:
            if path.is_file() or not is_beside:
                return path, False
        return self.path(last, file, field), True

    def look_for(
        self, what: str, name: str, file: Path, field: str, note: Callable[[str], None], otherwise: str = ""
    ) -> Path | None:
        """The file that `name` refers to in `file`, recorded as a source; None, with a note, if it is missing."""
        path, moved = self.find(name, file, field)
        if not path.is_file():
            note(f"{what} {name} is missing{otherwise}")
            return None
        if moved:
            note(f"{what} {name} was found beside {file.name}")
        return self.use(path)


def _is_file(path: Path) -> bool:
    """Whether a file of this name exists; handles impossible names too."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # too long, or contains a null character or a lone surrogate
        return False


def _in_other_case(path: Path, root: Path) -> Path | None:
    """The one file below `root` whose path differs from `path` only in case; None without one."""
    root = root.resolve()
    found = [root]
    for part in path.relative_to(root).parts if path.is_relative_to(root) else ():
        entries = [entry for folder in found if folder.is_dir() for entry in folder.iterdir()]
        found = [entry for entry in entries if entry.name.casefold() == part.casefold()]
    files = [one for one in found if one.is_file()]
    return files[0] if len(files) == 1 and len(found) == 1 else None
