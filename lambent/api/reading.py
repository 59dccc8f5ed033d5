"""`lambent.read` and `lambent.open`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from lambent.core.errors import UserError
from lambent.core.inputs import BUILTIN_PREFIX, read_head

if TYPE_CHECKING:
    from lambent.api.luminaires import Luminaire
    from lambent.api.materials import Material
    from lambent.api.pictures import Picture
    from lambent.api.scenes import Scene
    from lambent.api.stores import Store
    from lambent.api.tables import Reconstruction, Table

HEAD_BYTES = 1 << 16  # a Mitsuba scene identifies itself within these
PICTURES = (b"v/1\x01", b"#?RADIANCE", b"#?RGBE", b"\x89PNG", b"\xff\xd8\xff")
Kind = Literal["scene", "store", "picture", "material", "luminaire", "table"]


def read(
    file: str | Path, *, reconstruction: Reconstruction = "auto", crease_deg: float | None = None
) -> Table | Material | Scene | Store | Picture | Luminaire:
    """Read a file of Lambent or of another tool; its content says what it is.

    Parameters
    ----------
    file : str or Path
        A measured table, a material document, a scene or "builtin:NAME", the folder of a store, an image, or a
        photometric file.
    reconstruction
        Of tables: how a gonio table is interpolated between incident directions; "auto" measures which is best.
    crease_deg : float, optional
        Of scenes: as for `lambent bake --crease-angle`.

    Raises
    ------
    UserError
        If the file is missing, of no known kind or damaged, or an option is of another kind of file.
    """
    kind = kind_of(file)
    if reconstruction != "auto" and kind != "table":
        raise UserError("applies to measured tables only", file=str(file), field="--reconstruction")
    if crease_deg is not None and kind != "scene":
        raise UserError("applies to scenes only", file=str(file), field="--crease-angle")
    if kind == "scene":
        from lambent.api.scenes import Scene

        return Scene.read(file, crease_deg)
    if kind == "store":
        from lambent.api.stores import Store

        return Store(file)
    if kind == "picture":
        from lambent.api.pictures import Picture

        return Picture.read(file)
    if kind == "material":
        from lambent.api.materials import Material

        return Material.read(file)
    if kind == "luminaire":
        from lambent.api.luminaires import Luminaire

        return Luminaire.read(file)
    from lambent.api.tables import Table

    return Table.read(file, reconstruction)


def open(folder: str | Path) -> Store:
    """Open the store of a baked scene; raises `UserError` if the folder is no store."""
    from lambent.api.stores import Store

    return Store(folder)


def kind_of(file: str | Path) -> Kind:
    """What a file is, by its path and its first bytes; `UserError` if it cannot be read."""
    from lambent.materials.document import is_document
    from lambent.materials.measured.registry import claims

    path = Path(file)
    if str(file).startswith(BUILTIN_PREFIX):
        return "scene"
    if path.is_dir():
        return "store"
    head = read_head(path, HEAD_BYTES)
    if head.startswith(PICTURES):
        return "picture"
    if claims(head, path):  # asked before the loaders of scenes, which take a second to import
        return "table"
    from lambent.scenes.loaders.load import is_scene
    from lambent.scenes.photometry.files import is_luminaire

    if is_scene(path, head):
        return "scene"
    if is_document(head):
        return "material"
    return "luminaire" if is_luminaire(path, head) else "table"
