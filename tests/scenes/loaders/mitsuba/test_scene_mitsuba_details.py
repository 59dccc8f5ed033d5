"""Details of Mitsuba's scenes: scales and cones of emitters, channels of pictures, instances in turned scenes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.materials.document import Material
from lambent.scenes import load_scene
from lambent.scenes.scene import SUN_RADIUS_DEG, PointLight, SunSky
from tests.scenes.loaders.mitsuba.test_scene_mitsuba import written
from tests.scenes.loaders.pictures import png

BALL = '<shape type="sphere" id="ball"/>'


@pytest.mark.parametrize(
    ("said", "inner", "outer"),
    [
        ("", 15.0, 20.0),
        ('<float name="cutoff_angle" value="40"/>', 30.0, 40.0),
        ('<float name="cutoff_angle" value="40"/><float name="beam_width" value="10"/>', 10.0, 40.0),
    ],
)
def test_a_spots_beam_is_three_quarters_of_its_cone(tmp_path: Path, said: str, inner: float, outer: float) -> None:
    (lamp,) = load_scene(written(tmp_path, f'<emitter type="spot">{said}</emitter>{BALL}')).lights
    assert isinstance(lamp, PointLight)
    assert (lamp.inner_deg, lamp.outer_deg) == pytest.approx((inner, outer))


@pytest.mark.parametrize(("kind", "sun", "sky"), [("sunsky", 6.0, 15.0), ("sky", 0.0, 15.0), ("sun", 6.0, 0.0)])
def test_daylight_is_scaled_as_a_whole_and_by_parts(tmp_path: Path, kind: str, sun: float, sky: float) -> None:
    body = f"""<emitter type="{kind}"><vector name="sun_direction" value="0, 0.6, 0.8"/><float name="scale" value="3"/>
        <float name="sun_scale" value="2"/><float name="sky_scale" value="5"/><float name="turbidity" value="4"/>
        </emitter>{BALL}"""
    made = load_scene(written(tmp_path, body)).environment
    assert isinstance(made, SunSky)
    assert (made.sun_scale, made.sky_scale, made.turbidity) == pytest.approx((sun, sky, 4))
    assert np.linalg.norm(made.sun_direction) == pytest.approx(1)


@pytest.mark.parametrize(
    ("said", "radius_deg"),
    [
        ("", SUN_RADIUS_DEG),
        ('<float name="sunRadiusScale" value="18.8131"/>', 18.8131 * SUN_RADIUS_DEG),
        ('<float name="sun_aperture" value="2"/>', 1.0),
        ('<float name="sunRadiusScale" value="0"/>', 0.05),
        ('<float name="sun_aperture" value="170"/>', 30.0),
    ],
)
def test_the_suns_radius_is_read(tmp_path: Path, said: str, radius_deg: float) -> None:
    sky = f'<emitter type="sunsky"><vector name="sunDirection" x="0" y="1" z="0"/>{said}</emitter>'
    scene = load_scene(written(tmp_path, sky + BALL))
    assert isinstance(scene.environment, SunSky)
    assert scene.environment.sun_radius_deg == pytest.approx(radius_deg)
    notes = " ".join(scene.warnings)
    assert "ignored: sun" not in notes and "ground of its albedo" in notes
    assert ("sun's radius" in notes) == (radius_deg in (0.05, 30.0))


def test_lamps_beside_a_sky_are_in_its_unit(tmp_path: Path) -> None:
    """Mitsuba's sky is in W/(sr m^2 nm): of equal light, both are as bright as before beside each other."""
    lamp = '<emitter type="point"><rgb name="intensity" value="2"/></emitter>'
    glow = '<shape type="sphere"><emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>'
    sky = '<emitter type="sunsky"><vector name="sunDirection" x="0" y="1" z="0"/></emitter>'
    for more, unit in (("", 1.0), (sky, 683 * 106.856 / 179)):
        scene = load_scene(written(tmp_path, lamp + glow + more + BALL))
        (point,) = scene.lights
        assert isinstance(point, PointLight) and point.intensity == pytest.approx((2 * unit,) * 3)
        assert max(o.emission for o in scene.objects) == pytest.approx((unit,) * 3)
        assert ("in the unit of its sky" in " ".join(scene.warnings)) == bool(more)


@pytest.mark.parametrize(("channel", "byte"), [("r", 40), ("g", 120), ("b", 200), ("a", 90)])
def test_one_channel_of_a_bitmap(tmp_path: Path, channel: str, byte: int) -> None:
    png(tmp_path / "four.png", np.full((2, 2, 4), (40, 120, 200, 90)))
    body = f"""<shape type="rectangle"><bsdf type="diffuse" id="m"><texture type="bitmap" name="reflectance">
        <string name="filename" value="four.png"/><boolean name="raw" value="true"/>
        <string name="channel" value="{channel}"/></texture></bsdf></shape>"""
    kd = load_scene(written(tmp_path, body)).materials["m"].kd
    assert kd == pytest.approx((byte / 255,) * 3, rel=2e-3)


def test_parameters_of_principled_are_kept_within_their_ranges(tmp_path: Path) -> None:
    def mirror(metallic: float, roughness: float) -> Material:
        made = f"""<bsdf type="principled" id="m"><rgb name="base_color" value="1 .5 .2"/>
            <float name="metallic" value="{metallic}"/><float name="roughness" value="{roughness}"/></bsdf>"""
        return load_scene(written(tmp_path, f'{made}<shape type="sphere"><ref id="m"/></shape>')).materials["m"]

    assert mirror(2.0, 3.0) == mirror(1.0, 1.0) and mirror(-1.0, -2.0) == mirror(0.0, 0.0)
