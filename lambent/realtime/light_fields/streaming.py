"""Streaming of light fields larger than their budget: before each frame, requests the maps that it needs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import fields
from typing import Any

import numpy as np

from lambent.realtime.gpu.structs import Record
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.light_fields.needed_points import NeededPoints
from lambent.realtime.light_fields.resident_maps import Reads, ResidentMaps
from lambent.realtime.objects.draws import Draw
from lambent.realtime.resources import ObjectResources

COUNTS = tuple(count.name for count in fields(Reads))


class Streaming:
    """The caches of a scene, shared by renderers of the same resources."""

    def __init__(self, scene: BakedScene, objects: Iterable[ObjectResources]) -> None:
        self._scene, self._objects = scene, [item for item in objects if item.light.probe.most_bytes is not None]
        self._needed: dict[str, NeededPoints] = {}

    def follow(self, draws: Iterable[Draw], data: Record, *, waits: bool) -> None:
        """Request the maps that the draws of a frame need; with `waits`, return when all that fit are resident."""
        drawn = [draw for draw in draws if draw.item in self._objects]
        for draw in drawn:
            _ = draw.object_group  # makes the cache on first use
            if not (streams := draw.item.light.streams):
                continue
            eye, clip_from_world = np.asarray(data["eye"][:3], float), np.asarray(data["clip_from_world"].T, float)
            wanted = self._needed_of(draw.item).of_view(eye, clip_from_world)
            for maps in streams:
                maps.follow(wanted.tolist(), waits=waits)

    def _needed_of(self, item: ObjectResources) -> NeededPoints:
        record, scene = item.record, self._scene
        if record.name not in self._needed:
            faces = scene.faces[record.first_face : record.first_face + record.face_count]
            field = item.light.probe.light_field
            assert field is not None, "an object without a light field has no maps"
            self._needed[record.name] = NeededPoints(scene.positions[faces], scene.uv2[faces], field)
        return self._needed[record.name]

    def _caches(self) -> Iterator[ResidentMaps]:
        for item in self._objects:
            yield from item.light.streams

    @property
    def version(self) -> int:
        """Grows whenever a map is ready, and the picture changes."""
        return sum(maps.loaded + maps.ready for maps in self._caches())

    @property
    def busy(self) -> bool:
        """Whether a map that a frame requested is not resident yet."""
        return any(maps.busy for maps in self._caches())

    @property
    def statistics(self) -> dict[str, Any]:
        """Of light fields beyond their budget: policy, maps, resident maps, their MB, and `resident_maps.Reads`."""
        caches = list(self._caches())
        if not caches:
            return {}
        return {
            "cache": self._scene.policy,
            "maps": sum(one.maps for one in caches),
            "resident": sum(one.resident for one in caches),
            "resident_mb": round(sum(one.resident_mb for one in caches), 3),
            **{count: sum(getattr(one.reads, count) for one in caches) for count in COUNTS},
        }
