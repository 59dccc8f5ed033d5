"""A mix of light groups on the GPU is the sum of the groups' pictures, each times its factor."""

from __future__ import annotations

from concurrent.futures import wait
from dataclasses import replace
from threading import Event
from typing import Any

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.light.light_mix import Factors
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import BakedScene, read_baked
from lambent.realtime.light.group_light import GroupLight
from lambent.realtime.renderer import Renderer
from lambent.store.contract import scene_record, write_scene_record
from lambent.store.store import Store
from tests.viewer.small_store import FRONT, with_light_groups, write_small_store

DARK = (0.0, 0.0, 0.0)
RED = (1.5, 0.25, 0.0)
STATE = FrameState(FRONT, 96, 64, integrator="rings")


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """The small store, its wall a lamp, its light from a sun, a sky and that lamp."""
    store = Store.open(with_light_groups(write_small_store(tmp_path_factory.mktemp("mixed") / "s")))
    record = scene_record(store)
    lit = (o.model_copy(update={"emission": (0.5, 0.4, 0.3)}) if o.name == "wall" else o for o in record.objects)
    write_scene_record(store, record.model_copy(update={"objects": tuple(lit)}))
    return store


@pytest.fixture(scope="module")
def scene(store: Store) -> BakedScene:
    return read_baked(store)


def image(device: Any, scene: BakedScene, light: Factors, **state: Any) -> np.ndarray:
    return Renderer(device, scene).image(replace(STATE, light=light, **state)).astype(float)


NAMES = ("lamp", "sky", "sun")


@pytest.fixture(scope="module")
def alone(device: Any, scene: BakedScene) -> dict[str, np.ndarray]:
    return {name: image(device, scene, {other: DARK for other in NAMES if other != name}) for name in NAMES}


@pytest.mark.long
def test_groups_alone_add_up_to_the_light_as_baked(
    device: Any, scene: BakedScene, alone: dict[str, np.ndarray]
) -> None:
    baked = image(device, scene, {})
    assert sum(alone.values()) == pytest.approx(baked, rel=5e-3, abs=2e-3)
    assert all(picture.mean() > 0.01 for picture in alone.values())


@pytest.mark.long
def test_a_mix_is_the_weighted_sum(device: Any, scene: BakedScene, alone: dict[str, np.ndarray]) -> None:
    mix = {"lamp": RED, "sky": (0.3, 0.3, 0.3), "sun": (0.0, 2.0, 0.0)}
    expected = sum(alone[name] * factor for name, factor in mix.items())
    assert image(device, scene, mix) == pytest.approx(expected, rel=5e-3, abs=2e-3)


@pytest.mark.long
@pytest.mark.parametrize("integrator", ["lamps", "qmc"])
def test_every_kind_of_cube_map_follows(device: Any, scene: BakedScene, integrator: str) -> None:
    """Half of all light is half the picture, by the integrators that read other cube maps and tables of lamps."""
    half = dict.fromkeys(NAMES, (0.5, 0.5, 0.5))
    renderer = Renderer(device, scene)
    state = replace(STATE, integrator=integrator, n=8 if integrator == "qmc" else None)
    before, dimmed = renderer.image(state), renderer.image(replace(state, light=half))
    assert dimmed == pytest.approx(before / 2, rel=6e-3, abs=2e-3)
    assert renderer.image(state) == pytest.approx(before, rel=6e-3, abs=2e-3), "and back"


@pytest.mark.long
def test_the_lamp_itself_dims(device: Any, scene: BakedScene) -> None:
    off = image(device, scene, {"lamp": DARK})
    on = image(device, scene, {})
    wall = on[20, 30] - off[20, 30]
    assert wall == pytest.approx(np.array([0.5, 0.4, 0.3]) + 0.25 * np.array([0.6, 0.55, 0.5]) * 2 / np.pi, rel=0.02)


@pytest.mark.long
def test_a_window_does_not_wait_and_shows_the_same_in_the_end(
    device: Any, scene: BakedScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    renderer, may_mix = Renderer(device, scene), Event()
    mixer, renderer.waits = renderer.mixer, False
    state = replace(STATE, light={"lamp": RED, "sky": DARK})
    before, version, mix = renderer.image(STATE), mixer.version, mixer._map
    assert not mixer.lags, "light as baked"
    monkeypatch.setattr(mixer, "_map", lambda factors: may_mix.wait() and mix(factors))
    try:
        held = renderer.image(state)
        assert mixer.busy and mixer.lags and mixer.version == version
    finally:
        may_mix.set()
    assert held == pytest.approx(before, rel=1e-3, abs=1e-3), "as baked until the mix is ready"
    while mixer.busy:
        wait([work for work in [mixer._work] if work is not None])
        renderer.image(state)
    assert mixer.version > version and not mixer.lags
    expected = image(device, scene, state.light)
    assert renderer.image(state) == pytest.approx(expected, rel=1e-3, abs=1e-3)


@pytest.mark.long
def test_work_that_ends_after_its_last_part_was_shown_is_over(
    device: Any, scene: BakedScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Although no frame is drawn any more."""
    renderer, made, may_end = Renderer(device, scene), Event(), Event()
    mixer, renderer.waits = renderer.mixer, False
    make = mixer._make_stale
    monkeypatch.setattr(mixer, "_make_stale", lambda: (make(), made.set(), may_end.wait()))
    try:
        renderer.image(replace(STATE, light={"lamp": RED}))
        made.wait()
        renderer.image(replace(STATE, light={"lamp": RED}))
        assert mixer.busy and not mixer.lags
    finally:
        may_end.set()
    wait([mixer._work])
    assert not mixer.busy


def test_the_sun_is_in_its_group_alone(scene: BakedScene) -> None:
    groups = scene.groups
    assert groups is not None and scene.sun is not None
    light = GroupLight(scene, groups)
    dimmed = groups.factors({"sun": (0.25, 0.25, 0.25)})
    assert light.sun(dimmed) == pytest.approx(np.array(scene.sun.irradiance) / 4)
    seen, mirrored = light.sky(dimmed)
    bare_seen, bare = light.sky(groups.factors({}))
    assert seen is not None and mirrored is not None and bare is not None and bare_seen is not None
    assert mirrored == pytest.approx(bare), "a mirrored view has no disc, whatever the mix"
    assert seen - mirrored == pytest.approx((bare_seen - bare) / 4, rel=1e-3, abs=1e-3)
    assert (bare_seen - bare).max() > 10, "the sky shows the disc"
    probe = light.probe("ball", groups.factors({"sky": DARK, "lamp": DARK}))
    assert probe is not None and probe.radiance.max() < 16, "its disc, of 50, is drawn by pixel"


@pytest.mark.long
def test_an_unknown_group_is_an_error(device: Any, scene: BakedScene) -> None:
    with pytest.raises(UserError, match=r"unknown light group.*lomp.*lamp, sky, sun"):
        image(device, scene, {"lomp": DARK})
