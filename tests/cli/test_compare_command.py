"""`lambent compare`: figures known by hand of EXR, HDR and PNG files of one colour, and the order of arguments."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from lambent.core.pictures.images import write_image, write_shown

SHOWN_MEAN = 0.3  # of a reference that holds radiance
BYTE = 128


def flat(path: Path, value: float) -> Path:
    write_image(path, np.full((20, 24, 3), value, np.float32))
    return path


@pytest.fixture
def shown(tmp_path: Path) -> Path:
    """A PNG of one grey."""
    write_shown(tmp_path / "shown.png", np.full((20, 24, 3), BYTE, np.uint8))
    return tmp_path / "shown.png"


def encoded(linear: float) -> float:
    return 1.055 * linear ** (1 / 2.4) - 0.055


def db(difference: float) -> float:
    return -20 * math.log10(abs(difference))


@pytest.mark.parametrize("suffixes", [(".exr", ".exr"), (".exr", ".HDR")])
@pytest.mark.parametrize(("reference", "test"), [(8.0, 4.0), (4.0, 8.0)])
def test_radiance_is_shown_at_the_exposure_of_the_reference(
    lambent, tmp_path: Path, suffixes: tuple[str, str], reference: float, test: float
) -> None:
    files = flat(tmp_path / f"a{suffixes[0]}", reference), flat(tmp_path / f"b{suffixes[1]}", test)
    facts = lambent("compare", *files, "--json").json
    assert facts["compared_as"] == "radiance" and facts["size"] == [24, 20]
    seen = SHOWN_MEAN * (test / reference) ** (1 / 2.2)
    assert facts["psnr_db"] == pytest.approx(db(SHOWN_MEAN - seen), abs=1e-3)
    assert facts["rmse_rgb"] == pytest.approx([4.0] * 3), "of the radiance itself, far above white"
    lightness = [116 * value ** (1 / 3) - 16 for value in (reference, test)]
    assert facts["rmse_lab"][0] == pytest.approx(abs(lightness[0] - lightness[1]), rel=1e-4)
    assert facts["rmse_lab"][1:] == pytest.approx([0.0, 0.0], abs=0.02)
    assert facts["flip_mean"] == pytest.approx(facts["flip_worst_tile"], rel=0.05) and facts["flip_mean"] > 0.01


@pytest.mark.parametrize("exr_first", [True, False], ids=["EXR with PNG", "PNG with EXR"])
def test_one_png_makes_it_a_comparison_of_what_is_shown(lambent, tmp_path: Path, shown: Path, exr_first: bool) -> None:
    radiance = 0.25
    files = flat(tmp_path / "a.exr", radiance), shown
    facts = lambent("compare", *(files if exr_first else files[::-1]), "--json").json
    assert facts["compared_as"] == "display"
    assert facts["psnr_db"] == pytest.approx(db(encoded(radiance) - BYTE / 255), abs=1e-3)
    linear = ((BYTE / 255 + 0.055) / 1.055) ** 2.4
    assert facts["rmse_rgb"] == pytest.approx([abs(radiance - linear)] * 3, rel=1e-4)


def test_the_second_image_is_the_one_that_is_judged(refused, tmp_path: Path) -> None:
    small = tmp_path / "small.exr"
    write_image(small, np.ones((10, 12, 3), np.float32))
    whole = flat(tmp_path / "whole.exr", 1.0)
    said = refused("compare", whole, small)
    assert f"{small}: " in said and "found 12x10; expected 24x20" in said
    assert "found 24x20; expected 12x10" in refused("compare", small, whole)
