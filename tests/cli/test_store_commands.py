"""Commands on a store: render without a bake, bake of what is quick, and what they refuse."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.light.false_colour import Range, false_colour
from lambent.core.light.photometry import LM_PER_W, photometric
from lambent.core.pictures.images import read_encoded, read_image
from tests.viewer.small_store import write_small_store


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_small_store(tmp_path_factory.mktemp("cli") / "small.store")


def test_still_in_every_format(lambent, store, tmp_path):
    shown = {}
    for suffix in ("png", "exr", "hdr"):
        file = tmp_path / f"a.{suffix}"
        outcome = lambent("render", store, "-o", file, "--size", "96x64", "--camera", "side", "--json")
        assert outcome.code == 0 and outcome.json["frames"] == 1, outcome
        shown[suffix] = read_image(file)
        assert shown[suffix].shape == (64, 96, 3)
    np.testing.assert_allclose(shown["hdr"], shown["exr"], rtol=0.02, atol=0.01)
    assert shown["png"].mean() > 0.02


def test_false_colour_names_the_luminance(lambent, store, tmp_path):
    """The plaster of the small store has a luminance of kd E/pi everywhere: the picture says so in its colour."""
    file = tmp_path / "a.png"
    common = ("render", store, "-o", file, "--size", "192x128", "--view", "false-colour", "--show", "diffuse")
    assert lambent(*common, "--range", "10:1000").code == 0
    floor = read_encoded(file)[-8, 20]
    expected = false_colour(photometric(np.array([0.6, 0.55, 0.5]) * 2 / np.pi), Range(10, 1000))
    np.testing.assert_allclose(floor, expected, atol=0.01)
    assert lambent(*common, "--linear").code == 0, "the range is found"


def test_luminance_and_illuminance_by_their_names(lambent, store, tmp_path):
    """2 W/m2 arrive everywhere; --show names the quantity, and the view and the unit follow."""
    file = tmp_path / "a.png"
    common = ("render", store, "-o", file, "--size", "192x128", "--force")
    for what, value, unit in (("illuminance", 2 * LM_PER_W, "lx"), ("luminance", 0, "cd/m2")):
        said = lambent(*common, "--show", what, "--range", "10:1000", "--json").json
        assert said["scale"] == {"low": 10, "high": 1000, "log": True, "unit": unit} and said["exposure_ev"] is None
        if value:
            expected = false_colour(np.array(value), Range(10, 1000))
            np.testing.assert_allclose(read_encoded(file)[-8, 20], expected, atol=0.01)


def test_exposure_as_ev100(lambent, store, tmp_path):
    common = ("render", store, "-o", tmp_path / "a.png", "--size", "32x24", "--force", "--json")
    assert lambent(*common, "--ev100", "9").json["ev100"] == pytest.approx(9)
    said = lambent(*common, "--exposure", "-2").json
    assert said["exposure_ev"] == -2 and said["ev100"] == pytest.approx(np.log2(LM_PER_W / 1.2) + 2)


def test_bake_of_the_geometry(lambent, tmp_path):
    outcome = lambent("bake", "builtin:box", "-o", tmp_path / "s", "--only", "geometry", "--json")
    assert outcome.code == 0, outcome
    assert outcome.json["arrays"]["geometry/faces"] == "complete"
    assert lambent("inspect", tmp_path / "s", "--json").json["is"] == "store"


def test_a_bake_says_what_its_scene_lost(lambent, tmp_path):
    corners = [f"v {x} {y} 0" for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    (tmp_path / "a.obj").write_text("\n".join([*corners, "v nan 0 0", "f 1 2 3", "f 1 3 4", "f 1 2 5"]))
    done = lambent("bake", tmp_path / "a.obj", "-o", tmp_path / "a.store", "--only", "geometry")
    assert "warning: object: 1 triangles dropped: a vertex is not finite" in done.err
