"""Light that follows edited materials while the camera moves: computed in a thread, shown as soon as it is ready.

The light map comes first, then the probes one by one. A new edit drops the probes of the previous one, so that the
light map lags by at most one computation.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lambent.baked.answering.stored import has_answer, read_answer
from lambent.core.errors import UserError
from lambent.core.kernels import yielding_to_frames
from lambent.core.progress import Progress
from lambent.materials.document import Material
from lambent.realtime.answering.answer_shown import answered, users_of
from lambent.realtime.answering.answering import AnsweredLight, Lit
from lambent.realtime.gpu.device import adapter_info
from lambent.realtime.lamps.drawn import ShadowedLamp
from lambent.realtime.light.group_arrays import GroupArrays
from lambent.realtime.light.probe_light import ProbeLight
from lambent.realtime.renderer import Renderer
from lambent.scenes.lamp_edits import LampEdit
from lambent.scenes.looks.variants import textures_in_look
from lambent.scenes.scene import ImageTexture, Look
from lambent.store.store import Store
from lambent.viewer.background.work import Work

AS_BAKED = "indirect light: as baked"
ESTIMATED = "indirect light: estimated"
WITHOUT = "light on other surfaces stays as baked: the store has no answer data (`lambent bake --only answer`)"

Pairs = list[tuple[ShadowedLamp, ShadowedLamp]]  # lamps as baked, and as they are


@dataclass
class Answering:
    """State for the panel: whether light follows edits, a line of status, and the likely relative error."""

    possible: bool = False
    on: bool = True
    said: str = WITHOUT
    likely_error: float | None = None

    @property
    def note(self) -> str:
        """A line for the panel."""
        if self.likely_error is None or not self.on:
            return self.said
        return f"indirect light: estimated, error up to {100 * self.likely_error:.1f} %"


class Wanted(NamedTuple):
    """Edited materials, exchanged textures with paths of images, by material, and edited lamps by number."""

    materials: Mapping[str, Material]
    textures: Mapping[str, str | ImageTexture]
    lamps: Mapping[int, LampEdit]


@dataclass(frozen=True, eq=False)
class _Maps:
    """Light maps of edited materials.

    `groups` are for the light mixer, if the store has light groups; else `layers` are the light maps, and probes
    follow.
    """

    light: Lit
    layers: NDArray[np.float16] | None
    groups: GroupArrays | None
    likely_error: float | None


class AnsweringLight:
    """Uploads the light of edited materials to the GPU. Call it from the thread of the window only."""

    def __init__(self, store: Store, renderer: Renderer, shown: Answering) -> None:
        self._store, self._renderer, self._shown = store, renderer, shown
        self._answer: AnsweredLight | None = None  # made in the thread at the first edit
        self._of: Wanted | None = Wanted(
            {}, {}, {}
        )  # materials and textures of the shown light; None: compute it again
        self._work: Work | None = None
        self._probes_of: Lit | None = None  # light whose probes are waiting
        self._probing: Lit | None = None  # light whose probes are being computed
        self._as_baked: dict[str, ProbeLight] | None = None  # baked light by owner of a probe
        self._first = [item.light for item in renderer.resources.objects]  # as baked
        self._users: dict[str, list[int]] = {}  # indices of the objects that show each probe
        self._is_software = adapter_info(renderer.device).is_software
        shown.possible = has_answer(store) and not renderer.scene.replaced
        if shown.possible:
            shown.said = AS_BAKED
        elif renderer.scene.replaced:
            shown.said = "light on other surfaces stays as baked: an object is replaced"

    def another(self, renderer: Renderer, shown: Answering) -> AnsweringLight:
        """A copy for another renderer of the scene, sharing data read from the store."""
        made = AnsweringLight(self._store, renderer, shown)
        made._answer = self._answer
        return made

    @property
    def busy(self) -> bool:
        """Whether light is being computed."""
        return self._work is not None

    def update(
        self, edited: Mapping[str, Material], textures: Mapping[str, str | ImageTexture] = MappingProxyType({}),
        lamps: Mapping[int, LampEdit] = MappingProxyType({}),
    ) -> None:  # fmt: skip
        """Take finished light, and start the light for these materials, exchanged textures and shown lamps."""
        if not self._shown.possible:
            return
        wanted = Wanted(dict(edited), dict(textures), dict(lamps)) if self._shown.on else Wanted({}, {}, {})
        if self._work is not None and self._work.poll():
            self._work = self._probing = None
        if wanted != self._of and self._work is not None and self._probing is not None:
            self._work.cancel()  # probes of an earlier edit; computed again if that edit returns
            self._probes_of, self._probing = self._probing, None
        if self._work is not None:
            return
        if wanted != self._of:
            self._of, self._probes_of = wanted, None
            pairs = self._renderer.resources.changed_lamps.pairs() if wanted.lamps else []
            self._work = Work(lambda progress: self._maps(wanted, pairs), self._show_maps, self._failed)
        elif self._probes_of is not None:
            light, self._probes_of = self._probes_of, None
            self._begin_probes(light)

    def again(self) -> None:
        """Compute the light again at the next `update`, because another light was shown meanwhile."""
        self._of = None

    def close(self) -> None:
        """Stop computing."""
        if self._work is not None:
            self._work.cancel()
            self._work.wait()
            self._work = None

    def _maps(self, wanted: Wanted, pairs: Pairs) -> _Maps:
        """Compute the light maps of edited materials and textures; runs in the thread."""
        with yielding_to_frames(self._is_software):
            return self._computed_maps(wanted, pairs)

    def _computed_maps(self, wanted: Wanted, pairs: Pairs) -> _Maps:
        if self._answer is None:
            self._answer = AnsweredLight(self._renderer.scene, read_answer(self._store))
        scene = self._renderer.scene
        looks = {name: Look(scene.record.materials[name], of) for name, of in wanted.textures.items()}
        textures = {name: textures_in_look(name, look, scene.textures) for name, look in looks.items()}
        change = self._answer.lamp_changes.of(pairs) if pairs else None
        light = self._answer.lit(wanted.materials, textures, change)
        groups = self._answer.groups(light)
        off = None if light.is_baked else self._answer.likely_error(light, self._renderer.mixer.factors)
        return _Maps(light, None if groups else self._answer.layers(light), groups, off)

    def _show_maps(self, maps: _Maps) -> None:
        self._shown.said = AS_BAKED if maps.light.is_baked else ESTIMATED
        self._shown.likely_error = maps.likely_error
        if maps.groups is not None:  # the mixer makes light maps and probes from them
            self._renderer.mixer.answer(maps.groups)
        elif maps.layers is not None:
            self._renderer.resources.show_light_map(list(maps.layers))
            self._probes_of = maps.light
        self._renderer.resources.light_version += 1

    def _begin_probes(self, light: Lit) -> None:
        answer, resources = self._answer, self._renderer.resources
        assert answer is not None, "maps come before probes"
        if self._as_baked is None:
            owners = {item.record.name: light for item, light in zip(resources.objects, self._first, strict=True)}
            self._as_baked = {name: owners[name] for name in answer.probes}
            self._users = users_of(self._first, self._as_baked)
        baked = self._as_baked

        def run(progress: Progress) -> dict[str, ProbeLight]:
            found = {}
            for number, name in enumerate(answer.probes):
                progress(number, len(answer.probes), "probes")
                with yielding_to_frames(self._is_software):
                    found[name] = baked[name] if light.is_baked else answered(baked[name], answer, name, light)
            return found

        def show(found: dict[str, ProbeLight]) -> None:
            for name, made in found.items():
                for item in (resources.objects[k] for k in self._users[name]):
                    item.relight(made, item.emission)
            resources.light_version += 1

        self._work, self._probing = Work(run, show, self._failed), light

    def _failed(self, error: UserError) -> None:
        self._shown.possible, self._shown.said = False, f"light on other surfaces stays as baked: {error}"
