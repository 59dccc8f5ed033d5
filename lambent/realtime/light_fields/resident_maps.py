"""Maps of a light field on the GPU: all maps, or those that a view needs, within a budget.

If a point's map is not resident, the nearest point with a resident map replaces it: the shaders' table of points then
holds that point's position and map. So shaders read real maps only, some of them taken slightly farther away.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from lambent.baked.light_fields.light_field import NO_POINT, LightField, Sky
from lambent.baked.light_fields.map_cache import LEAST_RECENT, POLICIES
from lambent.realtime.gpu.uploads import upload
from lambent.realtime.light_fields.light_field_atlas import Atlas, Packed

POINTS_IN_ROW = 256  # of the texture of points
BATCH = 16  # maps prepared at a time, and written before one frame
TURNED = 0.25  # distance that a unit difference of normals counts as, relative to the points' extent


@dataclass
class Reads:
    """Reads of maps: each frame reads each map that it needs once.

    `hits` and `misses` count since the cache was made: the map was resident when the frame asked for it, or not.
    `wanted` is the number of maps that the last frame needed, `no_room` of those beyond the budget, for which others
    stand in.
    """

    hits: int = 0
    misses: int = 0
    wanted: int = 0
    no_room: int = 0


class ResidentMaps:
    """The atlas of a light field, and `points`, the texture of points; `most_bytes` limits the atlas's two textures.

    Without a budget, or if all maps fit, they stay resident. Otherwise `follow` loads the maps that views need, and
    evicts others by its `policy`, one of `baked.light_fields.map_cache.POLICIES`.
    """

    def __init__(
        self, device: Any, field: LightField, most_bytes: float | None = None, policy: str = LEAST_RECENT,
        sky: Sky | None = None,
    ) -> None:  # fmt: skip
        self.atlas, self._device, self._field = Atlas(device, field, most_bytes, sky), device, field
        count, room = len(field.points), self.atlas.places
        self.whole, self.reads = room == count, Reads()
        self._cache = POLICIES[policy](room)
        first = np.arange(count) if self.whole else np.linspace(0, count - 1, room).round().astype(int)
        self._place = {int(point): place for place, point in enumerate(first)}  # of resident maps, by point
        self._ready: Future[tuple[Sequence[int], Packed]] | None = None
        if self.whole:
            self.atlas.fill()
        else:
            for point, place in self._place.items():
                self._cache.read(point)
                self.atlas.write(self.atlas.packed([point]), place)
            self._thread = ThreadPoolExecutor(1, "maps")
        self.loaded = room  # maps written so far, evicted ones included
        self.points = upload(device, [self._table()[None]], "rgba32float")

    @property
    def maps(self) -> int:
        """Number of maps of the light field."""
        return len(self._field.points)

    @property
    def resident(self) -> int:
        """Number of resident maps."""
        return len(self._place)

    @property
    def resident_mb(self) -> float:
        """Size of the resident maps, MB."""
        return len(self._place) * self.atlas.map_bytes / 1e6

    @property
    def busy(self) -> bool:
        """Whether a requested map is not resident yet."""
        return self._ready is not None

    @property
    def ready(self) -> bool:
        """Whether maps are prepared for `follow` to write."""
        return self._ready is not None and self._ready.done()

    def follow(self, wanted: Sequence[int], *, waits: bool) -> None:
        """Load the maps that a view needs, most needed first, as far as they fit.

        With `waits`, return when all that fit are resident. Otherwise write the batch that is prepared, and start the
        next one in a thread.
        """
        found = sum(int(point) in self._place for point in wanted)
        self.reads.hits, self.reads.misses = self.reads.hits + found, self.reads.misses + len(wanted) - found
        self.reads.wanted, self.reads.no_room = len(wanted), max(len(wanted) - self.atlas.places, 0)
        wanted = [int(point) for point in wanted[: self.atlas.places]]
        missing = [point for point in wanted if point not in self._place]
        keep = set(wanted)
        for point in reversed(wanted):
            self._cache.read(point, keep)
        if self._ready is not None and (waits or self._ready.done()):
            self._write(*self._ready.result())
            self._ready = None
        missing = [point for point in missing if point not in self._place]
        batches = [missing[i : i + BATCH] for i in range(0, len(missing), BATCH)]
        for batch in batches if waits else ():
            self._write(*self._packed(batch))
        if batches and not waits and self._ready is None:
            self._ready = self._thread.submit(self._packed, batches[0])

    def _packed(self, batch: Sequence[int]) -> tuple[Sequence[int], Packed]:
        return batch, self.atlas.packed(batch)

    def _write(self, batch: Sequence[int], maps: Packed) -> None:
        """Write maps to the places of evicted ones."""
        held = self._cache.held
        dropped = [point for point in self._place if point not in held]
        for i, point in enumerate(batch):
            if point not in held or not dropped:
                continue  # a newer view does not need it
            place = self._place.pop(dropped.pop())
            self.atlas.write(maps.of(i), place)
            self._place[point] = place
            self.loaded += 1
        table = self._table()
        self._device.queue.write_texture(
            {"texture": self.points}, table, {"bytes_per_row": table.shape[1] * 16}, (table.shape[1], table.shape[0], 1)
        )

    def _table(self) -> NDArray[np.float32]:
        """(rows, POINTS_IN_ROW, 4): world position, m, and place of the map of each point or of its substitute."""
        field = self._field
        table = np.zeros((-(-len(field.points) // POINTS_IN_ROW), POINTS_IN_ROW, 4), np.float32)
        there = np.fromiter(self._place, int)
        apart = TURNED * float(np.ptp(field.points, axis=0).max())  # no substitute on the far side of a sheet
        keys = np.concatenate([field.points, apart * field.normals], axis=1)
        nearest = there[scipy.spatial.cKDTree(keys[there]).query(keys)[1]]
        nearest[there] = there
        rows = table.reshape(-1, 4)[: len(field.points)]
        rows[:, :3], rows[:, 3] = field.points[nearest], [self._place[int(point)] for point in nearest]
        return table


def filled(sample_map: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """The sample map (h, w, 4) with empty texels filled from the nearest texel with points."""
    bare = (sample_map == NO_POINT).all(axis=-1)
    rows, columns = scipy.ndimage.distance_transform_edt(bare, return_distances=False, return_indices=True)
    return np.asarray(sample_map[rows, columns])
