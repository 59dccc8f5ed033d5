"""`lambent illuminance`: tables and pages of grids, states of the light, and what is refused."""

from __future__ import annotations

import csv
import re
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.core.outputs import is_marked
from lambent.scenes.loaders.load import load_scene
from lambent.store.store import Store
from tests.baking.small_scenes import TINY
from tests.traced.lit_grids import CANDELA, PLANE, VERTICAL_DEG, lux_from, write_hall

pytestmark = [pytest.mark.usefixtures("mi"), pytest.mark.slow]
LAMP = (0.4, 2.6, -0.3)
SCENE = f"""[[lights]]
kind = "ies"
name = "desk lamp"
file = "lamp.ies"
position = {list(LAMP)}
{PLANE}
[[grids]]
name = "=wall $x$"
corner = [-2, 1, -2]
edges = [[4, 0, 0], [0, 1.5, 0]]
spacing_m = 0.5
[[variants]]
name = "evening"
light = {{ "desk lamp" = 0.25 }}
"""


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory, mi: Any) -> Path:
    folder = tmp_path_factory.mktemp("hall")
    scene = load_scene(str(write_hall(folder, SCENE)))
    return bake(scene, folder / "hall.store", quality=TINY, only=("light_map",), light_groups="scene").folder


def points_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def words_of(pdf: Path) -> str:
    """The text that a PDF shows, a line for each piece."""
    streams = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", pdf.read_bytes(), re.DOTALL)
    shown = b"\n".join(zlib.decompress(one) for one in streams if one[:1] == b"x").decode("latin-1")
    pieces = [re.findall(r"\(((?:\\.|[^\\)])*)\)", block) for block in re.findall(r"BT(.*?)ET", shown, re.DOTALL)]
    return re.sub(r"\\(.)", r"\1", "\n".join("".join(one) for one in pieces))


@pytest.mark.long
def test_a_table_has_every_point_with_the_light_of_the_lamp(lambent, store, tmp_path):
    file = tmp_path / "a.csv"
    outcome = lambent("illuminance", store, "-o", file, "--grid", "plane", "--json")
    assert outcome.code == 0, outcome
    rows = points_of(file)
    assert list(rows[0]) == ["x_m", "y_m", "z_m", "lx", "standard_error_lx", "grid", "light"]
    points = np.array([[float(row[key]) for key in ("x_m", "y_m", "z_m")] for row in rows])
    lx = np.array([float(row["lx"]) for row in rows])
    expected = lux_from(LAMP, points, np.array([0.0, 1, 0]), lambda deg: np.interp(deg, VERTICAL_DEG, CANDELA))
    np.testing.assert_allclose(lx, expected, rtol=5e-3)
    (result,) = outcome.json["results"]
    assert (result["points"], result["grid"], result["light"]) == (len(rows), "plane", "as baked") and len(rows) == 40
    assert [result[key] for key in ("mean_lx", "min_lx", "max_lx")] == pytest.approx(
        [lx.mean(), lx.min(), lx.max()], rel=1e-4
    )
    assert result["U0"] == pytest.approx(lx.min() / lx.mean(), rel=1e-4)
    assert result["Ud"] == pytest.approx(lx.min() / lx.max(), rel=1e-4)
    assert all(float(row["standard_error_lx"]) <= 0.005 * float(row["lx"]) for row in rows)
    assert "exists already" in lambent("illuminance", store, "-o", file).err, "a table is not replaced unasked"


@pytest.mark.long
def test_each_state_of_the_light_has_a_page(lambent, store, tmp_path):
    file, table = tmp_path / "a.pdf", tmp_path / "a.csv"
    common = ("illuminance", store, "--variant", "evening", "--maintenance", "0.8")
    outcome = lambent(*common, "-o", file, "-o", table, "--json")
    assert outcome.code == 0, outcome
    plain, evening = (lambent(*common[:2], *more, "--json").json["results"] for more in ((), common[2:4]))
    assert [one["light"] for one in evening] == ["evening"] * 2 and {one["light"] for one in plain} == {"as baked"}
    for before, after, kept in zip(plain, evening, outcome.json["results"], strict=True):
        assert after["mean_lx"] == pytest.approx(0.25 * before["mean_lx"], rel=0.01)
        assert kept["mean_lx"] == pytest.approx(0.8 * after["mean_lx"], rel=0.01)
    assert len(re.findall(rb"/Type /Page\b", file.read_bytes())) == 2 and is_marked(file)
    assert {row["grid"] for row in points_of(table)} == {"plane", "=wall $x$"}
    words = words_of(file)
    for said in ("hall (hall.store), baked 20", "grid: =wall $x$", "light: evening", "U0: ", "maintenance factor 0.8",
                 "corner, m: [-2.0, 1.0, -2.0]", "lx"):  # fmt: skip
        assert said in words, said
    mean = outcome.json["results"][0]["mean_lx"]
    assert f"mean_lx: {mean:.4g}" in words
    assert lambent(*common, "-o", file).code == 0, "pages are Lambent's own"


@pytest.mark.long
def test_a_grid_over_an_object_in_a_mix(lambent, store, tmp_path):
    common = ("illuminance", store, "--object", "flo*", "--json")
    whole = lambent(*common).json["results"][0]
    assert whole["grid"] == "flo*" and whole["points"] == 40, "the band of half a metre is left out"
    off = lambent(*common, "--light", "desk lamp=off").json["results"][0]
    assert (off["light"], off["max_lx"], off["U0"]) == ("desk lamp=off", 0, 0)
    near = lambent(*common, "--height", "0", "--spacing", "1", "--margin", "0").json["results"][0]
    assert near["points"] == 24 and near["mean_lx"] < whole["mean_lx"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("-o", "a.txt"), "unknown kind of file; found .txt; expected .csv, .pdf"),
        (("--grid", "plan"), "--grid: unknown grid; found plan; expected plane, =wall $x$; did you mean 'plane'?"),
        (("--object", "flor"), "--object: matches no object; found flor; did you mean 'floor'?"),
        (("--object", "left"), "--object: object has no level top"),
        (("--object", "floor", "--margin", "2"), "--object: a margin of 2 m leaves nothing of 4 m"),
        (("--object", "floor", "--spacing", "0.001"), "--object: grid has too many points"),
        (("--object", "floor", "--height", "nan"), "--object: height_m: "),
        (("--object", ""), "--object: name: "),
        (("--height", "1"), "apply to --object only"),
        (("--object", "floor", "--grid", "plane"), "--grid: excludes --object"),
        (("--light", "lump=off"), "unknown light group; found lump"),
        (("--light", "lamp"), "is no light setting"),
        (("--variant", "evning"), "did you mean 'evening'?"),
        (("--error", "0"), "--error"),
        (("--maintenance", "1.2"), "--maintenance"),
    ],
)
def test_what_is_refused(refused, store, options, words):
    assert words in refused("illuminance", store, *options)


@pytest.mark.long
def test_a_grid_added_after_the_bake_needs_no_other(lambent, tmp_path):
    scene, store = write_hall(tmp_path, SCENE.split("[[grids]]")[0]), tmp_path / "a.store"
    common = ("bake", scene, "-o", store, "--quality", "preview", "--only", "light_map")
    assert lambent(*common).code == 0
    keys = {one.name: one.key for one in Store.open(store).artefacts()}
    scene.write_text(scene.read_text() + PLANE)
    outcome = lambent("illuminance", store, "--json")
    assert outcome.code == 0 and outcome.json["results"][0]["mean_lx"] > 10
    assert lambent(*common).code == 0 and {one.name: one.key for one in Store.open(store).artefacts()} == keys


@pytest.mark.long
def test_a_store_that_cannot_be_traced_says_why(refused, lambent, tmp_path):
    scene = load_scene(str(write_hall(tmp_path, "")))
    bare = bake(scene, tmp_path / "a.store", quality=TINY, only=("geometry",)).folder
    assert "cannot be traced: the store has no light map" in refused("illuminance", bare, "--object", "floor")
    lit = bake(scene, tmp_path / "b.store", quality=TINY, only=("light_map",)).folder
    assert "scene has no grids; add [[grids]] to its scene.toml, or --object NAME" in refused("illuminance", lit)
    assert "the store has no light groups" in refused("illuminance", lit, "--object", "floor", "--light", "a=off")
