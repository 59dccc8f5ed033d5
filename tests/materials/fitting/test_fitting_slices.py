"""Slices of the error around a fit have their minimum at the known lobe."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.shown.plot import error_slices
from lambent.materials.fitting.shown.slices import slices
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.measured.inspecting.synthetic import ANISOTROPIC
from tests.materials.fitting.known_answers import FEW, FOIL, PAINT, grey

COARSE = replace(ANISOTROPIC, theta_i_deg=(5, 35, 65), phi_i_deg=(0, 45, 90), step_deg=6, fine_deg=3, noise=0, floor=0)
BRUSHED = Material(name="brushed", kd=0.05, lobes=(Lobe(k=0.8, mx=0.1, my=0.3, r0=0.6, alpha=0.4),))


@pytest.mark.parametrize("metric", METRICS)
def test_the_minimum_is_at_the_known_lobe(metric):
    samples = grey(BRUSHED, COARSE)
    for one in slices(samples, BRUSHED, 0, METRICS[metric], steps=17):
        lowest = np.unravel_index(one.error.argmin(), one.error.shape)
        steps = np.abs(np.log(one.x / one.best[0])), np.abs(one.y - one.best[1])
        assert abs(lowest[1] - int(steps[0].argmin())) <= 1
        assert abs(lowest[0] - int(steps[1].argmin())) <= 2
        assert one.error.min() < 0.2 * np.median(one.error)


def test_isotropic_tables_move_both_roughnesses_at_once():
    first, second = slices(grey(PAINT, FEW), PAINT, 0, METRICS["cuberoot"], steps=5)
    assert (first.across, first.down, second.across, second.down) == ("m", "alpha", "r0", "alpha")


def test_slices_of_a_transmission_lobe_omit_r0():
    first, second = slices(grey(FOIL, COARSE), FOIL, 1, METRICS["cuberoot"], steps=5)
    assert (first.across, first.down, second.across, second.down) == ("mx", "my", "mx", "alpha")


def test_error_at_the_fit_is_the_fits_error():
    """At the optimum, a slice has the metric's error of the material (k is solved again)."""
    samples = grey(FOIL, COARSE)
    metric = METRICS["l1"]
    whole = metric.error(samples, MaterialBSDF(FOIL).eval(samples.wi, samples.wo)[:, :1])
    for index in range(2):
        for one in slices(samples, FOIL, index, metric, steps=9):
            assert 0 <= one.error.min() < 0.02 + whole


def test_slices_are_drawn(tmp_path):
    metric = METRICS["cuberoot"]
    drawn = slices(grey(BRUSHED, COARSE), BRUSHED, 0, metric, steps=7)
    figure = error_slices(drawn, metric, "lobe 1")
    figure.savefig(tmp_path / "slices.png")
    assert len(figure.axes) == 4  # two panels, two colour bars
    assert (tmp_path / "slices.png").stat().st_size > 10_000
