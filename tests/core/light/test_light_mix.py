"""Mixes of light groups: factors, colours of black bodies, tracks over time, and how they are written."""

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.light.colour import luminance, rgb_to_xyz
from lambent.core.light.light_mix import (
    AS_BAKED,
    GroupMix,
    LightMix,
    MixTrack,
    black_body,
    nearest_temperature_k,
    parse_light,
)


@pytest.mark.parametrize(
    ("kelvin", "x", "y"), [(2856, 0.4476, 0.4074), (6504, 0.3135, 0.3236), (25000, 0.2525, 0.2522)]
)
def test_black_bodies_have_the_chromaticity_of_the_planckian_locus(kelvin, x, y):
    xyz = rgb_to_xyz(black_body(kelvin))
    assert xyz[:2] / xyz.sum() == pytest.approx((x, y), abs=1e-4)
    assert luminance(black_body(kelvin)) == pytest.approx(1)


def test_factors_dim_and_tint_and_keep_luminance():
    assert AS_BAKED.factor == (1, 1, 1)
    assert GroupMix(on=False, intensity=3).factor == (0, 0, 0)
    assert GroupMix(intensity=0.25).factor == pytest.approx((0.25,) * 3)
    warm = np.array(GroupMix(intensity=2, temperature_k=2700).factor)
    assert warm[0] > warm[1] > warm[2] and luminance(warm) == pytest.approx(2)
    dark_red, red = GroupMix(colour=(0.1, 0, 0)).factor, GroupMix(colour=(1, 0, 0)).factor
    assert dark_red == pytest.approx(red) and red[1:] == (0, 0)


def test_light_is_parsed_as_written():
    track = parse_light(["lamp=off", "desk lamp=0.3,2700K", "a=b=#ff0000", "sky=on,2"])
    mixes = {name: keys[0][1] for name, keys in track.groups.items()}
    assert mixes["lamp"] == GroupMix(on=False)
    assert mixes["desk lamp"] == GroupMix(intensity=0.3, temperature_k=2700)
    assert mixes["a=b"] == GroupMix(colour=(1, 0, 0)) and mixes["sky"] == GroupMix(intensity=2)
    assert all(keys[0][0] == 0 for keys in track.groups.values())


def test_tracks_change_evenly_between_the_times_of_each_group():
    track = parse_light(["lamp=0@2", "lamp=1@4", "sky=0.5@3"])
    assert track.factors_at(0)["lamp"] == (0, 0, 0), "the first holds before its time"
    assert track.factors_at(2.5)["lamp"] == pytest.approx((0.25,) * 3)
    assert "lamp" not in track.factors_at(9) and track.factors_at(9)["sky"] == pytest.approx((0.5,) * 3)
    assert MixTrack.of(LightMix({"lamp": GroupMix(intensity=2)})).factors_at(7)["lamp"] == pytest.approx((2,) * 3)


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["lamp"], "no light setting"), (["=0.5"], "no light setting"), (["lamp="], "no light setting"),
        (["lamp=bright"], "no light setting"), (["lamp=-1"], "no light setting"), (["lamp=nan"], "no light setting"),
        (["lamp=1e6"], "out of range"), (["lamp=100K"], "temperature is out of range"),
        (["lamp=#000000"], "cannot be black"), (["lamp=0.5,0.6"], "two values for intensity"),
        (["lamp=0.5", "lamp=off"], "a light twice"), (["lamp=1@x"], "no light setting"),
    ],
)  # fmt: skip
def test_what_is_no_light_is_refused_in_one_line(texts, message):
    with pytest.raises(UserError, match=message):
        parse_light(texts)


@pytest.mark.parametrize("kelvin", [1900, 2700, 4000, 6500, 15000])
def test_the_nearest_temperature_of_a_black_body_is_its_own(kelvin):
    assert nearest_temperature_k(7 * black_body(kelvin)) == pytest.approx(kelvin, rel=0.01)


def test_a_tint_beside_the_locus_has_a_temperature_and_a_colour_has_none():
    assert nearest_temperature_k(np.ones(3)) == pytest.approx(6504, rel=0.01), "D65"
    assert nearest_temperature_k(black_body(3000) * (1, 1.1, 1)) == pytest.approx(3000, rel=0.1)
    for colour in ((1, 0, 1), (0, 1, 0), (0, 0, 0)):
        assert nearest_temperature_k(np.array(colour, float)) is None
