from __future__ import annotations

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.measured.inspecting.metrics import METRICS, metric_named
from lambent.materials.measured.protocol import LeftOut, MeasuredSamples, TableInfo

INFO = TableInfo("by hand", "test", False, False, 1, "f")


def two_tuples() -> MeasuredSamples:
    """wi at 60 and 0 degrees, wo at 30 and 60 degrees; f 2 and 0.5; weights sin(theta_o)."""
    theta_i, theta_o = np.radians([60.0, 0.0]), np.radians([30.0, 60.0])
    f = np.array([[2.0], [0.5]])
    return MeasuredSamples(direction(theta_i, 0.0), direction(theta_o, 1.0), f, np.sin(theta_o), LeftOut(), INFO)


MODEL = np.array([[1.0], [1.5]])
SIN_O, COS_O, COS_I = (0.5, 0.8660254), (0.8660254, 0.5), (0.5, 1.0)


def mean(values, power=1.0):
    return (sum(weight * value for weight, value in zip(SIN_O, values, strict=True)) / sum(SIN_O)) ** power


ROOTS = [(c * f + 1e-5) ** (1 / 3) for c, f in zip(COS_I * 2, (2.0, 0.5, 1.0, 1.5), strict=True)]
BY_HAND = {
    "l1": mean((COS_I[0] * COS_O[0], COS_I[1] * COS_O[1])),  # equation 3.7
    "l2_ngan": mean((COS_I[0] ** 2, COS_I[1] ** 2), 0.5),
    "cuberoot": mean(((ROOTS[0] - ROOTS[2]) ** 2, (ROOTS[1] - ROOTS[3]) ** 2), 0.5),
    "log": mean((np.log(2.0 / 1.5) ** 2, np.log(1.5 / 2.5) ** 2), 0.5),
}


@pytest.mark.parametrize("name", METRICS)
def test_errors_by_hand(name):
    assert METRICS[name].error(two_tuples(), MODEL) == pytest.approx(BY_HAND[name], rel=1e-6)


@pytest.mark.parametrize("name", METRICS)
def test_slope_is_the_derivative_of_the_transform(name):
    x, step = np.array([1e-3, 0.1, 3.0]), 1e-7
    metric = METRICS[name]
    numeric = (metric.transform(x + step) - metric.transform(x - step)) / (2 * step)
    np.testing.assert_allclose(metric.slope(x), numeric, rtol=1e-5)


def test_unknown_metric_names_the_nearest():
    with pytest.raises(UserError, match="did you mean 'cuberoot'"):
        metric_named("cuberot")
