"""Load the transport of a view from a store (store.contract) as the parts of its edited picture."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats, Image
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.editing.canvas import Canvas, HostCanvas
from lambent.editing.folding import folded
from lambent.editing.picture import EditedPicture, Part, TransportNeeded
from lambent.editing.rows import PairTransport, Rows
from lambent.editing.session.session import Session
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.terms import Editable
from lambent.store.contract import TRANSPORT_BASIS, scene_record, transport_lights, view_artefact_name
from lambent.store.source import environment_note
from lambent.store.store import Store


class NotBaked(UserError):
    """The store has no transport that fits the session."""


@dataclass(frozen=True)
class StoredPairs:
    """Transport over two curves by the stored pairs of nodes; arrays as in the contract of stores."""

    spans: NDArray[np.uint32]
    steps: NDArray[np.uint8]
    values: NDArray[np.uint32]
    unit: float
    counts: tuple[int, int]

    def fold(self, curve_index: int, node_values: Floats) -> Rows:
        """Rows over the other curve, see `rows.PairTransport`."""
        edited = 1 - curve_index
        rows, scale = folded(self.spans, self.steps, self.values, node_values, edited, self.counts[edited])
        return Rows(rows, self.unit * scale)


def edited_picture(store: Store, session: Session, canvas: Callable[[Image], Canvas] = HostCanvas) -> EditedPicture:
    """The picture of a session's view, drawn exactly as edited, on a `canvas` as for `EditedPicture`.

    Materials of the view that the session does not edit are drawn as in the scene. Of several numbers of lights that
    the transport has, the largest is used.

    Raises
    ------
    NotBaked
        If the store has no transport of the view, or one under another environment, or for other terms than the
        materials'.
    UserError
        If the session names materials that the scene does not have, or the store cannot be read.
    """
    view = session.document
    lights = max(transport_lights(store, view.camera, *view.size), default=0)
    if not lights:
        what = f"no transport for camera {view.camera.name}, {view.size[0]} x {view.size[1]}"
        raise NotBaked(what, file=store.folder, hint="bake the view for editing first")
    _check_environment(store, session, lights)
    scene = {name: of_material(material) for name, material in scene_record(store).materials.items()}
    parts = parts_of(store, session, {**scene, **{name: session.original(name) for name in view.materials}}, lights)
    if apart := sorted(parts.keys() & view.merged.keys()):
        what = f"transport has a separate material that the session merges with {view.merged[apart[0]]}"
        raise NotBaked(what, file=store.folder, field=apart[0], hint="bake the view for editing again")
    backdrop = store.read(view_artefact_name(view.camera, *view.size, "view_points", "backdrop"))
    picture = EditedPicture(backdrop.astype(np.float32), parts, canvas)
    for name in view.materials:
        known("material", name, scene, file=store.folder, field="materials")
        if name in parts:
            _show(picture, name, session, store)
    picture.draw()
    return picture


def _check_environment(store: Store, session: Session, lights: int) -> None:
    view, wanted = session.document, environment_note(session.environment)
    terms = view_artefact_name(view.camera, *view.size, "transport", f"{lights}/terms")
    if store.artefact(terms).meta.get("environment") != wanted:
        what = "transport was baked for another environment"
        raise NotBaked(what, file=store.folder, hint="bake the view for editing again")


def _show(picture: EditedPicture, name: str, session: Session, store: Store) -> None:
    try:
        picture.show(name, session.editable(name))
    except TransportNeeded as error:
        raise NotBaked(str(error), file=store.folder, hint="bake the view for editing again") from error


def parts_of(store: Store, session: Session, materials: Mapping[str, Editable], lights: int) -> dict[str, Part]:
    """The parts of a view, for the materials it shows; `materials` are those that transport was computed for.

    `lights` is the number of lights of the transport. Raises `NotBaked` if an earlier version baked it.
    """
    view = session.document

    def name(kind: str, part: str) -> str:
        return view_artefact_name(view.camera, *view.size, kind, part)

    pixel, number, theta_o = (store.read(name("view_points", part)) for part in ("pixel", "object", "theta_o"))
    objects = store.artefact(name("view_points", "object")).meta["objects"]
    owner = np.array([material for _, material in objects])[number]
    said = store.artefact(name("transport", f"{lights}/terms")).meta["terms"]
    if any(one.get("basis") != TRANSPORT_BASIS for one in said):
        what = "transport was baked by an earlier version of Lambent"
        raise NotBaked(what, file=store.folder, hint="bake the view for editing again")
    parts = {}
    for material, start in materials.items():
        mine = owner == material
        if not mine.any():
            continue
        baked = {one["term"]: one for one in said if one["material"] == material}
        if {k: one.get("fixed") for k, one in baked.items()} != {k: t.fixed for k, t in enumerate(start.terms)}:
            raise NotBaked(
                "transport was baked for other terms of the material", file=store.folder, field=material,
                hint="bake the view for editing again",
            )  # fmt: skip
        arrays = name("transport", f"{lights}/{material}")
        transport = tuple(_transport(store, f"{arrays}/{k}", baked[k]) for k in range(len(start.terms)))
        parts[material] = Part(start, pixel[mine].astype(np.int64), theta_o[mine], transport)
    return parts


def _transport(store: Store, name: str, said: Mapping[str, Any]) -> Rows | PairTransport:
    curves, unit = said["curves"], float(said["scale"])
    if len(curves) < 2:
        return Rows(store.read(f"{name}/rows"), unit)
    spans, steps, values = (store.read(f"{name}/{array}") for array in ("spans", "steps", "values"))
    return StoredPairs(spans, steps, values, unit, (curves[0][1], curves[1][1]))
