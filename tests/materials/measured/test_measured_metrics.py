from __future__ import annotations

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.measured.inspecting.metrics import METRICS, errors_of, metric_named
from lambent.materials.measured.protocol import LeftOut, MeasuredSamples, TableInfo

INFO = TableInfo("by hand", "test", False, False, 1, "f")


def two_tuples() -> MeasuredSamples:
    """wi at 60 and 0 degrees, wo at 30 and 60 degrees; f 2 and 0.5; weights sin(theta_o)."""
    theta_i, theta_o = np.radians([60.0, 0.0]), np.radians([30.0, 60.0])
    f = np.array([[2.0], [0.5]])
    return MeasuredSamples(direction(theta_i, 0.0), direction(theta_o, 1.0), f, np.sin(theta_o), LeftOut(), INFO)


MODEL = np.array([[1.0], [1.5]])
SIN_O, COS_O, COS_I = (0.5, 0.8660254), (0.8660254, 0.5), (0.5, 1.0)


def test_l1_is_equation_3_7():
    by_hand = (SIN_O[0] * COS_I[0] * COS_O[0] * 1.0 + SIN_O[1] * COS_I[1] * COS_O[1] * 1.0) / sum(SIN_O)
    assert METRICS["l1"].error(two_tuples(), MODEL) == pytest.approx(by_hand, rel=1e-6)


def test_l2_is_cosine_weighted():
    by_hand = np.sqrt((SIN_O[0] * COS_I[0] ** 2 + SIN_O[1] * COS_I[1] ** 2) / sum(SIN_O))
    assert METRICS["l2_ngan"].error(two_tuples(), MODEL) == pytest.approx(by_hand, rel=1e-6)


def test_cuberoot():
    roots = [(c * f + 1e-5) ** (1 / 3) for c, f in zip(COS_I * 2, (2.0, 0.5, 1.0, 1.5), strict=True)]
    squares = (roots[0] - roots[2]) ** 2, (roots[1] - roots[3]) ** 2
    by_hand = np.sqrt((SIN_O[0] * squares[0] + SIN_O[1] * squares[1]) / sum(SIN_O))
    assert METRICS["cuberoot"].error(two_tuples(), MODEL) == pytest.approx(by_hand, rel=1e-6)


def test_log():
    squares = np.log(2.0 / 1.5) ** 2, np.log(1.5 / 2.5) ** 2
    by_hand = np.sqrt((SIN_O[0] * squares[0] + SIN_O[1] * squares[1]) / sum(SIN_O))
    assert METRICS["log"].error(two_tuples(), MODEL) == pytest.approx(by_hand, rel=1e-6)


@pytest.mark.parametrize("name", METRICS)
def test_slope_is_the_derivative_of_the_transform(name):
    x, step = np.array([1e-3, 0.1, 3.0]), 1e-7
    metric = METRICS[name]
    numeric = (metric.transform(x + step) - metric.transform(x - step)) / (2 * step)
    np.testing.assert_allclose(metric.slope(x), numeric, rtol=1e-5)


def test_no_error_for_the_measurement_itself():
    assert set(errors_of(two_tuples(), two_tuples().f).values()) == {0.0}


def test_unknown_metric_names_the_nearest():
    with pytest.raises(UserError, match="did you mean 'cuberoot'"):
        metric_named("cuberot")
