"""A traced room in a state: the materials of its objects, and the mix of its light groups."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from lambent.baking.engine import engine
from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.light.light_mix import Factors, factors_of
from lambent.core.progress import Progress, silent
from lambent.materials.document import Material
from lambent.scenes.lamp_edits import LampEdit, with_lamp_edits
from lambent.scenes.looks.textures import prepared
from lambent.scenes.looks.variants import textures_in_look, textures_in_looks
from lambent.scenes.replacement import Replacement, with_replacements
from lambent.scenes.scene import Look, Scene
from lambent.scenes.sky.turned_sky import under_turned_sky
from lambent.store.contract import SIDES
from lambent.store.source import SOURCE
from lambent.store.store import Store
from lambent.traced.light import StoredLight

if TYPE_CHECKING:
    from lambent.baking.pictures.tracer import Tracer
    from lambent.baking.tracing.traced_scene import TracedScene

LIGHT_MAP = f"light_map/{SIDES[0]}"


class TracedRoom:
    """A traced scene, with the light map of its store, or for whole paths without one.

    Materials are the documents that are drawn, not measured tables. Made by `room_of_store` and `room_of_paths`.
    """

    def __init__(self, traced: TracedScene, light: StoredLight | None, folder: Any = None) -> None:
        self._traced, self._scene = traced, traced.scene  # as loaded
        self._light, self._folder = light, folder  # the folder has images that the scene reads
        self._looks: Mapping[str, Look] = {}
        self._materials: Mapping[str, Material] = {}
        self._factors: Factors = {}
        self._follows = True
        self._tracer: Tracer | None = None

    @property
    def answers(self) -> bool:
        """Whether light between surfaces follows edited materials."""
        return self._light is None or self._light.answers

    def set_materials(self, looks: Mapping[str, Look], materials: Mapping[str, Material]) -> None:
        """Show materials with other textures (`looks`) and other documents (`materials`), by name; others as baked.

        A `tracer` from before must not be used any more.
        """
        if (looks, materials) == (self._looks, self._materials):
            return
        self._looks, self._materials, self._tracer = dict(looks), dict(materials), None
        scene, textures = self._scene, textures_in_looks(self._scene.textures, looks)
        textures |= prepared({name: textures[name] for name in looks if name in textures})
        self._traced.set_materials(replace(scene, materials={**scene.materials, **materials}, textures=textures))

    def follow(self, on: bool) -> None:
        """Let light between surfaces follow edited materials, if the room `answers`, or stay as baked."""
        if on != self._follows:
            self._follows, self._tracer = on, None

    def mix(self, factors: Factors) -> None:
        """Show a mix of light groups by name; those left out are as baked.

        Raises
        ------
        UserError
            If there is no such group.
        """
        if factors != self._factors:
            self.check(factors)
            self._factors, self._tracer = dict(factors), None

    def check(self, factors: Factors) -> None:
        """Raise `UserError` if a group of a mix is missing."""
        if self._light is not None:
            self._light.check(factors)
        else:
            factors_of(self._names, factors)

    def illuminance(
        self, points: Floats, normal: Floats, limit: float, progress: Progress = silent
    ) -> tuple[Floats, Floats]:
        """Illuminance (n,) at points (n, 3), m, facing a unit normal (3,), and its standard error, lx; NaN in solids.

        The error is at most `limit` times the illuminance where 262,144 samples suffice for that.
        """
        from lambent.baking.pictures.irradiance import illuminance  # imports Mitsuba, whose variant `engine` has set
        from lambent.baking.tracing.solids import SolidTest

        traced, normals = self._traced, np.broadcast_to(normal, points.shape)
        free = ~SolidTest(traced.builder(diffuse=False), traced.whole(diffuse=False)).embedded(points, normals)
        free |= not free.any()  # otherwise the room itself counts as a solid
        found = np.full((2, len(points)), np.nan)
        found[:, free] = illuminance(self.tracer.gathering, points[free], normals[free], limit, progress)
        return found[0], found[1]

    @property
    def _names(self) -> list[str]:
        return [group.name for group in self._traced.sorted_lights.groups]

    @property
    def tracer(self) -> Tracer:
        """Samples of pictures in the present state."""
        from lambent.baking.pictures.tracer import Tracer  # imports Mitsuba, whose variant `engine` has set

        if self._tracer is None and self._light is not None:
            textures = {name: textures_in_look(name, look, self._scene.textures) for name, look in self._looks.items()}
            edits = (self._materials, textures) if self._follows else ({}, {})
            light = self._light.of(*edits, self._factors, lamps=self._follows)
            self._tracer = Tracer.of_baked(self._traced, light)
        elif self._tracer is None:
            factors = factors_of(self._names, self._factors) if self._factors else None
            self._tracer = Tracer.of_paths(self._traced, factors)
        return self._tracer


def room_of_store(
    store: Store, scene: Scene, *, sky_turn_deg: float = 0.0, replacements: Sequence[Replacement] = (),
    lamps: Mapping[int, LampEdit] = MappingProxyType({}), before: TracedRoom | None = None,
) -> TracedRoom:  # fmt: skip
    """A store's room: its geometry and light map, under the lights of its scene (`store.source.scene_of`).

    Sky and sun can be rotated about the vertical, `lamps` edited, and meshes take the place of objects; the light map
    stays as baked, or answers lamps. What the store's light needs is taken from a room of it `before`, which ends.
    """
    engine()
    from lambent.baking.pictures.stored import stored_scene  # imports Mitsuba, whose variant `engine` has set

    folder = TemporaryDirectory()
    lit = under_turned_sky(_as_drawn(with_lamp_edits(scene, lamps)), sky_turn_deg, Path(folder.name))
    traced, light = stored_scene(store, lit, replacements), None if before is None else before._light
    light = light or StoredLight(store, scene.lights)
    light.edit(traced, lamps)
    return TracedRoom(traced, light, folder)


def room_of_paths(scene: Scene, *, sky_turn_deg: float = 0.0, replacements: Sequence[Replacement] = ()) -> TracedRoom:
    """A scene for whole paths, without a light map."""
    engine()
    from lambent.baking.pictures.stored import scene_alone  # imports Mitsuba, whose variant `engine` has set

    folder = TemporaryDirectory()
    lit = under_turned_sky(_as_drawn(with_replacements(scene, replacements)), sky_turn_deg, Path(folder.name))
    return TracedRoom(scene_alone(lit), None, folder)


def why_untraceable(store: Store) -> str:
    """Why a store cannot be traced, in one line: no scene file, no light map, no engine; else empty."""
    place = store.documents.get(SOURCE)
    if not isinstance(place, str):
        return "the store has no path of its scene file"
    if not place.startswith("builtin:") and not (store.folder / place).exists():
        return f"its scene {store.folder / place} is not there"
    if LIGHT_MAP not in store:
        return "the store has no light map"
    try:
        engine()
    except UserError as error:
        return str(error)
    return ""


def _as_drawn(scene: Scene) -> Scene:
    """The scene with documents in place of measured tables."""
    return replace(scene, textures=prepared(scene.textures), measured={})
