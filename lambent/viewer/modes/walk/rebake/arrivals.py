"""Finished parts of a background bake: reported by its process, read by the window."""

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
    """Front side of a light map by light group (n, H, W, 3), W/m^2; texels are valid if `finished` (H, W)."""

    light: NDArray[np.float16]
    finished: Flags

    @classmethod
    def read(cls, shape: tuple[int, int, int], stream: IO[bytes]) -> Region | None:
        """Read a region in the format of `rebaking_worker`; None if the stream ends early."""
        count, height, width = shape
        size, flags = 2 * 3 * count * height * width, height * width
        found = stream.read(size + flags)
        if len(found) < size + flags:
            return None
        light = np.frombuffer(found[:size], np.float16).reshape(count, height, width, 3)
        return cls(light, np.frombuffer(found[size:], bool).reshape(height, width))


@dataclass(frozen=True)
class Arrived:
    """Arrived light of one edit: region, completeness of the light map, arrays of probes, completeness of all."""

    region: Region | None = None
    light_map: bool = False
    probe_arrays: frozenset[str] = frozenset()
    whole: bool = False

    def has_probe(self, name: str, *, by_group: bool) -> bool:
        """Whether all arrays of an object's probe have arrived."""
        parts = ("radiance", "distance", "planes", *(("groups",) if by_group else ()))
        return all(probe_name(name, part) in self.probe_arrays for part in parts)


class Arrivals:
    """Collects arrivals in `now`; a thread takes the lines of the process."""

    def __init__(self) -> None:
        self.now = Arrived()
        self._lock = threading.Lock()

    def take(self, said: Mapping[str, Any], stream: IO[bytes]) -> bool:
        """Handle a line of the process; return whether it reported an arrival."""
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
