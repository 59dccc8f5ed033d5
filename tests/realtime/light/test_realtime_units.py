"""Stores whose cube maps have a unit: the sun has room, and every picture is that of the same light without a unit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.core.light.colour import HALF_MAX, in_halves
from lambent.core.light.false_colour import Range
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import BakedScene, read_baked
from lambent.realtime.renderer import Renderer
from lambent.store.contract import probe_name, scene_record, write_scene_record
from lambent.store.store import Store
from tests.viewer.small_store import FRONT, write_small_store

UNIT = 256.0
CUBES = ("environment/radiance", probe_name("ball", "radiance"))


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> tuple[BakedScene, BakedScene]:
    """The same light, once with cube maps in units, once without; a floor that glows."""
    scenes = []
    for unit in (1.0, UNIT):
        store = Store.open(write_small_store(tmp_path_factory.mktemp("s") / "s"))
        record = scene_record(store)
        first, *rest = record.objects
        glowing = first.model_copy(update={"emission": (3.0, 2.0, 1.0)})
        write_scene_record(store, record.model_copy(update={"objects": (glowing, *rest)}))
        for name in CUBES:
            meta = {**store.artefact(name).meta, "unit": unit, "seen_irradiance": [2.0, *[0.0] * 8]}
            values = (store.read(name).astype(np.float32) / unit).astype(np.float16)
            store.put(name, name.split("/")[0], values, key=f"in {unit}", meta=meta)
        scenes.append(read_baked(store))
    return scenes[0], scenes[1]


@pytest.mark.long
def test_light_in_units_is_the_same_light(device, pair: tuple[BakedScene, BakedScene]) -> None:
    plain, scaled = pair
    assert (plain.unit, scaled.unit) == (1.0, UNIT)
    state = FrameState(FRONT, 64, 48)
    of_plain, of_scaled = (Renderer(device, scene) for scene in pair)
    for n, show in enumerate(("full", "diffuse", "specular", "light-map")):
        drawn = replace(state, show=show)
        expected = of_plain.image(drawn)
        assert expected.max() > 0
        np.testing.assert_allclose(of_scaled.image(drawn), expected, rtol=2e-3, atol=1e-4, err_msg=f"{n} {show}")
    np.testing.assert_allclose(of_scaled.converged(state, 8), of_plain.converged(state, 8), rtol=2e-3, atol=1e-4)
    for view, exposure_ev in (("filmic", -1.0), ("false-colour", 0.0)):
        shown = replace(state, view_transform=view, exposure_ev=exposure_ev, scale=Range(10, 1000))
        a, b = (renderer.display_image(shown).astype(int) for renderer in (of_plain, of_scaled))
        assert a.std() > 10 and np.abs(a - b).max() <= 2


def test_a_sun_keeps_its_light(tmp_path: Path) -> None:
    sun = np.zeros((6, 4, 4, 3), np.float32)
    sun[0, 1, 1] = 7.1e6
    values, unit = in_halves(sun)
    assert values.dtype == np.float16 and unit == 128
    np.testing.assert_allclose(values.astype(np.float32) * unit, sun, rtol=1e-3)
    plain = np.full((6, 2, 2, 3), 0.3, np.float32)
    assert in_halves(plain)[1] == 1 and np.array_equal(in_halves(plain)[0], plain.astype(np.float16))
    assert in_halves(np.array([1e30, np.inf]))[0].max() <= HALF_MAX
    store = Store.open(write_small_store(tmp_path / "s"))
    store.put(CUBES[0], "environment", values, key="sunny", meta={"unit": unit})
    scene = read_baked(store)
    assert scene.unit == unit and scene.environment.max() * unit == pytest.approx(7.1e6, rel=1e-3)
    assert scene.probes["ball"].radiance.max() < store.read(CUBES[1]).max() / (unit - 1)
