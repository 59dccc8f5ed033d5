"""Light maps and probes of edited materials: nothing changes before an edit, and both ways to show an edit agree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.baked.answering.stored import read_answer
from lambent.baked.probes.irradiance import basis_of
from lambent.baking.bake import bake
from lambent.core.geometry.directions import normalize
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe
from lambent.materials.recolour import recoloured
from lambent.realtime.answering.answer_shown import AnswerShown
from lambent.realtime.answering.answering import AnsweredLight
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import read_baked
from lambent.realtime.renderer import Renderer
from lambent.store.store import Store
from tests.baking.small_scenes import TINY, room_with_step
from tests.realtime.answering.answered_scene import answered_scene

VIEW = FrameState(Camera(name="in", position=(1.4, 1.2, -1.4), target=(-0.8, 0.5, 0.0), fov_y_deg=70), 96, 64)


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    return bake(room_with_step(), tmp_path_factory.mktemp("step") / "s", quality=TINY, only=("answer",))


def test_before_an_edit_arrays_are_those_of_the_store(store: Store) -> None:
    baked, stored = read_baked(store), read_answer(store)
    same = answered_scene(baked, stored, {})
    assert same.irradiance is baked.irradiance
    assert all(same.probes[name].radiance is probe.radiance for name, probe in baked.probes.items())
    light = AnsweredLight(baked, stored)
    assert not light.probe_change("ball", light.as_baked).any() and light.likely_error(light.as_baked) == 0


def test_irradiance_of_a_probe_follows_its_radiance(store: Store) -> None:
    """One unit of radiance more all around is pi units of irradiance at any normal."""
    baked = read_baked(store)
    probes = {
        "ball": replace(baked.probes["ball"], irradiance=(3.0,) * 9),
        "blind": replace(baked.probes["ball"], irradiance=()),
    }
    answer = AnsweredLight(replace(baked, unit=0.25, probes=probes), read_answer(store))
    n = normalize(np.random.default_rng(0).normal(size=(20, 3)))
    more = np.array(answer.probe_irradiance("ball", np.ones((6, 8, 8, 3)))) - 3
    assert np.allclose(basis_of(n) @ more, 0.25 * np.pi, rtol=5e-3)
    assert answer.probe_irradiance("blind", np.ones((6, 8, 8, 3))) == ()


def test_red_walls_redden_the_room_and_its_reflection(store: Store) -> None:
    baked, stored = read_baked(store), read_answer(store)
    edited = recoloured(baked.record.materials, {"grey": (0.5, 0.05, 0.05)})
    found = answered_scene(baked, stored, edited)
    assert baked.irradiance is not None and found.irradiance is not None
    before, after = (one.reshape(-1, 3).mean(axis=0) for one in (baked.irradiance, found.irradiance))
    assert after[0] == pytest.approx(before[0], rel=0.05) and after[1] < 0.8 * before[1]
    probe = np.median(found.probes["ball"].radiance.astype(float), axis=(0, 1, 2))  # most of it walls, little lamp
    assert probe[1] < 0.5 * probe[0] and probe.min() >= 0
    assert 0 < AnsweredLight(baked, stored).likely_error(AnsweredLight(baked, stored).lit(edited)) < 0.3


def test_the_error_of_some_texels_stands_for_that_of_all(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    baked, stored = read_baked(store), read_answer(store)
    answer, other = AnsweredLight(baked, stored), AnsweredLight(baked, stored)
    light = answer.lit(recoloured(baked.record.materials, {"grey": (0.5, 0.05, 0.05)}))
    of_all = answer.likely_error(light)
    monkeypatch.setattr("lambent.realtime.answering.answering.ERROR_TEXELS", len(stored.texels) // 3)
    assert other.likely_error(light) == pytest.approx(of_all, rel=0.3) and other.likely_error(light) != of_all


def test_light_of_changed_lobes_is_uncertain(store: Store) -> None:
    """A metal that replaces half of a diffuse colour sends as much light, but elsewhere."""
    baked, stored = read_baked(store), read_answer(store)
    answer, grey = AnsweredLight(baked, stored), baked.record.materials["grey"]
    lobe = Lobe(side="reflection", distribution="beckmann", k=(0.5,) * 3, mx=0.1, my=0.1, r0=(0.9,) * 3)
    half = tuple(c / 2 for c in grey.kd)
    dull, shiny = (grey.model_copy(update={"kd": half, "lobes": lobes}) for lobes in (grey.lobes, (*grey.lobes, lobe)))
    assert answer.likely_error(answer.lit({"grey": shiny})) > 1.4 * answer.likely_error(answer.lit({"grey": dull}))


@pytest.mark.long
def test_shown_answers_come_and_go(store: Store) -> None:
    baked, stored = read_baked(store), read_answer(store)
    renderer, answer = _renderer(store), AnsweredLight(baked, stored)
    shown, first = AnswerShown(renderer, answer), renderer.image(VIEW)
    for colour in ((0.5, 0.05, 0.05), (0.05, 0.05, 0.5)):
        edited = recoloured(baked.record.materials, {"grey": colour})
        shown.show(answer.lit(edited))
        image = renderer.image(FrameState(VIEW.camera, 96, 64, materials=edited))
        anew = Renderer(renderer.device, answered_scene(baked, stored, edited))
        assert np.allclose(image, anew.image(FrameState(VIEW.camera, 96, 64, materials=edited)), rtol=0.02, atol=2e-3)
    shown.show(answer.as_baked)
    assert np.array_equal(renderer.image(VIEW), first)


def _renderer(store: Store) -> Renderer:
    from lambent.realtime.gpu.device import open_device

    return Renderer(open_device(), store)
