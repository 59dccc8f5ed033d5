"""A frame for any camera: its passes, the records that a camera writes, clusters and reflectors that it may see."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from lambent.realtime.frame_state import FrameState, frame_data, near_of
from lambent.realtime.gpu.commands import Commands
from lambent.realtime.gpu.structs import FRAME_DTYPE, MIRRORED_VIEW_DTYPE, PLAN_DTYPE, offsets_of
from lambent.realtime.passes.cover import PLACES
from lambent.realtime.planar.planar_view import MOST_REFLECTORS
from lambent.realtime.renderer import Renderer
from lambent.site.manifest import Manifest, camel
from lambent.store.contract import ReflectorRecord


def frames_of(renderer: Renderer, state: FrameState, shown: Any) -> dict[str, Commands]:
    """The frames of a state: in motion, with and without averaged edges; and the means of odd and even frames at rest.

    `shown` is the view of the display image.
    """
    states = {
        "moving": replace(state, covers=True), "plain": state,
        "even": replace(state, accumulate=0), "odd": replace(state, accumulate=1),
    }  # fmt: skip
    found = {name: Commands() for name in states}
    for name, one in states.items():
        renderer.frame(one, found[name], shown, whole=True)
    return found


def widest(renderer: Renderer, state: FrameState) -> dict[int, float]:
    """By the reflectors that a state mirrors, in the order of its views: the largest m of their lobes."""
    of_objects, reflectors = renderer.widest(state), renderer.scene.record.reflectors
    return {
        number: max(of_objects[part.object] for part in reflectors[number].parts)
        for number in renderer.reflectors(state)
    }


def cameras_of(renderer: Renderer, manifest: Manifest, state: FrameState) -> dict[str, Any]:
    """Parts of a manifest that serve all states: the camera's records, clusters and reflectors."""
    bounds = renderer.scene.record.bounds
    places, sizes = renderer.clusters.table()
    reflectors = renderer.scene.record.reflectors
    return {
        "frame": {
            "buffer": manifest.written(renderer.frame_buffer), "bytes": list(frame_data(state, bounds).tobytes()),
            "nearM": near_of(bounds), "offsets": offsets_of(FRAME_DTYPE),
            "weight": manifest.written(renderer.accumulate.weight),
            "places": [
                {"buffer": manifest.written(buffer), "jitter": list(at)}
                for buffer, at in zip(renderer.cover.uniforms, PLACES, strict=True)
            ],
        },
        "clusters": {"places": manifest.chunks.add_table(places), "sizes": manifest.chunks.add_table(sizes)},
        "mirrors": {
            "most": MOST_REFLECTORS, "offsets": offsets_of(MIRRORED_VIEW_DTYPE), "planOffsets": offsets_of(PLAN_DTYPE),
            "bytes": MIRRORED_VIEW_DTYPE.itemsize, "planBytes": PLAN_DTYPE.itemsize,
            "buffers": [_buffers(manifest, renderer.planar.uniforms(k)) for k in range(len(reflectors))],
            "reflectors": [reflector_for_page(one) for one in reflectors],
            "corners": [
                manifest.chunks.add_table(renderer.reflector_faces.corners(k).reshape(-1, 3).astype(np.float32))
                for k in range(len(reflectors))
            ],
        },
    }  # fmt: skip


def _buffers(manifest: Manifest, uniforms: tuple[Any, Any, Any]) -> dict[str, int]:
    return {name: manifest.written(one) for name, one in zip(("frame", "view", "plan"), uniforms, strict=True)}


def reflector_for_page(one: ReflectorRecord) -> dict[str, Any]:
    plan = None if one.plan is None else camel(one.plan.model_dump(mode="json", exclude={"packed"}))
    return {
        **camel(one.model_dump(mode="json", include={"plane", "outline", "two_sided", "deviation_m"})),
        "plan": plan,
    }
