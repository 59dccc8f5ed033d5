"""What is installed: the base without extras, the wheel outside of the checkout, completion in the shells."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from lambent.cli.doctor import PACKAGES
from lambent.core.extras import EXTRAS
from tests.viewer.editor.measured_specimens import BRASS, write_measurement

ROOT = Path(__file__).parents[2]
RUN = f"""
import importlib.abc, json, sys
class Blocked(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name.partition(".")[0] in {sorted(EXTRAS)}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Blocked())
from lambent.cli.main import run
sys.exit(run(json.loads(sys.argv[1])))
"""


@pytest.fixture
def base(tmp_path):
    """Runs a command where no package of an extra is installed."""
    import json

    def run(*words):
        command = [sys.executable, "-c", RUN, json.dumps([str(word) for word in words])]
        return subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)

    return run


@pytest.mark.long
def test_the_base_fits_converts_and_checks(base, tmp_path):
    table = write_measurement(tmp_path / "brass.txt", BRASS)
    for words in (
        ("inspect", table),
        ("fit", table, "-o", "brass.json", "--report", "brass.html"),
        ("check", "brass.json"),
        ("convert", "brass.json", "brass.mtlx"),
        ("inspect", "builtin:box"),
    ):
        done = base(*words)
        assert done.returncode == 0, done.stderr
    assert "mitsuba: is not installed; run `pip install" in (tmp_path / "brass.html").read_text()


@pytest.mark.parametrize(
    ("words", "extra"),
    [(("bake", "builtin:box", "-o", "box.store"), "bake"), (("edit", "builtin:box"), "walk"), (("demo",), "bake")],
)
def test_a_missing_extra_is_one_line(base, words, extra):
    done = base(*words)
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert f"is not installed; run `pip install 'lambent[{extra}]'`" in done.stderr


def test_every_package_of_an_extra_is_declared():
    import tomllib

    declared = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
    named = {"drjit": "mitsuba"}
    for package, extra in EXTRAS.items():
        wanted = named.get(package, package).replace("_", "-")
        assert wanted in declared[extra], f"{package} of lambent[{extra}]"


@pytest.mark.parametrize(
    ("shell", "words", "expected"),
    [
        ("bash", {"COMP_WORDS": "lambent ins", "COMP_CWORD": "1"}, "inspect"),
        ("zsh", {"_TYPER_COMPLETE_ARGS": "lambent fit --lob"}, "--lobes"),
        ("fish", {"_TYPER_COMPLETE_ARGS": "lambent rel", "_TYPER_COMPLETE_FISH_ACTION": "get-args"}, "relight"),
    ],
)
def test_shells_complete_commands_and_options(shell, words, expected):
    asked = {**os.environ, "_LAMBENT_COMPLETE": f"complete_{shell}", **words}
    command = [sys.executable, "-m", "lambent.cli.main"]
    done = subprocess.run(command, capture_output=True, text=True, env=asked, cwd=ROOT)
    assert expected in done.stdout, done


def test_the_container_installs_what_the_doctor_asks_for():
    lines = (ROOT / "Containerfile").read_text("utf-8").replace("\\\n", " ").splitlines()
    words = {word for line in lines if line.startswith("RUN") for word in line.split()}
    for check in ("path tracer", "graphics"):
        for package in PACKAGES[check]["apt-get"]:
            assert words & {*package.split("|")}, package
    copied = [word for line in lines if line.startswith("COPY") for word in line.split()[1:-1]]
    kept = {line[1:] for line in (ROOT / ".dockerignore").read_text("utf-8").splitlines() if line.startswith("!")}
    assert {*copied} == kept and all((ROOT / name).exists() for name in copied)


@pytest.mark.long
def test_the_wheel_works_outside_of_the_checkout(mi, tmp_path):
    pip, source = [sys.executable, "-m", "pip", "--disable-pip-version-check", "-q"], tmp_path / "source"
    for folder in ("lambent", "integrations"):
        shutil.copytree(ROOT / folder, source / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    built = subprocess.run([*pip, "wheel", "--no-deps", "-w", tmp_path, source], capture_output=True, text=True)
    if built.returncode and "setuptools" in built.stderr:
        pytest.skip("the build backend cannot be fetched")
    assert built.returncode == 0, built.stderr
    (wheel,) = tmp_path.glob("lambent-*.whl")
    names = set(zipfile.ZipFile(wheel).namelist())
    package = ROOT / "lambent"
    data = {str(p.relative_to(ROOT)) for end in ("*.wgsl", "*.toml", "*.csv", "py.typed") for p in package.rglob(end)}
    extension = {f"lambent_blender/{p.name}" for p in (ROOT / "integrations/blender/lambent_blender").glob("*.*")}
    assert data | extension <= names and not any(name.startswith(("tests/", "docs/")) for name in names)
    subprocess.run([*pip, "install", "--no-deps", "--target", tmp_path / "site", wheel], check=True)
    code = (
        "import lambent; s = lambent.bake('builtin:box', 'box.store', only={'light_map'}, progress=True);"
        "one, = s.illuminance(over='floor', spacing_m=.4, margin_m=.1, error=.1);"
        "print(lambent.__file__, one.facts()['mean_lx'])"
    )
    outside = {**os.environ, "PYTHONPATH": str(tmp_path / "site"), "PYTHONSAFEPATH": "1"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, env=outside)
    file, _, mean_lx = done.stdout.strip().rpartition(" ")
    assert done.returncode == 0 and file.startswith(str(tmp_path)) and float(mean_lx) > 0, done.stderr
