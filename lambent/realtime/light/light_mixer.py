"""Uploads mixes of light groups: first light map, sky, sun and emitters together, then probe after probe.

A thread computes the arrays and never touches the GPU; finished arrays are uploaded before a frame. If the mix changes
while the thread works, it finishes the current part, then computes the light map, so that a dragged slider shows at
once. Probes follow in turn, one for every few light maps while the mix goes on changing, and all once it rests. Light
that answers edited materials by group (`answering.AnsweredGroups`) takes the same path.
"""

from __future__ import annotations

import math
import time
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.kernels import yielding_to_frames
from lambent.core.light.light_mix import Factors
from lambent.realtime.gpu.cube_mips import finite
from lambent.realtime.gpu.device import adapter_info
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.uploads import with_alpha
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.light.group_arrays import GroupArrays
from lambent.realtime.light.group_light import GroupLight
from lambent.realtime.light.probe_light import ProbeLight
from lambent.realtime.resources import SceneResources

MAPS_PER_PROBE = 4  # while the light changes: probes that lag show less than a light map that does
REST_S = 0.25  # after a change: until then the next is expected, as in a drag
MAP = -1  # number of the light map among the parts; other numbers are probes


def owners_of(scene: BakedScene) -> list[str | None]:
    """By object of the record, the object that owns the light of its probe; None where the sky serves as probe."""
    names = {id(probe.radiance): name for name, probe in scene.probes.items()}
    found = (scene.probe_of(record) for record in scene.record.objects)
    return [None if probe is None else names.get(id(probe.radiance)) for probe in found]


class LightMixer:
    """Mixes a scene's light and shows the mix in its resources.

    Attributes
    ----------
    version : int
        Grows whenever a part is ready, and the picture changes.
    """

    def __init__(self, layouts: Layouts, scene: BakedScene, resources: SceneResources) -> None:
        self._layouts, self._scene, self._resources = layouts, scene, resources
        self.version = 0
        self._wanted: Floats | None = None  # requested mix; None: as baked, and no group has been read
        self._shown: Floats | None = None  # mix of the light map on the GPU; None: as baked
        self._made: dict[int, bytes] = {}  # state that each part was last computed for
        self._ready: deque[tuple[int, Floats, Any]] = deque()
        self._work: Future[None] | None = None
        self._sky_of: Floats | None = None  # mix that the sky was last computed for
        self._answer: GroupLight | None = None  # light for edited materials, which replaces the baked light
        self._answers = 0  # answers received
        self._maps_in_turn = 0  # light maps since the last probe
        self._changed_s = -math.inf  # when light or mix changed last
        self._rests = False  # probes wait for light and mix to rest
        self._is_software = adapter_info(layouts.device).is_software

    @property
    def busy(self) -> bool:
        """Whether a part of the mix is not on the GPU yet."""
        # Not `_work is not None`: work may end after its last part was shown, and then no frame follows to notice.
        computes = self._work is not None and not self._work.done()
        return computes or bool(self._ready)

    @property
    def lags(self) -> bool:
        """Whether the light map on the GPU still shows an earlier mix."""
        if self._wanted is None:
            return False
        return not np.array_equal(self._wanted, np.ones_like(self._wanted) if self._shown is None else self._shown)

    def follow(self, light: Factors, *, waits: bool) -> None:
        """Show a mix from this frame on: the whole mix if the frame `waits`, else the finished parts.

        Raises
        ------
        UserError
            If the store does not have a named group.
        """
        groups = self._scene.groups
        if groups is None or (self._wanted is None and not light):
            return
        wanted = groups.factors(light)
        if self._wanted is None or not np.array_equal(wanted, self._wanted):
            self._wanted, self._changed_s = wanted, time.monotonic()
        self._rests = not waits
        while True:
            if self._work is not None and (waits or self._work.done()):
                self._work.result()
                self._work = None
            while self._ready:
                self._show(*self._ready.popleft())
            if self._work is not None or not self._stale():
                return
            self._work = self._thread.submit(self._make, beside=self._is_software and not waits)

    def answer(self, groups: GroupArrays) -> None:
        """Mix these arrays from the next frame on: light that answers edited materials, or the scene's own again."""
        if self._wanted is None:
            self._wanted = groups.factors({})
        self._answer, self._changed_s = replace(self.baked, groups=groups), time.monotonic()
        self._answers += 1  # written last and read first by the thread, so that it never takes old light for new

    @property
    def groups(self) -> GroupArrays | None:
        """The light by group; None if the scene was baked without groups."""
        return self._scene.groups if self._answer is None else self._answer.groups

    @property
    def factors(self) -> Floats | None:
        """Factors (n, 3) of the requested mix; None while all light is as baked."""
        return self._wanted

    @cached_property
    def _thread(self) -> ThreadPoolExecutor:
        return ThreadPoolExecutor(1, "light")

    @cached_property
    def baked(self) -> GroupLight:
        """The baked light by group: of sky, sun and emitters, which no edited material changes."""
        assert self._scene.groups is not None, "asked for with groups alone"
        return GroupLight(self._scene, self._scene.groups)

    @cached_property
    def _owners(self) -> dict[int, str | None]:
        """The object that owns each probe's light, by number; None where the sky serves as probe."""
        owners = owners_of(self._scene)
        return {number: owners[users[0]] for number, users in enumerate(self._users)}

    @cached_property
    def _users(self) -> list[list[int]]:
        """Numbers of the objects that show each probe's light."""
        found: dict[int, list[int]] = {}
        for number, item in enumerate(self._resources.objects):
            found.setdefault(id(item.light), []).append(number)
        return list(found.values())

    def _stale(self) -> list[int]:
        """Parts not yet computed for the requested mix: the light map, then probes, the oldest first."""
        assert self._wanted is not None
        now, parts = self._state(self._wanted), [MAP, *range(len(self._users))]
        age = {part: place for place, part in enumerate(self._made)}
        return [p for p in sorted(parts, key=lambda p: (p != MAP, age.get(p, -1))) if self._made.get(p) != now]

    def _make(self, *, beside: bool) -> None:
        """Compute stale parts until none is left; while the mix changes, a probe follows every few light maps.

        `beside`: frames are drawn meanwhile, by the processor.
        """
        with yielding_to_frames(beside):
            self._make_stale()

    def _make_stale(self) -> None:
        while stale := self._stale():
            assert self._wanted is not None
            is_turn = self._maps_in_turn >= MAPS_PER_PROBE
            if stale[0] != MAP and not is_turn and self._rests and time.monotonic() < self._changed_s + REST_S:
                time.sleep(REST_S / 16)
                continue
            part, factors = stale[1] if is_turn and stale[0] == MAP and len(stale) > 1 else stale[0], self._wanted
            self._maps_in_turn = self._maps_in_turn + 1 if part == MAP else 0
            state = self._state(factors)
            made = self._map(factors) if part == MAP else self._probe(part, factors)
            self._made.pop(part, None)
            self._made[part] = state
            self._ready.append((part, factors, made))
            self.version += 1

    def _state(self, factors: Floats) -> bytes:
        """Key of the inputs of a part: the light and the mix."""
        return self._answers.to_bytes(8) + factors.tobytes()

    @property
    def surfaces(self) -> GroupLight:
        """Light of surfaces and probes: the answer to edited materials if there is one, else the baked light."""
        return self._answer or self.baked

    def _map(self, factors: Floats) -> Any:
        sides, before = self.surfaces.light_map(factors), self._sky_of
        lamps = None if self._scene.lamps is None else self._scene.lamps.in_map(factors)
        if before is not None and not self.baked.turns_sky(factors, before):
            return sides, lamps, (None, None)
        self._sky_of, skies = factors, self.baked.sky(factors)
        return sides, lamps, tuple(None if sky is None else with_alpha(finite(sky)[0]) for sky in skies)

    def _probe(self, number: int, factors: Floats) -> ProbeLight | None:
        light, owner = self._resources.objects[self._users[number][0]].light, self._owners[number]
        if self.groups is self._scene.groups and (factors == 1).all():
            return light.as_baked
        sky_change = self.baked.sky_change(factors)
        if owner is None:
            sky = self.baked.sky(factors)[1]
            return None if sky is None else light.relit(finite(sky)[0], (), sky_change)
        probe = self.surfaces.probe(owner, factors)
        return None if probe is None else light.relit(probe.radiance, probe.irradiance, sky_change)

    def _show(self, part: int, factors: Floats, made: Any) -> None:
        """Upload a part."""
        resources, light = self._resources, self.baked
        if part != MAP:
            for number in self._users[part] if made is not None else ():
                item = resources.objects[number]
                item.relight(made, item.emission)
            return
        sides, of_lamps, (shown, mirrored) = made
        self._shown = factors
        if of_lamps is not None:
            resources.lamps.shine(factors, of_lamps)
        resources.show_light_map(sides)
        if shown is not None and mirrored is not None:
            resources.sky_group = resources.sky_group_of(shown)
            resources.mirrored_sky_group = resources.sky_group_of(mirrored)
        if (sun := light.sun(factors)) is not None:
            resources.sun.shine(sun)
        for item in resources.objects:
            item.relight(item.light, light.emission(item.record, factors))
