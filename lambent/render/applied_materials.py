"""Changed materials in a renderer's images: variants, colours and keyframes, and the light that follows them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from types import MappingProxyType

from lambent.baked.answering.stored import NO_ANSWER, has_answer, read_answer
from lambent.core.plain import Triple
from lambent.materials.document import Material
from lambent.realtime.answering.answer_shown import AnswerShown
from lambent.realtime.answering.answering import AnsweredLight
from lambent.realtime.answering.texture_detail import without_uv
from lambent.realtime.light.group_arrays import FIELDS_FOLLOW
from lambent.realtime.renderer import Renderer
from lambent.render.edits import edits_of
from lambent.scenes.lamp_edits import LampEdit
from lambent.scenes.looks.variants import textures_in_look
from lambent.scenes.scene import Look
from lambent.store.contract import needs_probe
from lambent.store.store import Store

ESTIMATED = "light and probes are estimated for the changed materials, not baked again"


class AppliedMaterials:
    """The changed materials of a renderer's scene: `materials` replace the store's, by name, in frame states.

    Attributes
    ----------
    answers : bool
        Whether light follows the changed materials; otherwise a note says so once.
    """

    def __init__(self, store: Store, renderer: Renderer, note: Callable[[str], None], *, follows: bool = True) -> None:
        self._store, self._renderer, self._note = store, renderer, note
        self._noted: set[str] = set()
        self.answers, self._follows = has_answer(store), follows
        self.materials: Mapping[str, Material] = {}
        self._looks: Mapping[str, Look] = {}
        self._lamps: Mapping[int, LampEdit] = {}

    def apply(
        self, looks: Mapping[str, Look], colours: Mapping[str, Triple], textures: Mapping[str, str],
        lamps: Mapping[int, LampEdit] = MappingProxyType({}),
    ) -> None:  # fmt: skip
        """Apply looks, then textures (`scenes.looks.retexturing`), diffuse colours, lamps, and the light that follows.

        Materials and lamps left out stay as baked.
        """
        scene = self._renderer.scene
        edits = edits_of(scene.record.materials, scene.textures, self._without_uv, looks, colours, textures)
        changed, materials = edits.looks, edits.materials
        if (changed, materials, lamps) == (self._looks, self.materials, self._lamps):
            return
        if changed != self._looks:
            self._renderer.resources.show_textures(changed)
        self._renderer.resources.changed_lamps.show(lamps)
        self._looks, self.materials, self._lamps = changed, materials, lamps
        if changed or materials:
            self._note_limits(materials)
        if self.answers and self._follows:
            answer, shown = self._shown
            exchanged = {name: textures_in_look(name, look, scene.textures) for name, look in changed.items()}
            pairs = self._renderer.resources.changed_lamps.pairs() if lamps else []
            shown.show(answer.lit(materials, exchanged, answer.lamp_changes.of(pairs) if pairs else None))

    @cached_property
    def _without_uv(self) -> frozenset[str]:
        return without_uv(self._renderer.scene)

    @cached_property
    def _shown(self) -> tuple[AnsweredLight, AnswerShown]:
        answer = AnsweredLight(self._renderer.scene, read_answer(self._store))
        return answer, AnswerShown(self._renderer, answer)

    def _note_limits(self, materials: Mapping[str, Material]) -> None:
        """Note estimated light of these materials, and data that the bake lacks for them."""
        scene = self._renderer.scene
        self._once(ESTIMATED if self.answers else f"light and probes stay as baked: {NO_ANSWER}")
        if scene.light_fields:
            self._once(FIELDS_FOLLOW)
        shared, has_probe = scene.shared_probes, {o.material for o in scene.record.objects if o.name in scene.probes}
        has_probe |= {o.material for o in scene.record.objects if shared.get(o.name) in scene.probes}
        for name, material in materials.items():
            baked = scene.record.materials[name]
            if needs_probe(material) and not needs_probe(baked) and name not in has_probe:
                self._once(f"{name} was matte in the bake: its reflections come from the nearest probe")
            if material.transmits and not baked.transmits and scene.irradiance_back is None:
                self._once(f"{name} was opaque in the bake: its far side stays dark")

    def _once(self, text: str) -> None:
        if text not in self._noted:
            self._noted.add(text)
            self._note(text)
