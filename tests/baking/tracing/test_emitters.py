"""Emitters are chosen by what they bring."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from lambent.baking.reference.path_traced import render_reference
from lambent.baking.tracing.lights.emitters import FLOOR, balance_emitters
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.pictures.images import write_image
from lambent.core.views.camera import Camera
from lambent.scenes.scene import ConstantEnvironment, ImageEnvironment, PointLight, Scene
from tests.baking.small_scenes import GREY, plane


def lit_plane(*intensities: float) -> Scene:
    lights = tuple(PointLight((x, 1.0, 0.0), (i, i, i)) for x, i in enumerate(intensities))
    return replace(plane(), lights=lights, materials={"black": GREY})


def weights(scene: Scene) -> np.ndarray:
    builder = SceneBuilder(scene)
    balance_emitters(builder)
    return np.array([float(mi.traverse(e)["sampling_weight"]) for e in builder.emitters()])


def test_the_stronger_light_is_chosen_more_often_and_none_never() -> None:
    weak, strong = weights(lit_plane(0.0, 10.0))
    assert weak == pytest.approx(FLOOR) and strong == pytest.approx(2 + FLOOR)
    first, second = weights(lit_plane(1.0, 1.0))
    assert 1 < first / second < 3, "the one over the middle lights more of the plane"


def test_the_picture_keeps_its_mean() -> None:
    camera = Camera("c", (0, 2, 0.1), (0, 0, 0))
    both, variance = render_reference(lit_plane(0.2, 10.0), camera, 16, 16, 256)
    alone = [render_reference(lit_plane(*pair), camera, 16, 16, 64)[0] for pair in ((0.2, 0.0), (0.0, 10.0))]
    assert both.mean() == pytest.approx(
        (alone[0] + alone[1]).mean(), abs=5 * float(variance.mean() / variance.size) ** 0.5
    )


def test_a_black_environment_takes_no_light_from_the_others(tmp_path: Path) -> None:
    """Its densities are not finite: one in so many choices of an emitter was lost."""
    lit, camera = lit_plane(10.0), Camera("c", (0, 2, 0.1), (0, 0, 0))
    write_image(tmp_path / "black.exr", np.zeros((8, 16, 3), np.float32))
    write_image(tmp_path / "grey.exr", np.ones((8, 16, 3), np.float32))
    expected = render_reference(lit, camera, 8, 8, 16)[0]
    assert expected.min() > 0
    for black in (
        ConstantEnvironment((0.0, 0.0, 0.0)),
        ImageEnvironment(tmp_path / "black.exr"),
        ImageEnvironment(tmp_path / "grey.exr", scale=0.0),
    ):
        np.testing.assert_array_equal(render_reference(replace(lit, environment=black), camera, 8, 8, 16)[0], expected)


def test_a_scene_without_light_is_black() -> None:
    dark = replace(plane(), environment=ConstantEnvironment((0.0, 0.0, 0.0)))
    assert not render_reference(dark, Camera("c", (0, 2, 0.1), (0, 0, 0)), 8, 8, 4)[0].any()
