"""The variants of a store: those of its scene, and states of the room stored in the window."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from lambent.scenes.lamp_edits import LampEdit
from lambent.scenes.scene import Look, Variant
from lambent.store.contract import SceneRecord, scene_record
from lambent.store.kept.images import names_of_images, with_located_images, with_paths
from lambent.store.kept.session import FILE, RoomState, read_session
from lambent.store.store import Store

SAVED = "saved"  # name of the room as the window shows it


def variants_of(store: Store, *, saved: bool = True) -> tuple[Variant, ...]:
    """The variants of the scene, then the states of the store's session; a state hides a variant of the same name.

    `saved` adds the room as the session left it, if it differs from the bake. Materials that the store no longer has
    are left out of a state.

    Raises
    ------
    UserError
        If the session is damaged.
    """
    record, session = scene_record(store), read_session(store.folder / FILE)
    found = {variant.name: variant for variant in with_located_images(record.variants, store.folder)}
    if session is not None:
        left = {SAVED: session.now} if saved and session.now != RoomState() else {}
        found |= {name: _variant(name, room, record, store.folder) for name, room in {**left, **session.states}.items()}
    return tuple(found.values())


def images_of_variants(folder: Path) -> set[str]:
    """The images of a store's scene variants, as the store names them."""
    variants = scene_record(Store.open(folder)).variants
    textures = ({name: look.textures for name, look in variant.looks.items()} for variant in variants)
    return {name for one in textures for name in names_of_images(one)}


def lamps_of(store: Store, name: str) -> Mapping[int, LampEdit]:
    """Edits of lamps in the session's state of this name; none for a variant of the scene."""
    session = read_session(store.folder / FILE)
    rooms = {} if session is None else {SAVED: session.now, **session.states}
    return rooms[name].lamps if name in rooms else {}


def says_light(store: Store, name: str) -> bool:
    """Whether a variant of this name defines the light: a mix, or, in a state, the light as baked."""
    session, found = read_session(store.folder / FILE), {one.name: one for one in variants_of(store)}
    of_session = session is not None and (name in session.states or name == SAVED)
    return name in found and (of_session or bool(found[name].light.groups))


def _variant(name: str, room: RoomState, record: SceneRecord, folder: Path) -> Variant:
    known = room.only(record.materials)
    own = {one: one if one in record.textures else "" for one in record.materials}
    changed, textures = dict.fromkeys([*known.materials, *known.textures]), with_paths(known.textures, folder)
    looks = {one: Look(known.materials.get(one, record.materials[one]), textures.get(one, own[one])) for one in changed}
    return Variant(name, looks, known.light)
