"""Illuminance of daylight against published clear-sky models, the sun's radius, and the ground."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.core.geometry.directions import normalize
from lambent.core.light.colour import luminance
from lambent.core.light.photometry import photometric
from lambent.scenes.scene import SunSky
from lambent.scenes.sky.clear_sky import air_mass, cie_clear_sky, efficacies, esra, kittler_sun

HEIGHTS_DEG, TURBIDITIES = (10.0, 20.0, 45.0, 70.0), (2.0, 4.0, 6.0)


def daylight(height_deg: float, turbidity: float, **more: Any) -> SunSky:
    height = np.radians(height_deg)
    return SunSky((float(np.cos(height)), float(np.sin(height)), 0.0), turbidity=turbidity, **more)


def spiral(count: int) -> np.ndarray:
    """Directions (count, 3) of equal solid angles over the upper half."""
    y = (np.arange(count) + 0.5) / count
    around = np.pi * (1 + 5**0.5) * np.arange(count)
    across = np.sqrt(1 - y**2)
    return np.stack([across * np.cos(around), y, across * np.sin(around)], axis=-1)


def klx(sky: SunSky) -> tuple[float, float, float]:
    """Of the sun facing it; of the sky on level ground and on a surface that faces the sun."""
    from lambent.baking.sky.daylight import sun_disc, sunsky_radiance

    w = spiral(4000)
    light = photometric(sunsky_radiance(sky, w, sun=False)) * 2 * np.pi / 1000
    facing = np.maximum(w @ sky.sun_direction, 0)
    return photometric(sun_disc(sky).irradiance) / 1000, (light * w[:, 1]).mean(), (light * facing).mean()


@pytest.mark.parametrize("height_deg", HEIGHTS_DEG)
@pytest.mark.parametrize("turbidity", TURBIDITIES)
def test_level_and_facing_the_sun_it_is_as_bright_as_published_models_say(
    mi: Any, height_deg: float, turbidity: float
) -> None:
    """ESRA by the efficacies of Perez, and Kittler's sun with the CIE clear sky; within 15 %."""
    sine = np.sin(np.radians(height_deg))
    sun, sky, sky_facing = klx(daylight(height_deg, turbidity))
    tilt = sky_facing / sky  # the shape of the sky is not in question here
    beam, diffuse = esra(height_deg, turbidity)
    of_beam, of_sky = efficacies(height_deg, beam, diffuse)
    for sun_there, sky_there in (
        (beam * of_beam, diffuse * of_sky),
        (kittler_sun(height_deg, turbidity), cie_clear_sky(height_deg, turbidity)),
    ):
        assert sun * sine + sky == pytest.approx((sun_there * sine + sky_there) / 1000, rel=0.15)
        assert sun + sky_facing == pytest.approx((sun_there + tilt * sky_there) / 1000, rel=0.15)


@pytest.mark.parametrize("height_deg", (20.0, 45.0, 70.0))
def test_a_usual_clear_sky_is_that_of_the_ies(mi: Any, height_deg: float) -> None:
    """IES RP-21 (1984), which knows no turbidity: 127.5 exp(-.21/sin h) and .8 + 15.5 sqrt(sin h) klx."""
    sine = np.sin(np.radians(height_deg))
    sun, sky, _ = klx(daylight(height_deg, 2.5))
    assert sun * sine + sky == pytest.approx(127.5 * np.exp(-0.21 / sine) * sine + 0.8 + 15.5 * sine**0.5, rel=0.15)


def test_the_models_are_those_that_were_published() -> None:
    """Efficacies by gendaylit 2.5, air mass by Kasten & Young's table."""
    assert air_mass(10) == pytest.approx(5.5841, rel=1e-3) and air_mass(90) == pytest.approx(1, abs=1e-3)
    for height_deg, turbidity, expected in ((10, 2, (81.2, 162.1)), (45, 3, (102.8, 139.0)), (20, 6, (82.7, 127.3))):
        assert efficacies(height_deg, *esra(height_deg, turbidity)) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("radius_deg", (0.2679, 3.0))
def test_the_sun_gives_the_same_light_whatever_its_radius(mi: Any, radius_deg: float) -> None:
    from lambent.baking.sky.daylight import HEIGHT, WIDTH, sky_image, sun_disc

    sky = daylight(40.0, 3.0, sun_radius_deg=radius_deg)
    disc = sun_disc(sky)
    assert disc.irradiance == pytest.approx(sun_disc(daylight(40.0, 3.0)).irradiance)
    image = sky_image(sky) - sky_image(replace(sky, sun_scale=0.0))
    theta = np.arange(HEIGHT) * np.pi / (HEIGHT - 1)
    phi = (np.arange(WIDTH) + 0.5) * 2 * np.pi / WIDTH
    facing = np.cos(theta)[:, None] * disc.direction[1] - np.sin(theta)[:, None] * np.sin(phi) * disc.direction[0]
    weight = np.sin(theta)[:, None] * (np.pi / (HEIGHT - 1)) * (2 * np.pi / WIDTH) * (facing > 0.9)
    light = luminance(image.astype(float)) * weight
    assert (light * facing).sum() == pytest.approx(luminance(disc.irradiance), rel=0.02)
    spread = np.degrees(np.sqrt(2 * (light * (1 - facing)).sum() / light.sum()))
    darkened = np.sqrt((1 / 2 - 0.6 * (1 / 2 - 4 / 15)) / (1 - 0.6 / 3))  # rms radius of the disc, over its radius
    assert spread == pytest.approx(darkened * radius_deg, rel=0.12)


def test_the_ground_can_be_black(mi: Any) -> None:
    from lambent.baking.sky.daylight import HEIGHT, sky_image

    lit, black = (sky_image(daylight(40.0, 3.0, ground=ground)) for ground in ("diffuse", "black"))
    assert lit[HEIGHT // 2 + 1 :].min() > 0 and not black[HEIGHT // 2 + 1 :].any()
    assert np.array_equal(lit[: HEIGHT // 2], black[: HEIGHT // 2])


def test_a_sun_on_the_horizon_and_one_overhead_are_finite(mi: Any) -> None:
    from lambent.baking.sky.daylight import sun_disc, sunsky_radiance

    w = normalize(np.array([[1.0, 0.001, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.3, 0.0]]))
    for height_deg, turbidity in ((0.0, 1.0), (0.0, 10.0), (90.0, 10.0), (1.0, 3.0)):
        sky = daylight(height_deg, turbidity)
        assert np.isfinite(sun_disc(sky).irradiance).all() and (sun_disc(sky).irradiance >= 0).all()
        assert np.isfinite(sunsky_radiance(sky, w)).all()
