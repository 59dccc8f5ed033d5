"""Opens a scene file, a store, or a saved session as a session of one view, for `lambent edit`."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.inputs import BUILTIN_PREFIX, read_head, sha256_of
from lambent.core.plain import plain_name, triple
from lambent.core.views.camera import Camera, overview
from lambent.editing.session.document import SessionDocument
from lambent.editing.session.session import Session, with_materials
from lambent.scenes.loaders.load import is_scene, load_scene
from lambent.scenes.scene import Scene
from lambent.store.kept.session import RoomState, Surroundings, WalkSession
from lambent.store.kept.views import read_views
from lambent.store.source import SURROUNDINGS, materials_in_views, scene_of
from lambent.store.store import MANIFEST, Store
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.edits.keeping import SessionKeeper
from lambent.viewer.edits.session_file import SOON_S
from lambent.viewer.edits.view_steps import ViewSteps
from lambent.viewer.modes.edit.in_place import former_view, kept_view
from lambent.viewer.picture import LARGEST_PX
from lambent.viewer.screen import Screen

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
        Session with all materials of the scene's objects, in the history of `edits`.
    edits : MaterialEdits
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
    keeper : SessionKeeper or None
        Of the store's session, if a store was opened; `lines` are lines on problems with it.
    """

    session: Session
    edits: MaterialEdits
    scene: Scene
    folder: Path
    store: Path
    lit_by: Surroundings | None
    home: Path | None = None
    keeper: SessionKeeper | None = None
    lines: tuple[str, ...] = ()

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
    screen: Screen,
    *,
    camera: str | None = None,
    environment: Path | None = None,
    picture: tuple[int, int] | None = None,
    fitting: tuple[int, int] | None = None,
    store: Path | None = None,
    crease_deg: float | None = None,
    soon_s: float = SOON_S,
) -> Subject:
    """Open a path. Of a store, the view has the materials of the room, in the store's session.

    Parameters
    ----------
    camera, picture
        Name of a camera or saved view, and (width, height) in pixels; by default the session's, else the first camera
        or an overview, and 512 x 512 or the aspect of `fitting`.
    environment
        An image that lights the scene instead of its own environment.
    store
        Folder for transport; by default the opened store itself, or for a scene a new store in the screen's folder.
    crease_deg
        As for `load_scene`; by default the session's.
    soon_s
        Of `SessionFile`.

    Raises
    ------
    UserError
        If the path cannot be read, the camera is unknown, or the store belongs to another scene.
    """
    _check(picture, environment)
    place, session = _session_at(path)
    if session is not None and crease_deg is None:
        crease_deg = session.document.crease_deg
    base = Path(place) if Path(place).is_dir() else None
    scene = _scene_at(place, crease_deg)
    edits, kept = MaterialEdits(scene.materials), _kept_environment(base)
    keeper = SessionKeeper(edits, base, screen, soon_s) if kind_of(path) == "store" else None
    lit_by = Surroundings(file=str(environment.resolve())) if environment is not None else kept
    try:
        lines: tuple[str, ...] = ()
        document = None if session is None else session.document
        if keeper is not None and base is not None:
            like = screen.folder / plain_name(scene.name, "scene")
            document, lines = _of_room(keeper, camera_named(scene, base, camera), base, edits, like)
        if document is None:
            begun = _begun(place, scene, base, camera_named(scene, base, camera))
            changes: dict[str, object] = {"size": picture or of_aspect(*(fitting or SIZE)), "environment": lit_by}
            changes["materials"] = with_materials(begun, edits.edited).materials
        else:
            begun, changes = document, _changes(document, scene, base, camera, picture)
            changes |= {} if environment is None else {"environment": lit_by}
        document = begun.model_copy(update={**changes, "crease_deg": crease_deg})
        if keeper is None:
            edits.begin_from(WalkSession(now=RoomState(materials={n: m.now for n, m in document.materials.items()})))
        folder = session.folder if session is not None else Path() if keeper is None else base or Path()
        now, lit_by = Session(ViewSteps(edits, document), folder), document.environment
        own = base if base is not None and lit_by == kept else None
        chosen = store or own or default_store(screen.folder, scene.name, lit_by, folder)
        check_store(chosen, place)
    except UserError:
        if keeper is not None:
            keeper.close()
        raise
    return Subject(now, edits, scene, screen.folder, chosen, lit_by, path if session else None, keeper, lines)


def _check(picture: tuple[int, int] | None, environment: Path | None) -> None:
    if picture is not None and max(picture) > LARGEST_PX:
        got = f"{picture[0]}x{picture[1]}"
        raise UserError("picture is too large", field="--picture", got=got, expected=f"at most {LARGEST_PX} a side")
    if environment is not None and not environment.is_file():
        raise UserError("file does not exist", file=environment, field="--environment")


def _session_at(path: Path) -> tuple[str, Session | None]:
    """The scene's place, and the session if the path is one."""
    if kind_of(path) != "session":
        return str(path), None
    session = Session.open(path)
    place = session.path(session.document.scene)
    return (str(place) if place.exists() else session.document.scene), session


def _of_room(
    keeper: SessionKeeper, camera: Camera, base: Path, edits: MaterialEdits, like: Path
) -> tuple[SessionDocument | None, tuple[str, ...]]:
    """The view of a store's session, or else once of a former file, and lines on what it does not show as the room."""
    lines = keeper.open(None)
    now = keeper.opened.now
    parts = {"light mix": now.light.groups, "lamps": now.lamps, "textures": now.textures}
    other = [what for what, changed in parts.items() if changed]
    lines += (f"shown as baked here: the room's {', '.join(other)}",) if other else ()
    if (found := kept_view(keeper.opened, camera, base, edits)) is not None:
        return found, lines
    found, more = former_view(camera, base, like)
    return found, (*lines, *more)


def _begun(place: str, scene: Scene, base: Path | None, camera: Camera) -> SessionDocument:
    """A view without edits."""
    merged = _merged_in(base, scene)
    used = {o.material: scene.materials[o.material] for o in scene.merged(merged).objects}
    return Session.new(_lasting(place), camera, used).document.model_copy(update={"merged": merged})


def _changes(
    document: SessionDocument, scene: Scene, base: Path | None, camera: str | None, picture: tuple[int, int] | None
) -> dict[str, object]:
    """Changes to a saved view for another camera or size, and the scene's materials that it does not have."""
    changes: dict[str, object] = {}
    if camera is not None:
        changes["camera"] = camera_named(scene, base, camera)
    if picture is not None:
        changes["size"] = picture
    for name in (*document.merged, *document.merged.values()):
        known("material", name, scene.materials, field="merged")
    used = {o.material: scene.materials[o.material] for o in scene.merged(document.merged).objects}
    for name in document.materials:
        known("material", name, used, field="materials")
    rest = {name: material for name, material in used.items() if name not in document.materials}
    found = Session.new(document.scene, document.camera, rest)
    return {**changes, "materials": {**document.materials, **found.document.materials}}


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
