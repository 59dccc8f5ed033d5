"""Every command: its help, and one clear line for whatever a user gets wrong."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from lambent import __version__, cli
from lambent.cli import materials
from lambent.cli.main import UNNAMED
from lambent.core.discovery import names_in
from lambent.core.pictures.images import write_image, write_shown
from lambent.materials.document import Lobe, Material, load_material
from lambent.materials.measured.inspecting.synthetic import Setup, synthesise
from lambent.materials.measured.parts.gonio_text import write_gonio

COMMANDS = [
    name for folder in (cli, materials) for name in names_in(folder) if name not in ("main", "console", "materials")
]
NEEDS_ARGUMENTS = [name for name in COMMANDS if name not in ("doctor", "demo")]
PICTURE = np.random.default_rng(3).random((32, 48, 3)).astype(np.float32)


@pytest.fixture
def material(tmp_path: Path) -> Path:
    Material(name="brass", kd=0.1, lobes=(Lobe(k=0.5, mx=0.1, my=0.2),)).save(tmp_path / "brass.json")
    return tmp_path / "brass.json"


@pytest.fixture
def pictures(tmp_path: Path) -> tuple[Path, Path]:
    a, b = tmp_path / "a.png", tmp_path / "b.png"
    write_image(a, PICTURE)
    write_image(b, PICTURE * 0.9)
    return a, b


@pytest.mark.parametrize("command", COMMANDS)
def test_help_shows_an_example_and_json(lambent, command):
    outcome = lambent(command, "--help")
    assert (outcome.code, outcome.err) == (0, "")
    assert f"Example: lambent {command}" in outcome.out
    assert "--json" in outcome.out or command in ("walk", "view", "edit", "demo", "serve")


def test_no_command_shows_help(lambent):
    outcome = lambent()
    assert outcome.code == 0 and all(name in outcome.out for name in COMMANDS)


def test_a_command_is_a_file(lambent, monkeypatch, tmp_path):
    (tmp_path / "hello.py").write_text(
        'import typer\n\ndef command() -> None:\n    """Greet."""\n    typer.echo("hello")\n'
    )
    monkeypatch.setattr(cli, "__path__", [*cli.__path__, str(tmp_path)])
    assert "Greet." in lambent("--help").out
    assert lambent("hello").out == "hello\n"
    sys.modules.pop("lambent.cli.hello")


def test_version(lambent):
    assert lambent("--version").out == f"{__version__}\n"


@pytest.mark.parametrize("command", NEEDS_ARGUMENTS)
def test_missing_argument(refused, command):
    assert "Missing argument" in refused(command) or "Missing option" in refused(command)


@pytest.mark.parametrize("command", COMMANDS)
def test_unknown_option(refused, command):
    said = refused(command, "--bogus")
    assert "No such option: --bogus" in said and f"(see `lambent {command} --help`)" in said


@pytest.mark.parametrize("command", ["fit", "inspect", "check"])
@pytest.mark.parametrize("content", [b"", b"{", b"\x00" * 100])
def test_garbage(refused, tmp_path, command, content):
    (tmp_path / "garbage").write_bytes(content)
    refused(command, tmp_path / "garbage")


def test_compare(lambent, pictures, tmp_path):
    outcome = lambent("compare", *pictures, "-o", tmp_path / "d.png", "--json")
    assert outcome.code == 0 and (tmp_path / "d.png").exists()
    facts = outcome.json
    assert facts["size"] == [48, 32] and 20 < facts["psnr_db"] < 40
    assert facts["flip_mean"] <= facts["flip_worst_tile"]
    same = lambent("compare", pictures[0], pictures[0], "--json").json
    assert same["psnr_db"] is None and same["flip_worst_tile"] == 0
    assert "inf dB" in lambent("compare", pictures[0], pictures[0]).out


@pytest.mark.long
def test_check_passes_and_fails_by_exit_code(lambent, material):
    good = lambent("check", material, "--json")
    assert good.code == 0 and good.json["passed"]
    Material(name="bright", kd=1.5).save(material)
    bad = lambent("check", material)
    assert bad.code == 1 and "failed" in bad.out


@pytest.mark.long
def test_inspect_material_and_plot(lambent, material, tmp_path):
    facts = lambent("inspect", material, "--plot", tmp_path / "p.png", "--json").json
    assert facts["is"] == "material" and facts["lobe 1"]["my"] == 0.2
    assert (tmp_path / "p.png").stat().st_size > 10_000
    assert "mx" in lambent("inspect", material).out


@pytest.mark.long
def test_fit_writes_a_material_that_check_takes(lambent, shared_data, tmp_path):
    file = shared_data / "measured/cornell/garnet_red.brdf"
    facts = lambent("fit", file, "-o", tmp_path / "m.json", "--json").json
    assert set(facts["errors"]) == {"l1", "l2_ngan", "cuberoot", "log"}
    assert all(facts["errors"][name] <= facts["lambertian_errors"][name] for name in ("cuberoot", "log"))
    assert json.loads((tmp_path / "m.json").read_text()) == facts["material"]
    text = lambent("fit", file, "--fix", "r0=0.05")
    assert "0.0500 0.0500 0.0500  reflectance at normal incidence" in text.out


@pytest.mark.parametrize("cause", [None, SystemError("returned a result with an exception set")])
def test_an_interruption_is_one_line_and_130(lambent, monkeypatch, material, cause):
    """Of the command, or of an import that a library reports as its own error."""

    def interrupt(*_, **__):
        raise KeyboardInterrupt if cause is None else cause from KeyboardInterrupt()

    monkeypatch.setattr("lambent.materials.checking.check.check", interrupt)
    outcome = lambent("check", material)
    assert (outcome.code, outcome.out) == (130, "")
    assert outcome.err.splitlines()[-1] == "lambent: interrupted; finished work is kept"


def test_an_interrupted_fit_gives_the_best_so_far_and_130(lambent, monkeypatch, tmp_path):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    setup = Setup((0.0, 30.0, 60.0), step_deg=15, fine_deg=15, noise=0.0, floor=0.0)
    write_gonio(tmp_path / "m.txt", synthesise(Material(name="m", kd=0.3), setup))
    monkeypatch.setattr("lambent.materials.fitting.gradient._descend", interrupt)
    outcome = lambent("fit", tmp_path / "m.txt", "-o", tmp_path / "m.json", "--json")
    assert outcome.code == 130 and outcome.json["partial"]
    assert "cancelled" in outcome.err and outcome.err.endswith("lambent: interrupted; finished work is kept\n")
    assert load_material(tmp_path / "m.json").kd[0] == pytest.approx(0.3, rel=0.01)


@pytest.mark.parametrize(
    ("error", "said"),
    [((28, "No space left on device"), f"{UNNAMED}: cannot be written (No space left on device)"),
     ((2, "No such file or directory", "/proc/d.png"), "/proc/d.png: cannot be written (No such file or directory)")],
)  # fmt: skip
def test_a_disk_that_takes_no_file_is_one_line(lambent, monkeypatch, pictures, tmp_path, error, said):
    def full(*_, **__):
        raise OSError(*error)

    monkeypatch.setattr("lambent.core.pictures.images.write_image", full)
    outcome = lambent("compare", *pictures, "-o", tmp_path / "d.png")
    assert (outcome.code, outcome.err) == (2, f"lambent: error: {said}\n")


@pytest.mark.long
def test_a_reader_that_leaves_is_no_error():
    """`lambent ... | head -1`"""
    process = subprocess.Popen(
        [sys.executable, "-m", "lambent.cli.main", "inspect", "builtin:box"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    assert process.stdout is not None and process.stderr is not None
    process.stdout.close()
    assert b"Traceback" not in process.stderr.read()
    process.stderr.close()
    process.wait()


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
