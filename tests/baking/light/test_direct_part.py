"""The direct part of a light map: from the same paths, and as exact as a share of its light."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baked.answering.stored import read_answer
from lambent.baking.bake import bake
from lambent.baking.light.direct import direct_part
from lambent.baking.light.sampling import variance_of
from lambent.store.store import Store
from tests.baking.small_scenes import TINY, furnace, room_with_step

GATHERING = TINY.changed("gathering", light_map={"gather_samples": 64})


def noisy(shape: tuple[int, ...], mean: float, deviation: float, seed: int) -> np.ndarray:
    """Light that is never negative."""
    rng = np.random.default_rng(seed)
    return (mean * rng.gamma(1 / deviation**2, deviation**2, shape)).astype(np.float32)


def test_the_share_of_noisy_light_is_found_without_bias() -> None:
    known, labels = np.ones((64, 64), bool), np.zeros((64, 64), int)
    edge = (np.arange(64) < 32)[:, None, None]
    direct = noisy((64, 64, 3), 3.0, 0.3, 1) * edge
    whole = direct + noisy((64, 64, 3), 1.0, 0.3, 2)
    light = np.broadcast_to(np.where(edge, 4.0, 1.0), (64, 64, 3)).astype(np.float16)
    variance = np.where(edge, 0.9, 0.09)[..., 0] * np.ones((64, 64))
    found = direct_part(direct, whole, variance, light, known, labels, 0).astype(float)
    assert found[:31].mean() == pytest.approx(3.0, rel=0.01) and np.std(found[:28]) < 0.15
    assert found[34:].max() < 0.1 and (found <= light).all()


def test_no_direct_light_is_none() -> None:
    known, labels = np.ones((8, 8), bool), np.zeros((8, 8), int)
    whole = noisy((8, 8, 3), 1.0, 0.2, 3)
    assert not direct_part(0 * whole, whole, 0 * whole[..., 0], whole.astype(np.float16), known, labels, 0).any()


def test_shares_that_noise_does_not_explain_are_kept() -> None:
    """A spot of one texel that a lamp lights: its samples agree, so that a filter must not spread it."""
    known, labels = np.ones((64, 64), bool), np.zeros((64, 64), int)
    direct = np.full((64, 64, 3), 0.3, np.float32)
    direct[32, 32] = 9.0
    whole = direct + 1
    sampled = [1.001 * whole, 0.999 * whole]
    found = direct_part(direct, whole, variance_of(np.array(sampled)), whole.astype(np.float16), known, labels, 0)
    assert found[32, 32] == pytest.approx(9.0, rel=0.02)


@pytest.fixture(scope="module")
def gathered(tmp_path_factory: pytest.TempPathFactory) -> Store:
    return bake(furnace(), tmp_path_factory.mktemp("gathered") / "s", quality=GATHERING, only=("answer",))


def test_direct_light_of_a_furnace_is_known(gathered: Store) -> None:
    """Emission .5 and albedo .5: direct irradiance pi/2 of pi."""
    assert gathered.read("light_map/direct").astype(float).mean() == pytest.approx(np.pi / 2, rel=0.01)
    assert read_answer(gathered).answer.direct.mean() == pytest.approx(np.pi / 2, rel=0.01)
    assert "answer/traced" not in gathered, "nothing is sampled twice"


@pytest.mark.usefixtures("mi")
def test_light_is_the_same_with_its_direct_part_kept() -> None:
    from lambent.baking.engine import engine

    engine()
    import mitsuba as mi

    from lambent.baking.tracing import path_tracer
    from lambent.baking.tracing.rays import independent, vectors
    from lambent.baking.tracing.scene_builder import SceneBuilder

    scene = SceneBuilder(room_with_step()).build()
    p = np.random.default_rng(0).uniform(-0.5, 0.5, (256, 3))
    p[:, 1] = 0.01
    up = np.broadcast_to(np.array([0, 1, 0], np.float32), p.shape)
    points = path_tracer.Points(*(vectors(mi.Vector3f, v.astype(np.float32)) for v in (p, up, up)))

    def sums(direct: bool) -> list[np.ndarray]:
        sampler = independent(3, len(p))
        u = sampler.next_2d(), sampler.next_2d()
        found = path_tracer.irradiance_sums(scene, sampler, points, *u, 5, None, path_tracer.AllLight(direct=direct))
        return [np.array(one) for one in found]

    (alone,), both = sums(False), sums(True)
    assert np.array_equal(alone, both[0]) and np.array_equal(both[0], both[1]), "without a cache all light is direct"


def test_unlit_charts_do_not_overflow() -> None:
    """Beside a lit chart, one whose samples are almost black: shares stay within 0 and 1, without warnings."""
    labels = np.zeros((64, 64), int)
    labels[:, 32:] = 1
    samples = np.random.default_rng(3).gamma(9.0, 2.0 / 9, (2, 64, 64, 3)).astype(np.float32)
    samples[:, :, 32:] *= 1e-16
    variance, light = np.full((64, 64), 1e9, np.float32), np.full((64, 64, 3), 2, np.float16)
    with np.errstate(over="raise"):
        direct = direct_part(samples[0], samples.mean(axis=0), variance, light, np.ones((64, 64), bool), labels, 16)
    assert np.isfinite(direct).all() and direct.min() >= 0 and direct.max() <= 2
