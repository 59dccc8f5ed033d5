"""False colour: what a colour means, which numbers the scale bears, and parity with the shader."""

import math

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.light.false_colour import STOPS, Range, SignedRange, false_colour, fitting_range, number, with_scale
from lambent.core.light.photometry import photometric


def test_white_of_one_watt_is_179_candela():
    assert photometric(np.ones(3)) == pytest.approx(179)
    assert photometric(np.array([0.0, 1.0, 0.0])) == pytest.approx(179 * 0.7152)


@pytest.mark.parametrize(("scale", "middle"), [(Range(1, 100), 10.0), (Range(0, 100, log=False), 50.0)])
def test_the_scale_runs_from_low_to_high(scale, middle):
    colours = false_colour(np.array([scale.low, middle, scale.high]), scale)
    np.testing.assert_allclose(colours, [STOPS[0], STOPS[4], STOPS[-1]])
    out = false_colour(np.array([scale.low - 0.1, 2 * scale.high]), scale)
    np.testing.assert_array_equal(out, [[0, 0, 0], [1, 1, 1]])


def test_a_range_fits_the_picture():
    values = np.logspace(0, 2, 10_000)
    assert fitting_range(values) == Range(1.0, 100.0)
    assert fitting_range(values, log=False) == Range(0.0, 100.0, log=False)
    wide = fitting_range(np.logspace(-6, 3, 10_000))
    assert wide.high / wide.low <= 2e3, "dark corners do not stretch the scale"
    for odd in (np.zeros(4), np.full(4, np.nan), np.full(4, 3.0)):
        fitting_range(odd).check()


@pytest.mark.parametrize("scale", [Range(0, 1), Range(5, 5), Range(9, 1), Range(math.nan, 1), Range(1, math.inf)])
def test_impossible_ranges_are_refused(scale):
    with pytest.raises(UserError, match="luminance range"):
        scale.check()


def test_the_bar_stands_at_the_right_and_the_rest_is_kept():
    picture = np.full((200, 300, 3), 90, np.uint8)
    seen = with_scale(picture, Range(1, 100))
    assert (seen[:, :200] == 90).all() and seen.shape == picture.shape
    reds = (np.abs(seen[:, 200:].astype(int) - 255 * STOPS[-1]) < 12).all(axis=-1)
    blues = (np.abs(seen[:, 200:].astype(int) - 255 * STOPS[1]) < 12).all(axis=-1)
    assert 0 < np.argwhere(reds)[:, 0].mean() < np.argwhere(blues)[:, 0].mean()
    assert with_scale(picture[:20, :20], Range(1, 100)).shape == (20, 20, 3)


def test_differences_have_a_scale_with_black_in_the_middle():
    scale = SignedRange.fitting(np.array([-30.0, 2.0, np.nan, 41.0]))
    assert (scale.low, scale.high) == (-50.0, 50.0) and SignedRange.fitting(np.zeros(3)).high > 0
    dark, same, bright = false_colour(np.array([-80.0, 0.0, 80.0]), scale)
    assert same.max() < 0.1 and dark[2] > 0.9 > dark[0] and bright[0] > 0.9 > bright[2]
    assert scale.marks() == [-40.0, -20.0, 0.0, 20.0, 40.0] and SignedRange(10.0).marks()[0] == -10.0
    assert [number(value) for value in (-20, -0.5)] == ["-20", "-0.5"]
    picture = with_scale(np.zeros((300, 200, 3), np.uint8), scale)
    assert picture[40:, 100:, 2].max() > 200 and picture[40:, 100:, 0].max() > 200
