"""Files of the editor: what a path holds, and what a saved material says about where its numbers come from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

from lambent.core.errors import UserError
from lambent.materials.document import Material, Provenance
from lambent.viewer.editor.measurement import Measurement

Kind = Literal["material", "environment", "measurement"]

ENVIRONMENTS = (".hdr", ".exr")
BY_HAND = "edited by hand"


def kind_of(path: Path) -> Kind:
    """What a file holds, as far as its beginning and its ending tell.

    Raises
    ------
    UserError
        Where it cannot be read.
    """
    if path.suffix.lower() in ENVIRONMENTS:
        return "environment"
    try:
        with path.open("rb") as file:
            head = file.read(64)
    except OSError as error:
        raise UserError(f"cannot be read ({error.strerror})", file=path) from error
    return "material" if head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{") else "measurement"


def same_numbers(a: Material, b: Material) -> bool:
    """Whether two materials scatter alike; names and provenance aside."""
    return a.model_copy(update={"name": b.name, "provenance": b.provenance}) == b


def with_account(
    material: Material, origin: Material, measurement: Measurement | None, errors: Mapping[str, float]
) -> Material:
    """The material as it is saved: the origin's provenance, and a note where its numbers were changed since.

    Parameters
    ----------
    origin : Material
        As it was fitted or loaded.
    errors : mapping
        Metric -> E of the material against the measurement; empty where there is none.
    """
    before = origin.provenance
    if same_numbers(material, origin):
        return material.model_copy(update={"provenance": before})
    fitted = before is not None and before.method is not None
    note = f"{BY_HAND} after the fit" if fitted else BY_HAND
    account = before or Provenance()
    if measurement is not None:
        info = measurement.samples.info
        note += f"; the errors are of these numbers against {info.file}"
        account = account.model_copy(
            update={
                "errors": dict(errors),
                "source": account.source or info.file,
                "source_format": account.source_format or info.format,
            }
        )
    elif account.errors:
        note += "; the errors are of the numbers before"
    notes = (*(n for n in account.notes if not n.startswith(BY_HAND)), note)
    return material.model_copy(update={"provenance": account.model_copy(update={"notes": notes})})


def target_of(folder: Path, text: str) -> Path:
    """The .json file that a typed name means, in `folder` unless it says otherwise; else a `UserError`."""
    name = text.strip()
    if not name.endswith(".json") or Path(name).name == ".json":
        raise UserError("not a file name", got=text, expected="a name like walnut.json")
    path = folder / Path(name).expanduser()
    if not path.parent.is_dir():
        raise UserError("no such folder", file=path.parent)
    if path.is_dir():
        raise UserError("is a folder", file=path)
    return path


def typed_path(text: str) -> Path:
    """The path that somebody typed or dropped: without blanks and quotes around it, ~ expanded; else a `UserError`."""
    plain = text.strip().removeprefix("file://").strip("'\" ")
    if not plain:
        raise UserError("no file named", hint="type its path")
    return Path(plain).expanduser()
