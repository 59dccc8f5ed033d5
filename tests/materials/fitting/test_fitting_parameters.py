from __future__ import annotations

import pytest

from lambent.core.errors import UserError
from lambent.materials.fitting.parameters import check, parse_fix, parse_ranges


def test_options_are_read():
    assert parse_fix(["mx=.1", "kd=.1,.2,.3"]) == {"mx": 0.1, "kd": (0.1, 0.2, 0.3)}
    assert parse_ranges(["alpha=0:.5"]) == {"alpha": (0.0, 0.5)}


@pytest.mark.parametrize("option", ["mx", "=1", "mx=", "mx=rough", "kd=1,2"])
def test_bad_fix_options(option):
    with pytest.raises(UserError):
        parse_fix([option])


@pytest.mark.parametrize("option", ["mx=.1", "mx=.1:.2:.3", "mx=a:b"])
def test_bad_range_options(option):
    with pytest.raises(UserError):
        parse_ranges([option])


@pytest.mark.parametrize(
    ("fix", "ranges", "says"),
    [
        ({"alhpa": 0.5}, {}, "did you mean 'alpha'"),
        ({"mx_2": 0.5}, {}, "unknown parameter"),
        ({"alpha": 1.5}, {}, "out of bounds"),
        ({"mx": float("nan")}, {}, "out of bounds"),
        ({}, {"r0": (0.5, 0.5)}, "empty range"),
        ({}, {"kd": (0.0, 0.5)}, "no range"),
        ({"mx": 0.1}, {"mx": (0.1, 0.2)}, "both fixed"),
    ],
)
def test_impossible_restrictions(fix, ranges, says):
    with pytest.raises(UserError, match=says):
        check(fix, ranges, lobes=1)


def test_numbered_lobes_are_known():
    check({"mx_2": 0.1, "t_alpha_2": 0.3}, {"ks_2": (0.0, 0.5)}, lobes=2)
