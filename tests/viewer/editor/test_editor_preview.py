"""The light of the editor's preview: every environment as bright as the others, and a lamp in proportion."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.core.geometry.cubemap import texel_solid_angles
from lambent.core.pictures.images import write_image
from lambent.materials.document import Material
from lambent.viewer.modes.material.preview import CAMERA, LAMP_SHARE, MEAN_RADIANCE, SHAPES, Preview, with_lamp

SKY = np.linspace(3.0, 0.1, 64)[:, None, None] * np.array([1.0, 0.8, 0.5]) * np.ones((1, 128, 1))


def sky_file(folder: Path, scale: float) -> Path:
    path = folder / f"sky-{scale:g}.exr"
    write_image(path, (scale * SKY).astype(np.float32))
    return path


def mean(cube: np.ndarray) -> float:
    """Luminance, over the sphere."""
    weight = texel_solid_angles(cube.shape[1])[..., None] * np.array([0.2126, 0.7152, 0.0722])
    return float((cube * weight).sum() / (4 * np.pi))


@pytest.mark.long
def test_an_environment_is_scaled_to_one_mean_radiance(tmp_path: Path) -> None:
    preview = Preview()
    dim, bright = (preview.light(preview.add(sky_file(tmp_path, scale))) for scale in (0.01, 1000.0))
    assert mean(dim) == pytest.approx(MEAN_RADIANCE, rel=1e-3)
    np.testing.assert_allclose(dim, bright, rtol=2e-3)


@pytest.mark.parametrize("name", Preview().environments)
def test_the_lamp_adds_its_share_of_the_light(name: str) -> None:
    """What the lamp covers is lost, a few thousandths."""
    cube = Preview().light(name)
    assert mean(with_lamp(cube)) / mean(cube) == pytest.approx(1 + LAMP_SHARE, abs=0.02)


def test_the_lamp_is_in_proportion_to_the_environment() -> None:
    cube = Preview().light("studio")
    np.testing.assert_allclose(with_lamp(5 * cube), 5 * with_lamp(cube), rtol=1e-5)


def test_a_picture_is_in_proportion_to_its_light(adapter: None) -> None:
    from lambent.realtime.frame_state import FrameState
    from lambent.realtime.gpu.device import open_device
    from lambent.realtime.objects.unbaked import unbaked_scene, with_diffuse_light
    from lambent.realtime.renderer import Renderer

    device: Any = open_device()
    paper, light = Material(name="paper", kd=0.4, kt_d=0.4), with_lamp(Preview().light("dusk"))
    sheet = SHAPES["sheet before a lamp"]()
    dim, bright = (
        Renderer(device, with_diffuse_light(unbaked_scene({"sheet": sheet}, paper, np.float32(scale) * light))).image(
            FrameState(CAMERA, 32, 32, integrator="diffuse")
        )
        for scale in (1.0, 4.0)
    )
    assert dim[16, 16].mean() > 0.02
    np.testing.assert_allclose(bright, 4 * dim, rtol=5e-3, atol=1e-4)
