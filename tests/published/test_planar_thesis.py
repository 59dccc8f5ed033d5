"""The thesis's estimate on planar reflectors: right where lobes are sharp or light is uniform; its pattern."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.materials.document import Lobe
from lambent.published.planar_thesis import multi_ring_table, offered
from lambent.realtime.light.baked import Probe
from lambent.realtime.planar.planar_integrators import PLANAR
from lambent.realtime.renderer import Renderer
from tests.realtime.planar.test_realtime_planar import HEIGHT, mirror, scene_of, state


@pytest.mark.long
def test_a_sharp_mirror_is_as_in_motion(device: Any) -> None:
    renderer = Renderer(device, scene_of(mirror(0.001)))
    ours = renderer.image(state(n=3))
    with offered():
        found = renderer.image(state(n=3, integrator="lobe-4.25"))
    difference = np.abs(found - ours).max(axis=-1)
    assert np.median(difference) < 0.01 and (difference < 0.1).mean() > 0.93
    assert "lobe-4.25" not in PLANAR and np.abs(renderer.image(state(n=3, integrator="lobe-4.25")) - ours).max() > 0.5


@pytest.mark.parametrize(("m", "most"), [(0.05, 1.01), (0.2, 1.2)])
def test_uniform_light_stays_uniform(device: Any, m: float, most: float) -> None:
    """Of a rough lobe many samples lie beyond the buffer; what they add may be too much, as published."""
    scene = scene_of(mirror(m))
    record = scene.record.model_copy(update={"objects": scene.record.objects[-1:]})
    sky = np.ones((6, 4, 4, 3), np.float32)
    renderer = Renderer(device, replace(scene, record=record, environment=sky, probes={"floor": Probe((0, 0, 0), sky)}))
    with offered():
        image = renderer.image(state(n=7, integrator="lobe-4.25"))[HEIGHT // 2 :]
    assert image.min() > 0.96 and image.max() < most


def test_multi_rings_of_ten_are_three_of_three() -> None:
    rows = multi_ring_table(Lobe(mx=0.1, my=0.1), 10)
    r = np.hypot(rows[:, 0], rows[:, 1]) / 0.1
    assert sorted({round(float(x), 3) for x in r}) == pytest.approx([0, *sorted(set(r.round(3)))[1:]])
    assert [int((np.abs(r - x) < 1e-3).sum()) for x in np.unique(r.round(3))] == [1, 3, 3, 3]
    assert r.max() < np.sqrt(-np.log(0.01))
