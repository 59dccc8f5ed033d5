"""The guided sky: densities, light through windows by hand, and no guide where it is no use."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scipy.stats import chi2

from lambent.baking.engine import engine
from lambent.baking.sky.bins import BINS, SUB, SkyBins, alias_tables
from lambent.baking.tracing.lights.emitters import balance_emitters
from lambent.baking.tracing.scene_builder import SceneBuilder, environment_dict
from lambent.core.pictures.images import write_image
from lambent.scenes.geometry import merge, patch
from lambent.scenes.scene import ConstantEnvironment, ImageEnvironment, Scene, SceneObject
from tests.baking.small_scenes import BLACK, plane
from tests.baking.tracing.facing_up import facing_up, irradiance

HALF = 0.25  # of the opening's side
HIGH = 2.0


def pit(environment: object) -> Scene:
    """A closed black box of 4 x 2 x 4 m about (0, 1, 0) with a square hole of .5 m in the middle of its ceiling."""

    def lid(x0: float, x1: float, z0: float, z1: float):  # type: ignore[no-untyped-def]
        return patch((x0, HIGH, z0), (x1 - x0, 0, 0), (0, 0, z1 - z0))

    walls = [
        patch((-2, 0, 2), (4, 0, 0), (0, 0, -4)),
        patch((-2, 0, 2), (0, 0, -4), (0, HIGH, 0)),
        patch((2, 0, -2), (0, 0, 4), (0, HIGH, 0)),
        patch((-2, 0, -2), (4, 0, 0), (0, HIGH, 0)),
        patch((2, 0, 2), (-4, 0, 0), (0, HIGH, 0)),
        lid(-2, 2, -2, -HALF), lid(-2, 2, HALF, 2), lid(-2, -HALF, -HALF, HALF), lid(HALF, 2, -HALF, HALF),
    ]  # fmt: skip
    return Scene("pit", (SceneObject("pit", merge(walls), "black"),), {"black": BLACK}, environment=environment)


def sunny(folder: Path) -> ImageEnvironment:
    """A dim sky with a sun of three pixels, 20 degrees from the zenith, 20 000 times as bright."""
    picture = np.full((512, 1024, 3), 0.5, np.float32)
    picture[56:58, 300:303] = 1e4
    path = folder / "sunny.exr"
    write_image(path, picture)
    return ImageEnvironment(path)


def built(scene: Scene, guided: bool = True) -> tuple[SceneBuilder, object]:
    builder = SceneBuilder(scene)
    if guided:
        balance_emitters(builder)
    return builder, builder.build()


def direct(scene: object, at: tuple[float, float, float], n: int, seed: int = 0) -> np.ndarray:
    """n estimates of direct irradiance, green, on a floor at a point."""
    return irradiance(scene, facing_up(np.tile(at, (n, 1))), seed, 1)[:, 1]


def form_factor(x: float, z: float) -> float:
    """Of the opening, from a horizontal point below it: corners' parallel rectangles, added with their signs."""

    def corner(a: float, b: float) -> float:
        a, b = a / HIGH, b / HIGH
        s, t = np.hypot(1, a), np.hypot(1, b)
        return float((a / s * np.arctan(b / s) + b / t * np.arctan(a / t)) / (2 * np.pi))

    x0, x1, z0, z1 = -HALF - x, HALF - x, -HALF - z, HALF - z
    return corner(x1, z1) - corner(x0, z1) - corner(x1, z0) + corner(x0, z0)


def test_alias_tables_keep_the_shares() -> None:
    shares = np.random.default_rng(0).random((5, 16)) ** 4
    shares /= shares.sum(axis=1, keepdims=True)
    keep, other = alias_tables(shares)
    found = keep.astype(float)
    for row in range(5):
        np.add.at(found[row], other[row].astype(int), 1 - keep[row].astype(float))
    assert found / 16 == pytest.approx(shares, abs=1e-6)


def test_directions_have_the_density_that_is_told(tmp_path: Path) -> None:
    engine()
    bins = SkyBins(mi.load_dict(environment_dict(sunny(tmp_path))))
    number = int(np.argmax(bins.luminance))
    n = 1 << 18
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(1, n)
    w = bins.direction(mi.UInt32(number) + dr.zeros(mi.UInt32, n), sampler.next_2d())
    found, density = bins.find(w)
    assert np.array(dr.norm(w)) == pytest.approx(1, abs=1e-5)
    assert (np.array(found) == number).mean() > 0.9999
    assert np.mean(1 / np.array(density)) == pytest.approx(4 * np.pi / BINS, rel=0.05), "the bin's solid angle"
    assert np.array(density).max() > BINS / (4 * np.pi) * SUB**2, "the sun's bin is a fine one"
    anywhere = mi.warp.square_to_uniform_sphere(sampler.next_2d())
    whole = np.array(bins.find(anywhere)[1])
    spread = whole.std() / np.sqrt(n)
    assert whole.mean() * 4 * np.pi == pytest.approx(BINS, abs=5 * spread * 4 * np.pi), "1 in each bin"


@pytest.fixture(scope="module")
def lit_pit() -> tuple[SceneBuilder, object]:
    engine()
    return built(pit(ConstantEnvironment((1.0, 1.0, 1.0))))


@pytest.mark.parametrize("x", [0.0, 0.4, 1.5])
def test_window_lights_as_its_form_factor(lit_pit: tuple[SceneBuilder, object], x: float) -> None:
    values = direct(lit_pit[1], (x, 0.0, -x / 2), 1 << 15)
    error = values.std() / np.sqrt(len(values))
    wanted = np.pi * form_factor(x, -x / 2)
    assert values.mean() == pytest.approx(wanted, abs=4 * error) and error < 0.05 * wanted


@pytest.mark.long
def test_window_is_sampled_with_a_fraction_of_the_variance(lit_pit: tuple[SceneBuilder, object]) -> None:
    plain = built(pit(ConstantEnvironment((1.0, 1.0, 1.0))), guided=False)[1]
    variances = [direct(scene, (0.4, 0.0, 0.3), 1 << 15).var() for scene in (lit_pit[1], plain)]
    assert variances[0] < 0.15 * variances[1]


@pytest.mark.long
def test_small_bright_sun_is_neither_lost_nor_an_explosion(tmp_path: Path) -> None:
    scene = pit(sunny(tmp_path))
    guided, plain = built(scene)[1], built(scene, guided=False)[1]
    for at in ((0.0, 0.0, 0.0), (0.66, 0.0, 0.2)):
        ours, theirs = direct(guided, at, 1 << 16), direct(plain, at, 1 << 16, seed=1)
        error = np.hypot(ours.std(), theirs.std()) / 256
        assert abs(ours.mean() - theirs.mean()) < 4 * error
        assert ours.var() < 2 * theirs.var(), at


def test_sampling_follows_the_density_at_a_surface(lit_pit: tuple[SceneBuilder, object]) -> None:
    sky = lit_pit[0].emitters()[-1]
    n = 1 << 18
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(2, n)
    it = dr.zeros(mi.Interaction3f, n)
    it.p, it.n = mi.Point3f(0.4, 0, 0.3) + dr.zeros(mi.Point3f, n), mi.Normal3f(0, 1, 0) + dr.zeros(mi.Normal3f, n)
    ds, _ = sky.sample_direction(it, sampler.next_2d())
    assert np.allclose(np.array(ds.pdf), np.array(sky.pdf_direction(it, ds)), rtol=1e-4)
    number, _ = sky.guide.bins.find(ds.d)
    table = int(np.array(sky.guide.table_at(it.p, it.n))[0])
    expected = sky.guide.shares[table] * n
    counts = np.bincount(np.array(number), minlength=BINS)
    large = expected > 10
    statistic = ((counts - expected)[large] ** 2 / expected[large]).sum()
    statistic += (counts[~large].sum() - expected[~large].sum()) ** 2 / max(expected[~large].sum(), 1)
    assert chi2.sf(statistic, large.sum()) > 1e-4


def test_open_scenes_have_no_guide() -> None:
    builder, _ = built(replace(plane(), environment=ConstantEnvironment((1.0, 1.0, 1.0))))
    assert type(builder.emitters()[-1]).__name__ != "GuidedSky"


def test_what_is_learnt_is_the_same_every_time(lit_pit: tuple[SceneBuilder, object]) -> None:
    again = built(pit(ConstantEnvironment((1.0, 1.0, 1.0))))[0].emitters()[-1].guide
    assert np.array_equal(again.shares, lit_pit[0].emitters()[-1].guide.shares)
