"""Adapters in software compile a shader once: conditions of uniforms alone make Mesa's copy it for every pass."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest

from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import LIGHT_MAP_NOISE, SHOW, VIEW_TRANSFORMS, FrameState
from lambent.realtime.gpu.device import adapter_info
from lambent.realtime.integrators.integrators import INTEGRATORS
from lambent.realtime.light.baked import BakedScene, read_baked
from lambent.realtime.renderer import Renderer
from lambent.store.store import Store
from tests.realtime.lit_ball import ball_scene, light_field
from tests.realtime.lit_plate import plate_field, plate_scene
from tests.realtime.lit_wall import OBLIQUE, cube_of, smooth_light, wall_scene
from tests.realtime.planar.test_realtime_planar import mirror, scene_of
from tests.realtime.sun.test_realtime_panes import glazed, pane
from tests.realtime.sun.test_realtime_sun import floor, plate, scene
from tests.viewer.small_store import write_small_store

GLOSSY = Material(kd=0.3, lobes=(Lobe(mx=0.2, my=0.1, r0=(0.2, 0.1, 0.05)),))
WARM, MORE = 3, 4  # frames: a copy for every pass shows within a few


def wall(**more: Any) -> BakedScene:
    return wall_scene(GLOSSY, cube_of(smooth_light), **more)


def glowing() -> BakedScene:
    """The wall as an opening, which shows the sky."""
    made = wall()
    objects = tuple(one.model_copy(update={"emission": (1.0, 2.0, 3.0)}) for one in made.record.objects)
    return replace(made, record=made.record.model_copy(update={"objects": objects}))


def stored() -> BakedScene:
    with TemporaryDirectory() as folder, Store.open(write_small_store(Path(folder) / "small")) as store:
        return read_baked(store)


SCENES: dict[str, Callable[[], BakedScene]] = {
    "stored": stored,
    "wall": wall,
    "glowing": glowing,
    "sun": lambda: scene({"plate": plate(), "floor": floor()}, 0.27, GLOSSY),
    "panes": lambda: glazed({"pane": (pane(1.0), "clear")}),
    "ball": lambda: ball_scene(field=light_field(12, 30, 8)),
    "plate": lambda: plate_scene(plate_field(4, 30)),
    "planar": lambda: scene_of(mirror(0.05)),
}
ACCUMULATING = {"antialias": False}
LOOKS: list[dict[str, Any]] = [{}, ACCUMULATING]
OF_WALL: list[dict[str, Any]] = [
    *({"integrator": name} for name in INTEGRATORS),
    *({"show": name} for name in SHOW if name != LIGHT_MAP_NOISE),
    *({"view_transform": name} for name in VIEW_TRANSFORMS),
]


def compiled() -> int:
    """Bytes of this process's memory that hold code made at run time."""
    lines = Path("/proc/self/maps").read_text().splitlines()
    places = [one.split()[0].split("-") for one in lines if " r-xp 00000000 00:00 0" in one and "[" not in one]
    return sum(int(end, 16) - int(begin, 16) for begin, end in places)


@pytest.mark.long
@pytest.mark.parametrize("name", SCENES)
def test_frames_copy_no_shader(device: Any, name: str) -> None:
    if not sys.platform.startswith("linux") or not adapter_info(device).is_software:
        pytest.skip("only adapters in software compile shaders into this process's memory")
    baked = SCENES[name]()
    camera = next(iter(baked.record.cameras), OBLIQUE)
    renderer, random, grown = Renderer(device, baked), np.random.default_rng(0), {}
    for look in (*LOOKS, *(OF_WALL if name == "wall" else ())):
        before = 0
        for number in range(WARM + MORE):
            if number == WARM:
                before = compiled()
            kd = tuple(float(value) for value in random.uniform(0, 1, 3))
            edited = {key: one.model_copy(update={"kd": kd}) for key, one in baked.record.materials.items()}
            state = FrameState(camera, 48, 32, materials=edited, exposure_ev=float(random.uniform(-1, 1)))
            renderer.display_image(replace(state, **look, **({"accumulate": number} if look is ACCUMULATING else {})))
        if (count := compiled() - before) > 0:
            grown[tuple(look.items())] = count
    assert not grown, f"code was made in {MORE} more frames of looks that had been drawn"
