"""Exposure: EV100, and metering of pictures whose middle is known."""

import numpy as np
import pytest

from lambent.core.light.exposure import KEY, LIMIT_EV, ev100_of, exposure_of, metered
from lambent.core.light.photometry import LM_PER_W


def test_ev100_is_that_of_photographers():
    """At EV100 15 a sunlit white wall of 32,000 cd/m2 is nearly white; exposure and EV100 are inverse."""
    white = 32_000 / LM_PER_W
    assert 0.7 < white * 2.0 ** exposure_of(15) < 1
    assert ev100_of(exposure_of(9.25)) == pytest.approx(9.25)
    assert exposure_of(10) == pytest.approx(exposure_of(9) - 1)


@pytest.mark.parametrize("grey", [1e-3, 0.5, 60.0])
def test_an_even_picture_becomes_middle_grey(grey):
    assert grey * 2.0 ** metered(np.full((20, 30, 3), grey)) == pytest.approx(KEY)


def test_a_sun_and_black_surroundings_change_nothing():
    rng = np.random.default_rng(0)
    room = np.exp(rng.normal(0, 1, (100, 100, 1))) * np.ones(3)
    alone = metered(room)
    sunny = room.copy()
    sunny[:5, :8] = 7e6
    assert metered(sunny) == pytest.approx(alone, abs=0.05)
    for black in (0.0, 1e-7):
        around = np.full((200, 200, 3), black)
        around[50:150, 50:150] = room
        assert metered(around) == pytest.approx(alone, abs=0.05)
    nan = room.copy()
    nan[3:6] = np.nan
    assert metered(nan) == pytest.approx(alone, abs=0.05)


def test_what_cannot_be_metered():
    assert metered(np.zeros((8, 8, 3))) is None
    assert metered(np.full((8, 8, 3), 1e-9)) == LIMIT_EV and metered(np.full((8, 8, 3), 1e9)) == -LIMIT_EV
