"""Reading a luminaire from a photometric file, of either format, recognised by its content."""

from __future__ import annotations

from pathlib import Path

from lambent.core.ceilings import IES_BYTES
from lambent.core.errors import UserError
from lambent.core.inputs import foreign_bytes
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.scenes.photometry.eulumdat import is_eulumdat, parse_eulumdat
from lambent.scenes.photometry.ies import is_ies, parse_ies
from lambent.scenes.photometry.luminaire import Luminaire

ENDINGS = (".ies", ".ldt", ".gldf")
FOREIGN = (b"PK\x03\x04", b"<?xml", b"<IESTM33")  # of GLDF; of IES TM-33


def read_luminaire(path: Path, files: SceneFiles | None = None) -> Luminaire:
    """Read an IES or EULUMDAT file; it may refer to `files`, by default those in its folder or below.

    Raises
    ------
    UserError
        If it is neither, or is damaged.
    """
    files = files or SceneFiles(path)
    return parse_luminaire(files.read(path, IES_BYTES), path, files)


def parse_luminaire(content: bytes, path: Path, files: SceneFiles) -> Luminaire:
    """`read_luminaire` for the content of the file at `path`."""
    with foreign_bytes("photometry", path):
        if is_ies(content):
            return parse_ies(content, path, files)
        if is_eulumdat(content) or path.suffix.lower() == ".ldt":
            return parse_eulumdat(content, path)
    if content.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(FOREIGN):
        raise UserError("GLDF and IES TM-33 are not read", file=path, hint="ask its maker for an .ies or .ldt file")
    raise UserError("is not an IES or EULUMDAT file", file=path, expected="a line TILT=..., or the lines of EULUMDAT")


def is_luminaire(path: Path, head: bytes) -> bool:
    """Whether a file that begins with `head` is photometry, by its ending or its content."""
    return path.suffix.lower() in ENDINGS or is_ies(head) or is_eulumdat(head) or b"<IESTM33" in head[:1000]
