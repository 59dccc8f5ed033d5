"""The picture that a store's window shows, or showed last: settings and camera from its session."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

from lambent.core.errors import UserError
from lambent.core.light.light_mix import MixTrack
from lambent.core.views.camera import Camera
from lambent.render.images import TRACED, Settings
from lambent.store.contract import scene_record
from lambent.store.kept.session import FILE, KeptView, RoomState, WalkSession, read_session
from lambent.store.kept.states import SAVED
from lambent.store.light_groups import light_groups
from lambent.store.store import Store
from lambent.viewer.look import Look
from lambent.viewer.modes.walk.at_rest.traced import is_traceable
from lambent.viewer.modes.walk.session.kept_view import show_look


def as_left(
    store: Store | Path | str, settings: Settings, given: Collection[str] = ()
) -> tuple[Settings, Camera | None]:
    """Settings with everything that the session says, except the `given` ones, and its camera.

    The camera is None for a session of version 1, which has none.

    Raises
    ------
    UserError
        If there is no session, or it cannot be read, or it names what the store or this version lacks.
    """
    opened = store if isinstance(store, Store) else Store.open(Path(store))
    session, file = read_session(opened.folder / FILE), opened.folder / FILE
    if session is None:
        raise UserError("there is no session", file=file, hint=f"`lambent walk {opened.folder}` begins one")
    _check_names(session, opened, file)
    variant = SAVED if session.now != RoomState() else ""
    said: dict[str, Any] = {"variant": variant, "light": MixTrack.of(session.now.light)}
    if session.view is not None:
        said |= _of_view(session.view, opened, file)
    changes = {name: value for name, value in said.items() if name not in given}
    return replace(settings, **changes), None if session.view is None else session.view.camera


def _check_names(session: WalkSession, store: Store, file: Path) -> None:
    groups = [group.name for group in light_groups(store)]
    if unknown := sorted(set(session.now.unknown(scene_record(store).materials, groups))):
        hint = "bake the scene that has them, or change the session in the window"
        raise UserError("the store lacks what the session names", file=file, got=", ".join(unknown), hint=hint)


def _of_view(view: KeptView, store: Store, file: Path) -> dict[str, Any]:
    look = Look()
    if lines := show_look(look, view.look, {one.name for one in scene_record(store).objects}):
        raise UserError(lines[0], file=file, hint="use the version of Lambent that wrote it")
    traces = view.traces and is_traceable(look.frame(view.camera, view.size, {}))
    width, height = view.size
    return {
        "width": width, "height": height, "integrator": TRACED if traces else look.integrator,
        "samples": None if traces else look.n, "exposure_ev": view.look.exposure_ev, "view": look.view_transform,
        "scale": look.shown_scale if look.is_false_coloured else None, "show": look.show, "lookups": look.lookups,
        "planar": "auto" if traces else look.planar, "lookup": "auto" if traces else look.lookup, "near_m": look.near_m,
        "follows": view.light_follows, "rebaked": view.rebaked and traces,
    }  # fmt: skip
