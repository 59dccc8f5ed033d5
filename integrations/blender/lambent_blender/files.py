"""Files that a .blend refers to or holds, copied beside the exported scene."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path, PurePath

import bpy


def missing_files():
    """A sentence for each library and each used image of the .blend whose file is missing."""
    images = [one for one in bpy.data.images if one.users and one.source == "FILE" and one.packed_file is None]
    for kind, block in [*(("library", one) for one in bpy.data.libraries), *(("image", one) for one in images)]:
        path = bpy.path.abspath(block.filepath, library=block.library)
        if not Path(path).is_file():
            yield f"{kind} {block.name}: {path} is missing: what uses it lacks it"


@dataclass
class Copies:
    """Copies below `folder`; what is missing goes to `note`."""

    folder: Path
    note: object
    _taken: dict = field(default_factory=dict)  # source -> name below the folder

    def take(self, file, owner, into, what, otherwise="left out"):
        """Name below the folder of a copy of a file, a path or a text; None, with a note, if it is missing."""
        if not isinstance(file, str):
            return self.write(file.name, file.as_string().encode(), into, file)
        if file.startswith("//") and not (bpy.data.filepath or owner.library):
            self.note(f"{what}: {file} is relative to a .blend that is not saved: {otherwise}")
            return None
        path = Path(bpy.path.abspath(file, library=owner.library))
        try:
            return self.write(path.name, path.read_bytes(), into, path.resolve())
        except OSError as error:
            self.note(f"{what}: {path} cannot be read ({error.strerror}): {otherwise}")
            return None

    def write(self, name, content, into, source):
        """Name below the folder of a file with this content; the same source is written once."""
        if source not in self._taken:
            target = self.folder / into / self._free(into, PurePath(name.replace("\\", "/")).name or "file")
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
            self._taken[source] = target.relative_to(self.folder).as_posix()
        return self._taken[source]

    def _free(self, into, name):
        taken, stem = {one.casefold() for one in self._taken.values()}, Path(name)
        return free_name(stem.stem, lambda one: f"{into}/{one}{stem.suffix}".casefold() in taken) + stem.suffix


def free_name(name, is_taken):
    """`name`, or the first of name_2, name_3, ... that is not taken."""
    number, wanted = 1, name
    while is_taken(wanted):
        number += 1
        wanted = f"{name}_{number}"
    return wanted


class UniqueNames(set):
    """Names that are taken."""

    def unique(self, name):
        """The name, or one with a number; it is taken from now on."""
        found = free_name(name, self.__contains__)
        self.add(found)
        return found
