"""The extension in Blender: its package, its operators, its background processes, and the light that comes back."""

from __future__ import annotations

import importlib.util
import json
import math
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from lambent.materials.document import Material

ROOT = Path(__file__).parents[2]
WATTS, HEIGHT_M, LAMP = 100.0, 2.0, np.array([0.6, 0.5])  # of blender_scenes/pool.py
STAND_IN = """#!{python}
import json, pathlib, signal, subprocess, sys
here = pathlib.Path({folder!r})
with open(here / "asked.txt", "a") as said:
    said.write(json.dumps(sys.argv[1:]) + "\\n")
print("light map: 3.1 s", file=sys.stderr, flush=True)
if (here / "fails").exists():
    sys.exit("error: out of paint")
if (here / "waits").exists():
    print("waiting", file=sys.stderr, flush=True)
    signal.pause()
if sys.argv[1] in {real!r}:
    sys.exit(subprocess.call([sys.executable, "-m", "lambent.cli.main", *sys.argv[1:]]))
"""


def stand_in(folder: Path, *real: str) -> Path:
    """A program that writes down what it is asked, and passes the `real` commands on to Lambent."""
    program = folder / "stand in" / "lambent"
    program.parent.mkdir()
    program.write_text(STAND_IN.format(python=sys.executable, folder=str(folder), real=real))
    program.chmod(0o755)
    return program


def asked(folder: Path) -> list[list[str]]:
    return [json.loads(line) for line in (folder / "asked.txt").read_text().splitlines()]


def test_blender_accepts_the_package(blender, tmp_path):
    done = subprocess.run(
        [sys.executable, ROOT / "integrations/blender/build.py", tmp_path], capture_output=True, text=True, check=True
    )
    package = Path(done.stdout.strip())
    names = zipfile.ZipFile(package).namelist()
    assert {"__init__.py", "blender_manifest.toml", "export.py"} <= set(names) and not [n for n in names if "/" in n]
    bpy = Path(importlib.util.find_spec("bpy").origin).parent
    (validator,) = bpy.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    said = subprocess.run([sys.executable, validator, "validate", package], capture_output=True, text=True)
    assert said.returncode == 0, said.stdout + said.stderr


@pytest.mark.long
def test_what_the_user_can_mend_is_one_line(blender, tmp_path):
    said = blender("extension", "refusals", tmp_path, "lambent")
    assert "has nothing to export: no mesh is visible in renders" in said["empty"] and not said["written"]
    assert "Save the .blend first" in said["unsaved"]
    assert "is not an export of Blender: choose another folder" in said["foreign"]
    assert "material paint: //paint.json is relative to a .blend that is not saved: it stays" in said["notes"]
    assert "cannot be started" in said["no store"] or "not a store" in said["no store"]
    assert all("\n" not in line for name, line in said.items() if name not in ("notes", "written"))


@pytest.mark.long
def test_bake_and_walk_run_in_the_background(blender, tmp_path):
    said = blender("extension", "jobs", tmp_path, stand_in(tmp_path))
    store, scene = str(tmp_path / "box.store"), str(tmp_path / "box.lambent/scene.toml")
    bake, walk = ["bake", scene, "-o", store, "--quality", "final"], ["walk", store]
    assert asked(tmp_path)[:2] == [bake, walk] and said["done"] == ["bake", "walk", "done", "light map: 3.1 s"]
    assert said["can start again"]
    assert said["failed"][-2:] == ["failed", "error: out of paint"]
    assert said["running"] == [True, False]
    assert said["stopped"][-2:] == ["stopped", "stopped; finished work stays, and the next bake continues"]
    assert said["missing"][-2] == "failed" and "cannot be started (No such file" in said["missing"][-1]
    assert [words[0] for words in asked(tmp_path)] == ["bake", "walk", "bake", "bake"]


@pytest.mark.long
def test_panels_offer_what_there_is(blender, tmp_path):
    found = blender("extension", "panels", tmp_path, stand_in(tmp_path))
    assert found["shown"] == {
        "LAMBENT_PT_sidebar": [
            "Quality", "Bake and walk", "Stop", "walk: done", "light map: 3.1 s", "Export", "Import light map"
        ],
        "LAMBENT_PT_material": ["File", "Preview"], "LAMBENT_PT_light": ["Luminaire"],
        "LAMBENT_PT_object": ["Light field"], "LAMBENT_PT_collection": ["Light group"],
    }  # fmt: skip
    assert found["gone"]


@pytest.mark.long
def test_a_material_shows_the_likeness_of_its_document(blender, tmp_path):
    Material(name="paint", kd=(0.6, 0.3, 0.1)).save(tmp_path / "paint.json")
    found = blender("extension", "likeness", tmp_path, stand_in(tmp_path, "convert"))
    assert found["colour"] == pytest.approx([0.6, 0.3, 0.1], abs=0.01) and found["metallic"] == 0
    assert found["objects"] == ["box"] and found["materials"] == ["paint"]
    assert "paint.json" in found["missing"] and "No such file" in found["missing"]


@pytest.mark.long
def test_the_light_of_a_bake_comes_back_to_blender(blender, mi, tmp_path):
    blender("pool", tmp_path)
    found = blender("extension", "walked", tmp_path, stand_in(tmp_path, "bake", "lightmap"))
    assert found["states"][-2] == "done" and asked(tmp_path)[1] == ["walk", str(tmp_path / "pool.store")]
    places, uv = (np.array(values) for values in zip(*found["points"], strict=True))
    image = np.array(found["image"])[..., 1]
    height, width = image.shape
    # the affine map from texture coordinates to the floor, in metres
    to_floor = np.linalg.lstsq(np.c_[uv, np.ones(len(uv))], places[:, :2] / 100, rcond=None)[0]
    rows, columns = np.mgrid[:height, :width]
    at = np.stack([(columns + 0.5) / width, (rows + 0.5) / height, np.ones((height, width))], axis=-1) @ to_floor
    inside = (at[..., 0] > 0.05) & (at[..., 0] < 1.95) & (np.abs(at[..., 1]) < 1.95)
    distance_m = np.sqrt(HEIGHT_M**2 + ((at - LAMP) ** 2).sum(axis=-1))
    expected = WATTS / (4 * math.pi) * HEIGHT_M / distance_m**3
    assert inside.sum() > 1000 and image[inside] == pytest.approx(expected[inside], rel=0.03)
    brightest = at[np.unravel_index(np.where(inside, image, 0).argmax(), image.shape)]
    assert brightest == pytest.approx(LAMP, abs=0.15)
