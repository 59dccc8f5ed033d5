"""Files of the editor: their kinds, loading, and saving a material with its provenance."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Literal

from lambent.core.errors import UserError
from lambent.core.inputs import read_head
from lambent.core.plain import plain_name
from lambent.materials.document import Material, Provenance, is_document, load_material
from lambent.viewer.background.work import Work, pending
from lambent.viewer.editor.measurement import Measurement, read_measurement
from lambent.viewer.editor.subject import Subject, same_numbers
from lambent.viewer.edits.edits import file_in
from lambent.viewer.screen import Screen

Kind = Literal["material", "environment", "measurement"]

ENVIRONMENTS = (".hdr", ".exr")
BY_HAND = "edited by hand"


def kind_of(path: Path) -> Kind:
    """Kind of a file, by its suffix and its first bytes; `UserError` if it cannot be read."""
    if path.suffix.lower() in ENVIRONMENTS:
        return "environment"
    head = read_head(path, 64)
    return "material" if is_document(head) else "measurement"


def with_account(
    material: Material, origin: Material, measurement: Measurement | None, errors: Mapping[str, float]
) -> Material:
    """The material to save, with the provenance of its `origin` and a note if numbers changed.

    `errors` are the errors E against the measurement, by metric; empty without a measurement.
    """
    before = origin.provenance
    if same_numbers(material, origin):
        return material.model_copy(update={"provenance": before})
    fitted = before is not None and before.method is not None
    note = f"{BY_HAND} after the fit" if fitted else BY_HAND
    account = before or Provenance()
    if measurement is not None:
        info = measurement.samples.info
        note += f"; the errors compare these numbers with {info.file}"
        source, source_format = account.source or info.file, account.source_format or info.format
        account = account.model_copy(update={"errors": dict(errors), "source": source, "source_format": source_format})
    elif account.errors:
        note += "; the errors are from before the edit"
    notes = (*(n for n in account.notes if not n.startswith(BY_HAND)), note)
    return material.model_copy(update={"provenance": account.model_copy(update={"notes": notes})})


def document_file(folder: Path, text: str, *, bare: bool = False) -> Path:
    """The .json file of a typed name or path, in `folder` if relative; a `bare` name may have no folder.

    Raises `UserError` if the name cannot be used or the file cannot be written.
    """
    name = text.strip()
    if not name.endswith(".json") or Path(name).name == ".json" or (bare and Path(name).name != name):
        raise UserError("is not a file name", got=text, expected="a file name, as in walnut.json")
    return file_in(folder, name)


def typed_path(text: str) -> Path:
    """A typed or dropped path, without surrounding blanks and quotes, ~ expanded; `UserError` if it is empty."""
    plain = text.strip().removeprefix("file://").strip("'\" ")
    if not plain:
        raise UserError("no file name given", hint="type a path")
    return Path(plain).expanduser()


class Files:
    """Opens and saves files, and reports success or failure on the screen; a failure changes nothing.

    `show` is called with a measurement once it is read. The document is saved as `name`.
    """

    def __init__(self, subject: Subject, screen: Screen, show: Callable[[Measurement], None]) -> None:
        self._subject, self._screen, self._show = subject, screen, show
        self.name = f"{plain_name(subject.material.name)}.json"
        self.typed: dict[str, str] = {}  # texts of the fields for paths, by label
        self.loading: Work | None = None
        self.adopted: Callable[[], None] = lambda: None  # called after a document was loaded
        self.open_environment: Callable[[Path], None] | None = None  # None without a preview
        self._may_replace: set[Path] = set()

    def open(self, text: str) -> None:
        """Load a file that the user named: a measurement, a material document, or an environment."""
        try:
            path = typed_path(text)
            kind = kind_of(path)
            if kind == "material":
                self._subject.adopt(load_material(path))
                self.adopted()
                self._may_replace.clear()
                self.came_from(path)
                self._screen.say(f"loaded the material of {path.name}; undo restores the previous one")
            elif kind == "measurement":
                self._read(path)
            elif self.open_environment is None:
                raise UserError("an environment can be dropped only in `lambent edit`", file=path)
            else:
                self.open_environment(path)
        except UserError as error:
            self._refuse(error)

    def open_compared(self, text: str) -> None:
        """Load the document to compare with."""
        try:
            self._subject.compare_with(load_material(typed_path(text)))
        except UserError as error:
            self._refuse(error)

    def _refuse(self, error: UserError) -> None:
        self._screen.say(f"not loaded: {error}")

    def _read(self, path: Path) -> None:
        if self.loading is not None:
            raise UserError("still reading another file; try again when it is done", file=path)
        self.loading = Work(lambda progress: read_measurement(path, progress), self._show, self._refuse)

    def poll(self) -> None:
        """Take a measurement that was read in the background."""
        self.loading = pending(self.loading)

    def came_from(self, path: Path) -> None:
        """Save to `path` from now on without asking for confirmation: the material came from there."""
        self.name = str(path)
        self._may_replace.add(path.resolve())

    def save(self, measurement: Measurement | None) -> None:
        """Write the document with its provenance; replace an unrelated file only at the second try."""
        subject, material = self._subject, self._subject.material

        def document() -> Material:
            errors = measurement.exact_errors(material) if measurement else {}
            return with_account(material, subject.origin, measurement, errors)

        if write_document(document, self._screen, self.name, self._may_replace):
            subject.edits.saved[subject.name] = material


def write_document(
    document: Callable[[], Material], screen: Screen, name: str, may_replace: set[Path], *, bare: bool = False
) -> bool:
    """Write a material to the file of a typed name, and report success or failure; return whether it was written.

    A file that is not in `may_replace` is replaced only at the second try; `name` and `bare` as in `document_file`.
    `document`, which may measure errors for seconds, is called only when there is a file to write.
    """
    try:
        file = document_file(screen.folder, name, bare=bare)
        if file.exists() and file.resolve() not in may_replace:
            may_replace.add(file.resolve())
            screen.say(f"{file.name} exists: save again to replace it")
            return False
        document().save(file)
    except (UserError, OSError) as error:
        screen.say(f"not saved: {error}")
        return False
    may_replace.add(file.resolve())
    screen.say(f"saved {file}")
    return True
