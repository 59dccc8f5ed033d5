"""Streaming of light fields larger than their budget: before each frame, requests the maps that it needs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from lambent.realtime.baked import BakedScene
from lambent.realtime.clusters import Clusters
from lambent.realtime.draws import Draw
from lambent.realtime.needed_points import NeededPoints
from lambent.realtime.resident_maps import ResidentMaps
from lambent.realtime.resources import ObjectResources
from lambent.realtime.structs import Record


class Streaming:
    """The caches of a scene, shared by renderers of the same resources."""

    def __init__(self, scene: BakedScene, objects: Iterable[ObjectResources]) -> None:
        self._scene, self._objects = scene, [item for item in objects if item.light.probe.most_bytes is not None]
        self._needed: dict[str, NeededPoints] = {}

    def follow(self, draws: Iterable[Draw], data: Record, clusters: Clusters, *, waits: bool) -> None:
        """Request the maps that the draws of a frame need; with `waits`, return when all are resident."""
        drawn = [draw for draw in draws if draw.item in self._objects]
        for draw in drawn:
            _ = draw.object_group  # makes the cache on first use
            if not (streams := draw.item.light.streams):
                continue
            record = draw.item.record
            runs = clusters.seen(data["clip_from_world"].T).of(record.first_face, record.face_count)
            within = [(first - record.first_face, count) for first, count in runs]
            wanted = self._needed_of(draw.item).of_view(np.asarray(data["eye"][:3], float), within)
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
        """Policy of the caches; for light fields with a budget: maps, resident maps, their MB, hits and misses."""
        caches = list(self._caches())
        if not caches:
            return {}
        return {
            "cache": self._scene.policy,
            "maps": sum(one.maps for one in caches),
            "resident": sum(one.resident for one in caches),
            "resident_mb": round(sum(one.resident_mb for one in caches), 3),
            "hits": sum(one.reads.hits for one in caches),
            "misses": sum(one.reads.misses for one in caches),
        }
