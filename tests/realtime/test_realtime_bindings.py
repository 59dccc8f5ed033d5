"""Sampled textures of every pipeline: WebGPU allows 16 to a shader stage, and four slots stay free."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.realtime.frame_state import LIGHT_MAP_NOISE, FrameState
from lambent.realtime.incident import look_ups
from lambent.realtime.integrators.integrators import INTEGRATORS
from lambent.realtime.materials import textures as on_gpu
from lambent.realtime.renderer import Renderer
from lambent.scenes.scene import MaterialTextures, Texture
from tests.realtime.lit_plate import plate_field
from tests.realtime.test_realtime_planar import mirror, scene_of, state

MOST = 12
ENTRIES = {
    "vertex_main", "mask_main", "solid_main", "shade_main", "fringe_main", "sky_main", "planar_main",
    "planar_buffer_main", "planar_buffer_sky_main", "planar_buffer_mips_main", "planar_clean_main",
    "planar_walls_main", "accumulate_main", "tonemap_main", "smooth_main", "prefilter_main",
    "enlarge_main", "coverage_main", "missed_main", "cover_main",
}  # fmt: skip


def constant(*values: float) -> Texture:
    return Texture(np.array(values, np.float16)[None, None])


@pytest.fixture
def counted(device: Any, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int]]:
    """(entry point, sampled textures of all its bind group layouts) of every pipeline that is made."""
    kind, made, kept = type(device), [], {}  # type: Any, list[tuple[str, int]], dict[int, Any]

    def recorded(name: str, note: Any) -> None:
        original = getattr(kind, name)

        def call(self: Any, **given: Any) -> Any:
            result = original(self, **given)
            kept[id(result)] = (result, note(given))  # the object too, or another might take its address
            return result

        monkeypatch.setattr(kind, name, call)

    def pipeline(given: dict[str, Any]) -> None:
        entry = (given.get("fragment") or given["vertex"])["entry_point"]
        made.append((entry, kept[id(given["layout"])][1]))

    recorded("create_bind_group_layout", lambda given: sum("texture" in entry for entry in given["entries"]))
    recorded("create_pipeline_layout", lambda given: sum(kept[id(one)][1] for one in given["bind_group_layouts"]))
    recorded("create_render_pipeline", pipeline)
    return made


def test_no_pipeline_samples_more_than_twelve_textures(device: Any, counted: list[tuple[str, int]]) -> None:
    """All integrators, look-ups and methods for planar reflectors, with all textures that a material can have."""
    every = {name: constant(*[0.5] * channels) for name, channels in on_gpu.CHANNELS.items()}
    scene = scene_of(mirror(0.15))
    planes, distance = np.array([[0, 0, 1, 2.0]], np.float32), np.full((6, 2, 2), 3.0, np.float32)
    probes = {name: replace(probe, planes=planes, distance=distance) for name, probe in scene.probes.items()}
    textures = {"floor": MaterialTextures(**every), "paint": MaterialTextures(**{**every, "opacity": None})}
    renderer = Renderer(device, replace(scene, probes=probes, textures=textures))
    small = replace(state(n=1), width=16, height=16, antialias=True, covers=True)
    for integrator in INTEGRATORS:
        renderer.image(replace(small, integrator=integrator))
    for look_up in look_ups():
        renderer.image(replace(small, lookup=look_up, planar="off"))
    renderer.display_image(replace(small, lookup="distance"))
    renderer.image(replace(small, show=LIGHT_MAP_NOISE, accumulate=0))
    assert {entry for entry, _ in counted} == ENTRIES
    assert max(count for _, count in counted) <= MOST, counted
    assert max(count for _, count in counted) > 8, "those of shading are counted"


def test_a_light_field_fits_into_the_slots_that_a_stage_has(device: Any, counted: list[tuple[str, int]]) -> None:
    """With all textures of a material, and beside a planar reflector's."""
    every = {name: constant(*[0.5] * channels) for name, channels in on_gpu.CHANNELS.items()}
    scene = scene_of(mirror(0.15))
    fields = dict.fromkeys((o.name for o in scene.record.objects), plate_field(2, 14))
    textures = {"floor": MaterialTextures(**every)}
    renderer = Renderer(device, replace(scene, light_fields=fields, textures=textures))
    renderer.image(replace(state(n=1), width=16, height=16, lookup="light_field"))
    assert max(count for _, count in counted) == 15, "of 16"


def test_masked_reflectors_are_drawn_in_motion(device: Any) -> None:
    """Pixels that a masked planar reflector covers in part are blended as those of other masked surfaces."""
    opaque = np.random.default_rng(5).random((8, 8, 1)).astype(np.float16)
    scene = scene_of(mirror(0.05))
    masked = replace(scene, textures={"floor": MaterialTextures(opacity=Texture(opaque))})
    frame = FrameState(state().camera, 96, 64)
    drawn, whole = (Renderer(device, one).display_image(frame).astype(int) for one in (masked, scene))
    assert np.abs(drawn - whole).max() > 30
    solid = replace(scene, textures={"floor": MaterialTextures(opacity=constant(1.0))})
    np.testing.assert_array_equal(Renderer(device, solid).display_image(frame), whole)
