"""A probe on the GPU: its cube maps, table of its lamps, and resources of its look-ups."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.plain import Triple
from lambent.realtime.gpu.cube_mips import SMOOTH_AREA, finite, light_change, mip_chain, smooth_chain
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.uploads import upload, with_alpha
from lambent.realtime.incident import LookUp, look_up_of
from lambent.realtime.integrators.integrators import Cube
from lambent.realtime.integrators.prefilter import prefiltered_cube
from lambent.realtime.light.baked import DARK, Probe
from lambent.realtime.light.probe_lamps import ProbeLamps
from lambent.realtime.light_fields.resident_maps import ResidentMaps


def kind_of(cube: Cube) -> str:
    """Kind of the binding (`layouts.KINDS`) of a cube map."""
    return "cubes" if cube == "cleaned" else "cube"


class ProbeLight:
    """Bindings of a probe, shared by its objects; objects without a probe are dark.

    Cube maps and the resources of a look-up are made on first use.
    """

    def __init__(self, layouts: Layouts, probe: Probe | None, sampler: Any, look_ups: dict[str, LookUp]) -> None:
        self._layouts, self._sampler, self.probe, self._look_ups = layouts, sampler, probe or DARK, look_ups
        self._texture = cache(self._new_texture)
        self._levels: dict[Cube, list[NDArray[np.float16]]] = {}  # of cube maps prepared in advance
        self._used: set[Cube] = set()
        self.table = cache(self._new_table)  # of lamps, by look-up
        self.streams: list[ResidentMaps] = []  # of the light field, if some of its maps are not on the GPU
        self._resources: dict[str, tuple[Any, ...]] = {}  # of look-ups, by their files
        self.as_baked = self  # the same probe in baked light
        self.sky_change = (1.0, 1.0, 1.0)  # ratio of the sky to the baked sky

    def resources(self, look_up: LookUp) -> tuple[Any, ...]:
        """Resources of a look-up; look-ups of one file share them."""
        if look_up.__file__ not in self._resources:
            self._resources[look_up.__file__] = look_up.resources(self._layouts.device, self.probe, self.streams)
        return self._resources[look_up.__file__]

    @property
    def device(self) -> Any:
        return self._layouts.device

    def view(self, cube: Cube) -> Any:
        """View of a cube map of the probe's radiance."""
        return self._texture(cube).create_view(dimension="cube-array" if cube == "cleaned" else "cube")

    def half_log2_texels(self, cube: Cube) -> float:
        """Half the log2 of texels per unit area of the cube [-1, 1]^3 (N^2/4 in 4.17), corrected for the blur."""
        blur = np.log2(SMOOTH_AREA) / 2 if cube in ("smooth", "cleaned") else 0
        return float(np.log2(self.probe.radiance.shape[1] / 2) - blur)

    def _new_texture(self, cube: Cube) -> Any:
        self._used.add(cube)
        if cube == "prefiltered":
            return prefiltered_cube(self._layouts, self._texture("box"), self._sampler)
        levels = self._levels.pop(cube) if cube in self._levels else self._chain(cube)
        return upload(self._layouts.device, levels, "rgba16float")

    def _chain(self, cube: Cube) -> list[NDArray[np.float16]]:
        """Levels of a cube map in the form of its texture."""
        if cube == "cleaned":
            return [with_alpha(level) for level in self.lamps.chain()]
        chain = smooth_chain if cube == "smooth" else mip_chain
        return [with_alpha(level) for level in chain(finite(self.probe.radiance)[0])]

    @property
    def is_relit(self) -> bool:
        """Whether the light differs from the light that the light field was baked in."""
        return self.as_baked is not self

    def change_view(self) -> Any:
        """View of a cube map of the ratio of the light to the baked light, by direction."""
        return upload(self._layouts.device, self._change, "rgba16float").create_view(dimension="cube")

    @cached_property
    def _change(self) -> list[NDArray[np.float16]]:
        now, before = (finite(light.probe.radiance)[0] for light in (self, self.as_baked))
        return [with_alpha(level) for level in light_change(now, before)]

    def relit(
        self, radiance: Floats, irradiance: tuple[float, ...], sky_change: Triple = (1.0, 1.0, 1.0)
    ) -> ProbeLight:
        """The same probe with new light; prepares the cube maps and lamps that this one has used.

        `radiance` is (6, N, N, 3), `irradiance` as in `Probe`, `sky_change` the ratio of the sky to the baked sky. Does
        not touch the GPU, so any thread may call it.
        """
        probe = replace(self.probe, radiance=radiance, irradiance=irradiance)
        other = ProbeLight(self._layouts, probe, self._sampler, self._look_ups)
        other._resources, other.streams = self._resources, self.streams  # they do not depend on the cube's light
        for cube in sorted(self._used | set(self._levels)):
            if cube != "prefiltered":
                other._levels[cube] = other._chain(cube)
        if "lamps" in self.__dict__:
            _ = other.lamps
        other.as_baked, other.sky_change = self.as_baked, sky_change
        if self.probe.light_field is not None:
            _ = other._change
        return other

    @cached_property
    def lamps(self) -> ProbeLamps:
        return ProbeLamps(self.probe.radiance)

    def _new_table(self, look_up: LookUp) -> Any:
        return self._layouts.buffer("UNIFORM", self.lamps.table(self.probe, look_up))

    @cached_property
    def cheapest(self) -> LookUp:
        """The look-up for draws without lobes."""
        return next(one for one in self._look_ups.values() if one.serves(self.probe))

    def look_up(self, wanted: str) -> LookUp:
        """The look-up named `wanted` if it serves the probe, else the preferred one."""
        return look_up_of(self.probe, wanted, self._look_ups)
