"""A baked scene that answers an edit, for pictures of an edit drawn anew."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from lambent.baked.answering.stored import StoredAnswer
from lambent.materials.document import Material
from lambent.realtime.answering.answering import AnsweredLight
from lambent.realtime.light.baked import BakedScene


def answered_scene(baked: BakedScene, stored: StoredAnswer, edited: Mapping[str, Material]) -> BakedScene:
    """The scene with edited materials, by name, and with light maps and probes that answer them."""
    answer = AnsweredLight(baked, stored)
    light = answer.lit(edited)
    front, back = answer.maps(light)
    probes = {**baked.probes, **{name: answer.probe(name, light) for name in answer.probes}}
    record = baked.record.model_copy(update={"materials": {**baked.record.materials, **edited}})
    groups = answer.groups(light)
    return replace(baked, record=record, irradiance=front, irradiance_back=back, probes=probes, groups=groups)
