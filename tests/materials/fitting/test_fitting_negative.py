"""Tables with readings below zero are fitted like their clean versions."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.core.geometry.directions import Floats, direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.export import rgl
from lambent.materials.fitting.fit import fit
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.measured.inspecting.synthetic import synthesise
from lambent.materials.measured.parts.tensor_file import read_tensors, tensor_bytes
from lambent.materials.measured.protocol import MeasuredTable
from tests.materials.fitting.known_answers import FEW

FAINT = Lobe(k=(0.6, 0.5, 0.1), mx=0.15, my=0.15, r0=(0.04,) * 3, alpha=0.3)
YELLOW = Material(name="yellow", kd=(0.8, 0.55, 0.0), lobes=(FAINT,))  # blue is the faint lobe alone
GOLD = Material(name="gold", kd=(0.02, 0.01, 0.0), lobes=(Lobe(k=(0.9, 0.7, 0.1), mx=0.2, my=0.2, r0=(0.6,) * 3),))
BLUE, DEFICIT = 2, 0.005
WI = direction(np.radians([10.0, 30.0, 50.0, 70.0]), 0.0)
SEEN = "cuberoot"  # takes a reading below zero as 0, the other metrics take it as measured


def changed(file: Path, folder: Path, channel: int = 0, deficit: float = 0.0, noise: float = 0.0) -> MeasuredTable:
    """The table of an RGL file with a channel lowered, and noise about zero added."""
    tensors = dict(read_tensors(file))
    values = tensors["rgb"] + noise * np.random.default_rng(0).standard_normal(tensors["rgb"].shape)
    values[:, :, channel] -= deficit
    path = folder / "changed.bsdf"
    path.write_bytes(tensor_bytes(tensors | {"rgb": values.astype(np.float32)}))
    return load(path)


@pytest.fixture(scope="module", params=[YELLOW, GOLD], ids=lambda material: material.name)
def clean(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The RGL file of a saturated material, small."""
    path = tmp_path_factory.mktemp("clean") / "clean.bsdf"
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(rgl, "THETA_I_DEG", rgl.THETA_I_DEG[::4])
        patched.setitem(rgl.NODES, "isotropic", 24)
        rgl.write(request.param, path)
    return path


def light(table: MeasuredTable, metric: str) -> tuple[Floats, Floats]:
    """Albedo (3,) of the fit and of the whole table, means over theta_i."""
    bsdf = MaterialBSDF(fit(table, metric=metric).material)
    return bsdf.albedo(WI).mean(axis=0), table.reflectivity(WI).mean(axis=0)


@pytest.mark.parametrize("metric", [SEEN, "l1"])
def test_other_channels_do_not_notice_a_negative_one(clean: Path, tmp_path: Path, metric: str) -> None:
    before, table = load(clean), changed(clean, tmp_path, BLUE, DEFICIT)
    samples = table.samples()
    assert samples.below_zero > 0.15 * len(samples) and len(samples) == len(before.samples())
    (one, _), (other, _) = light(table, metric), light(before, metric)
    # The lobe's shape is shared, and the cube root sees that the blue lobe is cut off.
    np.testing.assert_allclose(one[:BLUE], other[:BLUE], rtol=0.025 if metric == SEEN else 0.02)
    assert 0 <= other[BLUE] - one[BLUE] < np.pi * DEFICIT


@pytest.mark.parametrize("metric", [SEEN, "l1"])
def test_noise_about_zero_leaves_the_albedo(clean: Path, tmp_path: Path, metric: str) -> None:
    table = changed(clean, tmp_path, noise=DEFICIT)
    assert table.samples().below_zero > 0.1 * len(table.samples())
    (one, _), (other, _) = light(table, metric), light(load(clean), metric)
    np.testing.assert_allclose(one, other, rtol=0.02, atol=0.003 if metric == SEEN else 0.001)


@pytest.mark.parametrize(("metric", "taken"), [("cuberoot", "as 0"), ("l1", "as measured"), ("log", "as measured")])
def test_what_was_done_is_said(metric: str, taken: str) -> None:
    samples = synthesise(YELLOW, replace(FEW, floor=0.01)).samples()
    provenance = fit(samples, metric=metric).material.provenance
    assert provenance is not None and provenance.samples["below_zero"] == samples.below_zero > 0
    assert provenance.samples["used"] == len(samples) and "negative" not in provenance.samples
    (line,) = (note for note in provenance.notes if "below zero" in note)
    assert line.startswith(f"{samples.below_zero} of {len(samples)} tuples") and "a fit keeps them" in line
    assert f"the {metric} metric counts them {taken}" in line
    clean = fit(synthesise(YELLOW, replace(FEW, floor=0.0)).samples(), metric=metric).material.provenance
    assert clean is not None and not any("below zero" in note for note in clean.notes)


@pytest.mark.parametrize("name", METRICS)
def test_transforms_of_negative_values(name: str) -> None:
    """Finite for any; noise about zero keeps no mean but under the cube root, whose slope at 0 would magnify it."""
    metric, x = METRICS[name], np.array([-30.0, -1.0, -0.1, -1e-3, 0.0])
    assert np.isfinite(metric.transform(x)).all() and metric.clamps == (name == SEEN)
    expected = np.full(5, metric.transform(0.0)) if metric.clamps else -metric.transform(-x)
    np.testing.assert_allclose(metric.transform(x), expected)
