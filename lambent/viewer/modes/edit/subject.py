"""Opens a scene file, a store, or a saved session as a session of one view, for `lambent edit`."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.inputs import read_head, sha256_of
from lambent.core.plain import plain_name, triple
from lambent.core.views.camera import Camera, overview
from lambent.editing.session.document import Surroundings
from lambent.editing.session.session import Session
from lambent.scenes.loaders.load import BUILTIN_PREFIX, is_scene, load_scene
from lambent.scenes.scene import Scene
from lambent.store.kept.views import read_views
from lambent.store.source import SURROUNDINGS, materials_in_views, scene_of
from lambent.store.store import MANIFEST, Store
from lambent.viewer.modes.edit.in_place import InPlace
from lambent.viewer.picture import LARGEST_PX

Kind = Literal["scene", "store", "session"]
SIZE = (512, 512)
SESSION_ENDING = ".edits.json"
STORE_ENDING = ".edit.store"
HEAD_BYTES = 4096


@dataclass(frozen=True)
class Subject:
    """The session to edit, with its scene and files.

    Attributes
    ----------
    session : Session
        Session with all materials of the scene's objects.
    scene : Scene
        The scene with its own environment.
    folder : Path
        Folder for files, and for stores of other environments.
    store : Path
        Folder of the store that has, or will have, the transport of the view under the environment `lit_by`.
    lit_by : Surroundings or None
        The environment at the start; None for the scene's own.
    home : Path or None
        File of the session, if it was opened from one.
    """

    session: Session
    scene: Scene
    folder: Path
    store: Path
    lit_by: Surroundings | None
    home: Path | None = None

    @property
    def name(self) -> str:
        return self.scene.name

    def store_for(self, environment: Surroundings | None) -> Path:
        """The store folder for transport under an environment: one store has one environment."""
        if environment == self.lit_by:
            return self.store
        return default_store(self.folder, self.scene.name, environment, self.session.folder)


def kind_of(path: Path) -> Kind | None:
    """The kind of a path; None if `lambent edit` must open it as a material."""
    if str(path).startswith(BUILTIN_PREFIX):
        return "scene"
    if path.is_dir():
        return "store"
    head = read_head(path, HEAD_BYTES) if path.is_file() else b""
    if path.name.endswith(SESSION_ENDING) or b'"lambent-edit-session"' in head:
        return "session"
    return "scene" if is_scene(path, head) else None


def opened(
    path: Path,
    folder: Path,
    *,
    camera: str | None = None,
    environment: Path | None = None,
    picture: tuple[int, int] | None = None,
    store: Path | None = None,
    crease_deg: float | None = None,
    keeper: InPlace | None = None,
) -> Subject:
    """Open a path.

    Parameters
    ----------
    camera, picture
        Name of a camera or saved view, and (width, height) in pixels; by default the session's, else the first camera
        or an overview, and 512 x 512.
    environment
        An image that lights the scene instead of its own environment.
    store
        Folder for transport; by default the opened store itself, or for a scene a new store in `folder`.
    crease_deg
        As for `load_scene`; by default the session's.
    keeper
        Of a store's session, with the edits of the view and the room's materials; by default the scene's materials.

    Raises
    ------
    UserError
        If the path cannot be read, the camera is unknown, or the store belongs to another scene.
    """
    if picture is not None and max(picture) > LARGEST_PX:
        got = f"{picture[0]}x{picture[1]}"
        raise UserError("picture is too large", field="--picture", got=got, expected=f"at most {LARGEST_PX} a side")
    kind = kind_of(path)
    if kind == "session":
        session = Session.open(path)
        place = str(session.path(session.document.scene))
        place = place if Path(place).exists() else session.document.scene
        crease_deg = session.document.crease_deg if crease_deg is None else crease_deg
    else:
        session, place = None, str(path)
    base = Path(place) if Path(place).is_dir() else None
    scene = _scene_at(place, crease_deg)
    kept = _kept_environment(base)
    lit_by = Surroundings(file=str(environment.resolve())) if environment is not None else kept
    if environment is not None and not environment.is_file():
        raise UserError("file does not exist", file=environment, field="--environment")
    if keeper is not None:
        where = camera_named(scene, base, camera)
        session = keeper.view(where, scene.materials, folder / plain_name(scene.name, "scene"))
    if session is None:
        where = camera_named(scene, base, camera)
        merged = _merged_in(base, scene)
        names = {o.material: scene.materials[o.material] for o in scene.merged(merged).objects}
        materials = {name: keeper.material(name, one) if keeper else one for name, one in names.items()}
        begun = Session.new(_lasting(place), where, materials, size=picture or SIZE, environment=lit_by)
        kept_too = {"merged": merged, "crease_deg": crease_deg}
        session = Session(begun.document.model_copy(update=kept_too))
    else:
        changes = {**_changes(session, scene, base, camera, picture), "crease_deg": crease_deg}
        if environment is not None:
            changes["environment"] = lit_by
        session = Session(session.document.model_copy(update=changes), session.folder)
        lit_by = session.document.environment
    own = base if base is not None and lit_by == kept else None
    chosen = store or own or default_store(folder, scene.name, lit_by, session.folder)
    check_store(chosen, place)
    return Subject(session, scene, folder, chosen, lit_by, path if kind == "session" else None)


def _changes(
    session: Session, scene: Scene, base: Path | None, camera: str | None, picture: tuple[int, int] | None
) -> dict[str, object]:
    """Changes to a saved session for another view, and the scene's materials that the session does not edit."""
    changes: dict[str, object] = {}
    if camera is not None:
        changes["camera"] = camera_named(scene, base, camera)
    if picture is not None:
        changes["size"] = picture
    for name in (*session.document.merged, *session.document.merged.values()):
        known("material", name, scene.materials, field="merged")
    used = {o.material: scene.materials[o.material] for o in scene.merged(session.document.merged).objects}
    for name in session.document.materials:
        known("material", name, used, field="materials")
    rest = {name: material for name, material in used.items() if name not in session.document.materials}
    found = Session.new(session.document.scene, session.document.camera, rest)
    return {**changes, "materials": {**session.document.materials, **found.document.materials}}


def of_aspect(width: int, height: int) -> tuple[int, int]:
    """A size with the aspect of another one, and about as many pixels as SIZE."""
    scale = (SIZE[0] * SIZE[1] / max(width * height, 1)) ** 0.5
    return max(1, round(scale * width)), max(1, round(scale * height))


def camera_named(scene: Scene, base: Path | None, name: str | None) -> Camera:
    """A camera of the scene or a saved view of its store; without a name the first."""
    saved = read_views(base).cameras if base is not None else ()
    cameras = {one.name: one for one in (*scene.cameras, *saved)}
    if name is not None:
        return cameras[known("camera", name, cameras, field="--camera")]
    if cameras:
        return next(iter(cameras.values()))
    low, high = scene.bounds
    return overview(triple(low), triple(high))


def default_store(folder: Path, name: str, environment: Surroundings | None, base: Path = Path()) -> Path:
    """NAME.edit.store, or NAME-ENVIRONMENT-HASH.edit.store: the hash tells images of one name apart."""
    stem = plain_name(name, "scene")
    if environment is not None:
        file = base / environment.file
        said = sha256_of(file) + environment.model_dump_json(exclude={"file"})
        stem += f"-{plain_name(file.stem)}-{hashlib.sha256(said.encode()).hexdigest()[:6]}"
    return folder / f"{stem}{STORE_ENDING}"


def check_store(folder: Path, place: str) -> None:
    """Raise `UserError` if a folder is no store, or its scene is not the one at `place`."""
    if not (folder / MANIFEST).exists() or folder == Path(place):
        return
    source = Store.open(folder).documents.get("source")
    if not isinstance(source, str) or Path(place).is_dir():
        return
    same = source == place or (
        not source.startswith(BUILTIN_PREFIX) and (folder / source).resolve() == Path(place).resolve()
    )
    if not same:
        raise UserError(
            "is the store of another scene", file=folder, got=source, expected=place, hint="name another with -o"
        )


def scene_for(session: Session) -> Scene:
    """The scene of a session, with the materials that it has merged."""
    document, place = session.document, session.path(session.document.scene)
    scene = _scene_at(str(place) if place.exists() else document.scene, document.crease_deg)
    return scene.merged(document.merged)


def _scene_at(place: str, crease_deg: float | None) -> Scene:
    if not Path(place).is_dir():
        return load_scene(place, crease_deg)
    if crease_deg is not None:
        hint = "use --crease-angle in `lambent bake`"
        raise UserError(
            "does not apply to a store: its normals are baked", file=Path(place), field="--crease-angle", hint=hint
        )
    return scene_of(Store.open(Path(place)))


def _merged_in(base: Path | None, scene: Scene) -> dict[str, str]:
    """Replacements of materials that were merged before the store's views were baked, by name."""
    of_objects = materials_in_views(Store.open(base)) if base is not None else {}
    pairs = {o.material: of_objects.get(o.name, o.material) for o in scene.objects}
    return {name: other for name, other in pairs.items() if name != other and other in scene.materials}


def _kept_environment(base: Path | None) -> Surroundings | None:
    """The image that a store was lit by instead of its scene's environment."""
    said: Mapping[str, object] | None = Store.open(base).documents.get(SURROUNDINGS) if base is not None else None
    if base is None or not said:
        return None
    found = Surroundings.model_validate(said)
    return found.model_copy(update={"file": str((base / found.file).resolve())})


def _lasting(place: str) -> str:
    return place if place.startswith(BUILTIN_PREFIX) else str(Path(place).resolve())
