"""Published parameters are read strictly, evaluate as in their sources, and describe their materials."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.published.merl_fits import MERL_CHANNELS, read_fits

WARD = "a-b = Aggregate(Lambertian(albedo = [.1, 0.2, 3e-1]), NganWard(albedo = [0.01, 0.02, 0.03], roughness = 0.1))"
COOK = "c = Aggregate(Lambertian(albedo = [0, 0, 0]), NganCookTorrance(albedo = [1, 1, 1], eta = .04, roughness = .2))"
LOW = "d = Aggregate(Lambertian(albedo = [0, 0, 0]), LowCookTorrance(albedo = [1, 1, 1], roughness = .2, eta = 1.5))"
N = direction(0.0, 0.0)


def written(folder: Path, *lines: str) -> Path:
    file = folder / "some.fit"
    file.write_text("\n".join(("# from a paper", "", *lines)) + "\n", encoding="utf-8")
    return file


def test_values_at_normal_incidence_by_hand(tmp_path):
    """h = n: exp and masking are 1, F is r0, which is ((1.5 - 1)/(1.5 + 1))^2 = .04 of Low's glass too."""
    fits = read_fits(written(tmp_path, WARD, COOK, LOW))
    ward = (np.array([0.1, 0.2, 0.3]) / np.pi + np.array([0.01, 0.02, 0.03]) / (4 * np.pi * 0.01)) * MERL_CHANNELS
    np.testing.assert_allclose(fits["a-b"].eval(N, N), ward, rtol=1e-12)
    np.testing.assert_allclose(fits["c"].eval(N, N), 0.04 / (np.pi**2 * 0.04) * MERL_CHANNELS, rtol=1e-12)
    np.testing.assert_allclose(fits["d"].eval(N, N), [0.04 / (np.pi * 0.04)] * 3, rtol=1e-12)


def test_values_off_the_normal_by_hand(tmp_path):
    """wo = n, theta_i = 60 degrees: theta_h = theta_d = 30 degrees; grooves shadow nothing before 2 c30/2 > c30."""
    fits = read_fits(written(tmp_path, WARD, COOK))
    wi, bell = direction(np.pi / 3, 0.7), np.exp(-1 / 3 / 0.04) / 0.04
    fresnel = 0.04 + 0.96 * (1 - np.sqrt(0.75)) ** 5
    expected = bell / 0.75**2 * fresnel / (np.pi**2 * 0.5)
    np.testing.assert_allclose(fits["c"].eval(wi, N), expected * MERL_CHANNELS, rtol=1e-12)
    specular = 0.01 * np.exp(-1 / 3 / 0.01) / (4 * np.pi * 0.01 * np.sqrt(0.5))
    np.testing.assert_allclose(fits["a-b"].eval(N, wi)[0], 0.1 / np.pi + specular, rtol=1e-12)


@pytest.mark.parametrize("line", [WARD, COOK, LOW])
def test_reciprocal_and_black_below(tmp_path, line):
    (one,) = read_fits(written(tmp_path, line)).values()
    z, phi = np.random.default_rng(0).uniform((0.01, 0), (1, 6.28), (2, 500, 2)).transpose(2, 0, 1)
    wi, wo = direction(np.arccos(z), phi)
    np.testing.assert_allclose(one.eval(wi, wo), one.eval(wo, wi), rtol=1e-9)
    assert np.isfinite(one.eval(wi, wo)).all() and not one.eval(wi * [1, 1, -1], wo).any()


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("__import__('os').system('true')", "line 3"),
        (WARD.replace("NganWard", "NganWart"), "did you mean 'NganWard'"),
        (WARD.replace("roughness", "rough"), "wrong fields"),
        (WARD.replace("roughness = 0.1", "roughness = 0"), "roughness"),
        (WARD.replace("[0.01, 0.02, 0.03]", "0.5"), "albedo is"),
        (WARD.replace("[.1,", "[-.1,"), "Lambertian albedo"),
        (WARD.replace("3e-1]", "3e-1, 4]"), "line 3"),
        (COOK.replace("eta = .04", "eta = 1.5"), "eta"),
        (f"{WARD}\n{WARD}", "the same name"),
        ("# nothing", "no material"),
    ],
)
def test_nonsense_is_refused(tmp_path, line, complaint):
    with pytest.raises(UserError, match=complaint.replace("'", ".")):
        read_fits(written(tmp_path, line))


def test_the_published_files_are_read_whole(shared_data):
    files = list((shared_data / "fits").glob("*.fit"))
    counts = [len(read_fits(file)) for file in files]
    lines = [sum("Aggregate" in line for line in file.read_text().splitlines()) for file in files]
    assert counts == lines and min(counts) >= 86
