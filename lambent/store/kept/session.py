"""The session of a store: the user's changes while viewing it, `session.json` in its folder.

Bakes never touch the file. `session-unsaved.json` beside it has the same form: the window keeps unsaved changes there,
so that they survive the end of the process. Saved cameras and paths are elsewhere: see `store.kept.views`.
"""

from __future__ import annotations

import json
import os
from collections.abc import Collection
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError

from lambent.core.ceilings import SESSION_BYTES
from lambent.core.errors import UserError, invalid
from lambent.core.files import write_text
from lambent.core.inputs import parse_json, read_bytes
from lambent.core.light.light_mix import LightMix
from lambent.core.strict import Strict
from lambent.materials.document import Material
from lambent.scenes.lamp_edits import LampEdit
from lambent.scenes.scene import ImageTexture
from lambent.store.lock import lock

LOCK_FILE = ".session.lock"  # the file stays in the folder; its existence means nothing
FILE, UNSAVED_FILE = "session.json", "session-unsaved.json"
FORMAT: Literal["lambent-walk-session"] = "lambent-walk-session"
VERSION: Literal[1] = 1


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


class WalkSession(Strict):
    """Content of a session file: the current state, the state compared with it, and stored states by name."""

    format: Literal["lambent-walk-session"] = FORMAT
    version: Literal[1] = VERSION
    now: RoomState = RoomState()
    beside: RoomState | None = None
    states: dict[str, RoomState] = Field(default_factory=dict)

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
    if said.get("version") != VERSION:
        hint = "open it with the version of Lambent that wrote it"
        raise UserError(
            "unknown version", file=file, field="version", got=said.get("version"), expected=VERSION, hint=hint
        )
    try:
        return WalkSession.model_validate(said)
    except ValidationError as error:
        raise invalid(error, file) from error
    except UserError as error:  # an invalid mix
        raise UserError(error.message, file=file, field=error.field, got=error.got, expected=error.expected) from error


def write_session(file: Path, session: WalkSession) -> None:
    """Write a session, atomically; raises `UserError` on failure."""
    write_text(file, json.dumps(session.model_dump(mode="json"), indent=1) + "\n")
