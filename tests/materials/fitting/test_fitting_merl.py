"""The fit on neural approximations of MERL materials: shares of the best Lambertian's error, and published fits."""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from statistics import geometric_mean

import pytest

from lambent.materials.fitting.account import lambertian_errors
from lambent.materials.fitting.fit import fit
from lambent.materials.measured.inspecting.metrics import errors_of
from lambent.materials.measured.protocol import MeasuredSamples
from lambent.materials.measured.registry import load
from lambent.published.merl_fits import read_fits

pytestmark = pytest.mark.slow
MATERIALS = (
    "alum-bronze", "blue-metallic-paint", "chrome", "gold-metallic-paint", "nickel", "pearl-paint", "red-fabric",
    "specular-maroon-phenolic", "teflon",
)  # fmt: skip
TUPLES = 4_000
MOST = {
    ("cuberoot", "beckmann"): (0.40, 0.27),
    ("cuberoot", "ggx"): (0.26, 0.20),
    ("l2_ngan", "beckmann"): (0.37, 0.28),
}
"""(metric, distribution) -> geometric mean of the share that one lobe and two lobes may leave."""


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


@pytest.mark.parametrize(("metric", "distribution"), MOST)
def test_shares_of_the_lambertian_error(merl, metric, distribution):
    shares = []
    for name in MATERIALS:
        results = [fit(merl(name), lobes=n, metric=metric, distribution=distribution) for n in (1, 2)]
        shares.append([r.errors[metric] / r.lambertian_errors[metric] for r in results])
        assert shares[-1][1] <= shares[-1][0], f"{name}: two lobes explain less than one"
    for column, most in zip(zip(*shares, strict=True), MOST[metric, distribution], strict=True):
        assert geometric_mean(column) <= most


@pytest.mark.parametrize("metric", ["cuberoot", "log", "l2_ngan"])
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


@pytest.mark.parametrize(("name", "share"), [("alum-bronze", 0.8), ("nickel", 0.5), ("pearl-paint", 0.5)])
def test_published_fits_explain_shiny_materials(merl, shared_data, name, share):
    """Otherwise their parameters would be misread, and easily beaten."""
    ward = read_fits(shared_data / "fits" / "ngan_ward.fit")[name]
    samples = merl(name)
    assert errors_of(samples, ward.eval(samples.wi, samples.wo))["log"] < share * lambertian_errors(samples)["log"]
