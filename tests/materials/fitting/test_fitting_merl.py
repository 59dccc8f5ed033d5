"""The fit on neural approximations of MERL materials: one lobe beats every published fit."""

from __future__ import annotations

import subprocess
import sys
from functools import cache

import pytest

from lambent.materials.fitting.account import lambertian_errors
from lambent.materials.fitting.fit import fit
from lambent.materials.measured.inspecting.metrics import errors_of
from lambent.materials.measured.protocol import MeasuredSamples
from lambent.materials.measured.registry import load
from lambent.published.merl_fits import read_fits

pytestmark = pytest.mark.slow
MATERIALS = ("alum-bronze", "nickel")
TUPLES = 4_000


@pytest.fixture(scope="module")
def merl(shared_data, tmp_path_factory):
    """Material -> its tuples, decoded on first use."""
    pytest.importorskip("h5py", reason="neural MERL files are HDF5: needs h5py")
    folder, target = shared_data / "measured" / "merl-neural", tmp_path_factory.mktemp("merl")

    @cache
    def samples(name: str) -> MeasuredSamples:
        file = target / f"{name}.binary"
        archive = folder / "merl_nbrdf_subset.zip"
        subprocess.run([sys.executable, folder / "decode_nbrdf.py", archive, name, file], check=True, timeout=120)
        found = load(file).samples(TUPLES)
        file.unlink()
        return found

    return samples


@pytest.mark.parametrize("metric", ["cuberoot", "l2_ngan"])
def test_one_lobe_beats_every_published_fit(merl, shared_data, metric):
    published = [read_fits(path) for path in sorted((shared_data / "fits").glob("*.fit"))]
    compared = 0
    for name in MATERIALS:
        samples = merl(name)
        ours = fit(samples, metric=metric).errors[metric]
        for fits in published:
            if name in fits:
                compared += 1
                assert ours < errors_of(samples, fits[name].eval(samples.wi, samples.wo))[metric], name
    assert compared >= 3 * len(MATERIALS)


@pytest.mark.parametrize(("name", "share"), [("alum-bronze", 0.8), ("nickel", 0.5)])
def test_published_fits_explain_shiny_materials(merl, shared_data, name, share):
    """Otherwise their parameters would be misread, and easily beaten."""
    ward = read_fits(shared_data / "fits" / "ngan_ward.fit")[name]
    samples = merl(name)
    assert errors_of(samples, ward.eval(samples.wi, samples.wo))["log"] < share * lambertian_errors(samples)["log"]
