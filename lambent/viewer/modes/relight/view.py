"""The view of a store that is relit: its camera by name, the size that it is baked in, and an image as its sky."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from lambent.baking.running.relit import relight_copy
from lambent.baking.transport.view import View
from lambent.core.errors import UserError, invalid
from lambent.core.files import place_from
from lambent.core.views.camera import Camera, overview
from lambent.editing.relit_view import views_for_relighting
from lambent.store.contract import baked_views, scene_record, view_key
from lambent.store.kept.session import Surroundings
from lambent.store.kept.views import read_views
from lambent.store.store import Store
from lambent.viewer.editor.files import ENVIRONMENTS
from lambent.viewer.modes.edit.subject import SIZE, of_aspect


def cameras_of(store: Store) -> dict[str, Camera]:
    """Cameras of relit views, the scene's, and saved ones, by name, in this order; an overview without any."""
    record, relit = scene_record(store), views_for_relighting(store).values()
    cameras = [*(one.camera for one in relit), *record.cameras, *read_views(store.folder).cameras]
    return {one.name: one for one in cameras or [overview(*record.bounds)]}


def view_of(store: Store, camera: Camera, fitting: tuple[int, int] | None) -> View:
    """The view at a camera, in the largest size whose bake for relighting has begun, or the aspect of `fitting`."""
    stores, sizes = [store], list[tuple[int, int]]()
    with suppress(UserError):  # without one; where it is damaged, the search for the view says so
        stores.append(Store.open(relight_copy(store.folder)))
    for one in stores:
        begun = {artefact.name.split("/")[1] for artefact in one.artefacts("relighting")}
        views = (view for key, view in baked_views(one).items() if key in begun)
        sizes += [(view.width, view.height) for view in views if view_key(view.camera) == view_key(camera)]
    return View(camera, *max(sizes, key=lambda size: size[0] * size[1], default=of_aspect(*(fitting or SIZE))))


def sky_of(path: Path, folder: Path, **how: Any) -> Surroundings:
    """An image as a sky, by the folder of its store; `how` are further fields of `Surroundings`."""
    if not path.is_file():
        raise UserError("file does not exist", file=path)
    if path.suffix.lower() not in ENVIRONMENTS:
        raise UserError("is no sky", file=path, expected="an .hdr or .exr")
    try:
        return Surroundings(file=place_from(folder, path), **how)
    except ValidationError as error:
        raise invalid(error, path) from error
