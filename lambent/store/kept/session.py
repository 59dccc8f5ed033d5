"""The session of a store: what the window shows, and the user's changes: `session.json` in its folder.

Bakes never touch the file. Version 1 had no view; its window kept unsaved changes in `session-unsaved.json`, which is
read once. Saved cameras and paths are elsewhere: see `store.kept.views`.
"""

from __future__ import annotations

import json
import os
from collections.abc import Collection
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, field_validator, model_validator

from lambent.core.ceilings import SESSION_BYTES
from lambent.core.errors import UserError, invalid
from lambent.core.files import write_text
from lambent.core.inputs import parse_json, read_bytes
from lambent.core.light.false_colour import Range
from lambent.core.light.light_mix import LightMix
from lambent.core.strict import Strict
from lambent.core.surroundings import Axis, Layout
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.scenes.lamp_edits import LampEdit
from lambent.scenes.scene import ImageEnvironment, ImageTexture
from lambent.store.consistency import is_usable
from lambent.store.lock import lock

LOCK_FILE = ".session.lock"  # the file stays in the folder; its existence means nothing
FILE, FORMER_BACKUP = "session.json", "session-unsaved.json"
FORMAT: Literal["lambent-walk-session"] = "lambent-walk-session"
VERSION: Literal[2] = 2
READABLE = (1, VERSION)

Stops = Annotated[float, Field(ge=-64, le=64)]
Length = Annotated[float, Field(gt=0, le=1e9)]
Pixels = Annotated[int, Field(ge=1, le=1 << 14)]
Place = Annotated[str, Field(min_length=1, max_length=4096, pattern=r"^[^\x00]*$")]


class SessionLock:
    """The right to write the session of a store, until `release` or the end of the process.

    Raises
    ------
    UserError
        If the folder is not writable.
    """

    def __init__(self, folder: Path) -> None:
        try:
            handle = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise UserError(f"cannot be written ({error.strerror})", file=folder) from error
        self.held = lock(handle, wait=False)  # False: another window has it
        self._handle: int | None = handle
        if not self.held:
            self.release()

    def release(self) -> None:
        """Allow another window to take it."""
        handle, self._handle, self.held = self._handle, None, False
        if handle is not None:
            os.close(handle)


class RoomState(Strict):
    """The look of a room: replacement materials by name, and the mix of its light groups.

    `textures` maps a material to what it shows instead of its own textures: those of another material, "" for none, or
    an image, by its name in the store (`store.kept.images`). `lamps` are edited, by their place in the
    scene.
    """

    materials: dict[str, Material] = Field(default_factory=dict)
    textures: dict[str, str | ImageTexture] = Field(default={}, exclude_if=lambda one: not one)
    light: LightMix = LightMix()
    lamps: dict[int, LampEdit] = Field(default={}, exclude_if=lambda one: not one)

    def unknown(self, materials: Collection[str], groups: Collection[str]) -> list[str]:
        """Names of materials and light groups that are missing from a store."""
        others = [of for of in self.textures.values() if isinstance(of, str) and of]
        used = [*self.materials, *self.textures, *others]
        return [n for n in used if n not in materials] + [n for n in self.light.groups if n not in groups]

    def only(self, materials: Collection[str]) -> RoomState:
        """A copy limited to the materials that a store has."""
        known = {name: one for name, one in self.materials.items() if name in materials}
        textures = {
            name: of for name, of in self.textures.items()
            if name in materials and (isinstance(of, ImageTexture) or of in (*materials, ""))
        }  # fmt: skip
        return RoomState(materials=known, textures=textures, light=self.light, lamps=self.lamps)


class KeptLook(Strict):
    """Exposure, view transform and method of a picture, by the names of `realtime.frame_state.FrameState`.

    Without `exposure_ev`, the picture was not metered yet; `base_ev` is where the window counts steps from. Names are
    checked by who shows the picture.
    """

    exposure_ev: Stops | None = None
    base_ev: Stops | None = None
    view_transform: str = "filmic"
    integrator: str = "lamps"
    show: str = "full"
    lookup: str = "auto"
    lookups: dict[str, str] = Field(default={}, exclude_if=lambda one: not one)  # by object, in place of `lookup`
    planar: str = "auto"
    n: Annotated[int, Field(ge=1, le=64)] | None = None
    near_m: Length | None = None
    scale: Range = Range()
    noise_scale: Range = Range(0.5, 50.0)

    @model_validator(mode="after")
    def _has_ranges(self) -> KeptLook:
        self.scale.check()
        self.noise_scale.check()
        return self


class KeptView(Strict):
    """Where the window looks, and how it shows that.

    `size` is that of the picture, logical pixels; `traces`: whether it is traced at rest; `light_follows`: whether
    light of other surfaces follows edits; `rebaked`: whether it is that of the copy in which edits were baked again;
    `split`: whether the state beside is shown, too.
    """

    camera: Camera
    movement: Literal["orbit", "walk"] = "walk"
    flying: bool = False
    speed_m_s: Length | None = None
    eye_height_m: Length | None = None
    size: tuple[Pixels, Pixels] = (1280, 720)
    look: KeptLook = KeptLook()
    traces: bool = True
    light_follows: bool = True
    rebaked: bool = False
    split: bool = False
    selected: str | None = None

    @model_validator(mode="after")
    def _can_be_seen(self) -> KeptView:
        if not is_usable(self.camera):
            raise ValueError("the camera is beyond 1e9 m, or has an impossible field of view")
        return self


class Surroundings(Strict):
    """An image that lights the scene instead of its own environment; fields as in `scenes.ImageEnvironment`."""

    file: Place
    scale: Annotated[float, Field(gt=0, le=1e9)] = 1.0
    rotation_deg: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    layout: Layout | None = None
    up: Axis = "+y"

    def image(self, folder: Path) -> ImageEnvironment:
        """The environment, of a file by a folder."""
        return ImageEnvironment((folder / self.file).resolve(), **self.model_dump(exclude={"file"}))


class RelitSky(Strict):
    """The light of relit views: the store's environment, or an image by the store's folder, rotated about +y."""

    turn_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    environment: Surroundings | None = None


class EditedView(Strict):
    """A view whose materials are edited in place: a `lambent.editing` session document, of files by the store's folder.

    Its materials are those of the current state. A document of version 1 had its own: `room` has those of the current
    state that it started from, and `shown` names materials that the current state had as edited.
    """

    document: dict[str, Any]
    room: dict[str, Material] = Field(default={}, exclude_if=lambda one: not one)
    shown: tuple[str, ...] = Field(default=(), exclude_if=lambda one: not one)

    @field_validator("document")
    @classmethod
    def _is_finite(cls, document: dict[str, Any]) -> dict[str, Any]:
        """Readers of the document refuse other numbers, and a file of JSON cannot keep them."""
        try:
            json.dumps(document, allow_nan=False)
        except ValueError as error:
            raise ValueError("a number is not finite") from error
        return document


class WalkSession(Strict):
    """Content of a session file: the current state, the one compared with it, stored states by name, and the view.

    `edited` are views edited in place, by their camera's name; `sky` is that of relit views.
    """

    format: Literal["lambent-walk-session"] = FORMAT
    version: Literal[2] = VERSION
    now: RoomState = RoomState()
    beside: RoomState | None = None
    states: dict[str, RoomState] = Field(default_factory=dict)
    view: KeptView | None = None
    edited: dict[str, EditedView] = Field(default={}, exclude_if=lambda one: not one)
    sky: RelitSky = Field(default=RelitSky(), exclude_if=lambda one: one == RelitSky())

    @property
    def rooms(self) -> list[RoomState]:
        """All states."""
        return [self.now, *([] if self.beside is None else [self.beside]), *self.states.values()]

    def unknown(self, materials: Collection[str], groups: Collection[str]) -> list[str]:
        """Names of materials and light groups that are missing from a store, sorted."""
        return sorted({name for room in self.rooms for name in room.unknown(materials, groups)})


def read_session(file: Path) -> WalkSession | None:
    """The session in a file; None if there is no file.

    Raises
    ------
    UserError
        If the file is damaged or of another version.
    """
    if not file.exists():
        return None
    return session_from(parse_json(read_bytes(file, SESSION_BYTES), file), file)


def session_from(said: Any, file: Path) -> WalkSession:
    """The session of a parsed document; errors name `file`."""
    if not isinstance(said, dict) or said.get("format") != FORMAT:
        raise UserError("is not a session of a store", file=file, field="format", expected=FORMAT)
    if said.get("version") not in READABLE:
        hint = "open it with the version of Lambent that wrote it"
        raise UserError(
            "unknown version", file=file, field="version", got=said.get("version"), expected=VERSION, hint=hint
        )
    try:
        return WalkSession.model_validate({**said, "version": VERSION})
    except ValidationError as error:
        raise invalid(error, file) from error
    except UserError as error:  # an invalid mix
        raise UserError(error.message, file=file, field=error.field, got=error.got, expected=error.expected) from error


def write_session(file: Path, session: WalkSession) -> None:
    """Write a session, atomically; raises `UserError` on failure, and if `read_session` would refuse the file."""
    text = json.dumps(session.model_dump(mode="json"), indent=1) + "\n"
    if (size := len(text.encode())) > SESSION_BYTES:
        raise UserError("session is too large", file=file, got=f"{size} bytes", expected=f"at most {SESSION_BYTES}")
    session_from(parse_json(text.encode(), file), file)
    write_text(file, text)
