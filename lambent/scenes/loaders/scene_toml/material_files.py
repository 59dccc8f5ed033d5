"""Material documents that a scene.toml, or a file of keyframes, refers to."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from lambent.core.errors import UserError
from lambent.core.inputs import read_head
from lambent.materials.document import Material, load_material
from lambent.scenes.loaders.scene_files import SceneFiles


def material_of_file(name: str, field: str, path: Path, files: SceneFiles) -> Material:
    """The material of a document; `UserError` for a measurement, which must be fitted first."""
    from lambent.materials.measured.registry import is_known

    source = files.path(name, path, field)
    if source.is_file() and not _begins_as_json(source) and is_known(source):
        fitted = source.with_suffix(".json").name
        hint = f"fit it first: lambent fit {source.name} -o {fitted}, then file = {fitted!r}"
        raise UserError("is a measurement, not a material", file=path, field=field, got=source.name, hint=hint)
    return load_material(files.use(source))


@dataclass(frozen=True)
class LookFiles:
    """The files that looks in `path`, a scene.toml or a file of keyframes, refer to."""

    path: Path
    files: SceneFiles

    def material(self, name: str, field: str) -> Material:
        """The material of a document: see `material_of_file`."""
        return material_of_file(name, field, self.path, self.files)

    def image(self, name: str, field: str) -> Path:
        """The path of an image, which need not exist."""
        return self.files.path(name, self.path, field)


def _begins_as_json(path: Path) -> bool:
    return read_head(path, 64).lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{")
