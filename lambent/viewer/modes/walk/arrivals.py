"""What a bake beside the window has finished so far: told by its process, read by the window."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags
from lambent.store.contract import probe_name


@dataclass(frozen=True, eq=False)
class Region:
    """The front of a light map by light group (n, H, W, 3), W/m^2, of use where `finished` (H, W)."""

    light: NDArray[np.float16]
    finished: Flags

    @classmethod
    def read(cls, shape: tuple[int, int, int], stream: IO[bytes]) -> Region | None:
        """As `rebaking_worker` writes it; None where the stream ends before it does."""
        count, height, width = shape
        size, flags = 2 * 3 * count * height * width, height * width
        found = stream.read(size + flags)
        if len(found) < size + flags:
            return None
        light = np.frombuffer(found[:size], np.float16).reshape(count, height, width, 3)
        return cls(light, np.frombuffer(found[size:], bool).reshape(height, width))


@dataclass(frozen=True)
class Arrived:
    """Of the light for one edit: a region; whether the light map is there; arrays of probes; and whether all is."""

    region: Region | None = None
    light_map: bool = False
    probe_arrays: frozenset[str] = frozenset()
    whole: bool = False

    def has_probe(self, name: str, *, by_group: bool) -> bool:
        """Whether all arrays of the probe of an object are there."""
        parts = ("radiance", "distance", "planes", *(("groups",) if by_group else ()))
        return all(probe_name(name, part) in self.probe_arrays for part in parts)


class Arrivals:
    """`now` is what has arrived; lines of the process are taken in a thread of their own."""

    def __init__(self) -> None:
        self.now = Arrived()
        self._lock = threading.Lock()

    def take(self, said: Mapping[str, Any], stream: IO[bytes]) -> bool:
        """Take a line of the process; whether it told that something has arrived."""
        if "region" in said:
            region = Region.read(tuple(said["region"]), stream)
            if region is not None:
                self._change(region=region)
        elif "there" in said:
            if said["kind"] == "light_map":
                self._change(light_map=True)
            else:
                self._change(probe_arrays=self.now.probe_arrays | frozenset(said["there"]))
        elif "baked" in said:
            self._change(light_map=True, whole=True)
        else:
            return False
        return True

    def _change(self, **changes: Any) -> None:
        with self._lock:
            self.now = replace(self.now, **changes)
