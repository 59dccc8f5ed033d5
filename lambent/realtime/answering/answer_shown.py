"""Uploads light that answers edited materials in one go: light maps, then probes.

Light by group goes through the renderer's mixer, which mixes it before the next frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lambent.realtime.answering.answering import AnsweredLight, Lit
from lambent.realtime.gpu.cube_mips import finite
from lambent.realtime.light.probe_light import ProbeLight
from lambent.realtime.renderer import Renderer


def answered(baked: ProbeLight, answer: AnsweredLight, name: str, light: Lit) -> ProbeLight:
    """A probe's light after the surfaces that it sees changed to `light`."""
    change = answer.probe_change(name, light)
    radiance = np.maximum(finite(baked.probe.radiance)[0] + change, 0)
    return baked.relit(radiance, answer.probe_irradiance(name, change))


def users_of(lights: Sequence[ProbeLight], owners: Mapping[str, ProbeLight]) -> dict[str, list[int]]:
    """Numbers of the objects that show each owner's probe; `lights` by object, `owners` by name."""
    return {name: [k for k, one in enumerate(lights) if one is light] for name, light in owners.items()}


class AnswerShown:
    """Light of a renderer's scene for edited materials; nothing else may change the renderer's light meanwhile."""

    def __init__(self, renderer: Renderer, answer: AnsweredLight) -> None:
        self._renderer, self._answer = renderer, answer
        self._shown = answer.as_baked
        self._baked_probes = {name: renderer.resources.light_of(name) for name in answer.probes}
        self._users = users_of([item.light for item in renderer.resources.objects], self._baked_probes)

    def show(self, light: Lit) -> None:
        """Show this light from the next frame on."""
        if light is self._shown:
            return
        self._shown = light
        groups = self._answer.groups(light)
        if groups is not None:
            self._renderer.mixer.answer(groups)
            return
        resources = self._renderer.resources
        resources.show_light_map(list(self._answer.layers(light)))
        for name, baked in self._baked_probes.items():
            made = baked if light.is_baked else answered(baked, self._answer, name, light)
            for item in (resources.objects[k] for k in self._users[name]):
                item.relight(made, item.emission)
        resources.light_version += 1
